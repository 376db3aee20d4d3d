#include "fem/neo_hookean.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "tests/fem/elements.h"

namespace tendril::fem {
namespace {

using testing::dense;
using testing::kModuli;
using testing::random_matrix;
using testing::random_rotation;
using testing::smallest_eigenvalue;
using testing::unit_corners;

TEST_CASE("A rubber that keeps its volume pulls with mu (s - 1/s^2) when stretched by s", "[law]") {
  const double mu = 50e3;
  const Moduli nearly_incompressible{mu, 1e5 * mu};
  Corners p = Corners::Zero();  // edges along the axes, 1 m: a force is a stress times V
  p.rightCols<3>().setIdentity();
  const auto rest = rest_tetrahedron(p);
  for (const double s : {0.5, 0.8, 1.3, 2.0, 4.0}) {
    const auto forces = [&](double t) {
      return NeoHookeanElement(rest, nearly_incompressible, Eigen::Vector3d(s, t, t).asDiagonal() * p)
          .forces();
    };
    // The sides give way until nothing presses on them.
    double low = 0.9 / std::sqrt(s), high = 1.1 / std::sqrt(s);
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      (forces(middle)(1, 2) > 0 ? low : high) = middle;
    }
    const double stress = -forces(low)(0, 1) / rest.volume;
    CHECK(stress == Approx(mu * (s - 1 / (s * s))).epsilon(1e-3));
  }
}

TEST_CASE("The semidefinite tangent has no negative eigenvalue, however the element is squeezed", "[law]") {
  const unsigned seed = GENERATE(1u, 2u, 3u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const auto rest = rest_tetrahedron(unit_corners());
  int indefinite = 0;
  for (int k = 0; k < 50; ++k) {
    const Corners p = random_matrix(random, 1) * unit_corners();  // half of them inside out
    const double pressure = std::uniform_real_distribution(-1e5, 1e5)(random);
    const NeoHookeanElement element(rest, kModuli, p);
    indefinite += smallest_eigenvalue(dense(element.stiffness(Tangent::kExact, pressure))) < -1e-3;
    CHECK(smallest_eigenvalue(dense(element.stiffness(Tangent::kSemidefinite, pressure))) > -1e-12);
  }
  CHECK(indefinite > 25);
}

TEST_CASE("Where the exact tangent is semidefinite, so that nothing is to be mended, both are the same",
          "[law]") {
  std::mt19937 random(4);
  const auto rest = rest_tetrahedron(unit_corners());
  for (int k = 0; k < 20; ++k) {
    // The volume grows, but so little that shear stays stable.
    const Eigen::Matrix3d F =
        random_rotation(random) * Eigen::Vector3d(1.2, 1.05, 0.85).asDiagonal() * random_rotation(random);
    const NeoHookeanElement element(rest, kModuli, F * unit_corners());
    const auto exact = dense(element.stiffness(Tangent::kExact));
    REQUIRE(smallest_eigenvalue(exact) > -1e-12);
    CHECK((dense(element.stiffness(Tangent::kSemidefinite)) - exact).norm() < 1e-12 * exact.norm());
  }
}

TEST_CASE("An element turned inside out says so", "[law]") {
  const auto rest = rest_tetrahedron(unit_corners());
  Corners p = unit_corners();
  CHECK_FALSE(NeoHookeanElement(rest, kModuli, p).inverted());
  p(2, 3) = -p(2, 3);
  const NeoHookeanElement element(rest, kModuli, p);
  CHECK(element.inverted());
  CHECK(element.dilatation() == Approx(-2));
}

}  // namespace
}  // namespace tendril::fem
