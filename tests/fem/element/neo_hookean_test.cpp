// SPDX-License-Identifier: Apache-2.0
#include "fem/element/neo_hookean.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "tests/fem/element/elements.h"

namespace tendril::fem::neo_hookean_test {

using testing::dense;
using testing::kModuli;
using testing::random_matrix;
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

TEST_CASE("The semidefinite tangent is the exact one without its negative eigenvalues, inside out or not",
          "[law]") {
  const unsigned seed = GENERATE(1u, 2u, 3u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  // With edges along the axes, 1 m long, the blocks of corners 1 to 3 are V times the Hessian by F.
  Corners cube = Corners::Zero();
  cube.rightCols<3>().setIdentity();
  const auto rest = rest_tetrahedron(cube);
  int indefinite = 0;
  for (int k = 0; k < 50; ++k) {
    const Corners p = random_matrix(random, 1) * cube;
    const double pressure = std::uniform_real_distribution(-1e5, 1e5)(random);
    const NeoHookeanElement element(rest, kModuli, p);
    const auto hessian = [&](Tangent tangent) {
      return Eigen::MatrixXd(dense(element.stiffness(tangent, pressure)).bottomRightCorner<9, 9>());
    };
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(hessian(Tangent::kExact));
    const Eigen::MatrixXd expected = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
                                     eigen.eigenvectors().transpose();
    CHECK((hessian(Tangent::kSemidefinite) - expected).norm() < 1e-12 * expected.norm());
    indefinite += eigen.eigenvalues()[0] < -1e-3 * expected.norm();
  }
  CHECK(indefinite > 25);
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

}  // namespace tendril::fem::neo_hookean_test
