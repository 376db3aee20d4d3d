// SPDX-License-Identifier: Apache-2.0
// What holds for each law of the table.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>

#include "fem/element/law.h"
#include "tests/fem/element/elements.h"

namespace tendril::fem::element_laws_test {

using testing::dense;
using testing::kModuli;
using testing::kSilicone;
using testing::random_deformation;
using testing::random_rotation;
using testing::unit_corners;

// A patch's pressure, Pa, and the energy it stands for at constant pressure: p V θ.
constexpr double kPressure = 7e3;

template <class E>
double energy(const RestTetrahedron& rest, const Corners& p) {
  const E element(rest, kModuli, p);
  return element.energy() + kPressure * rest.volume * element.dilatation();
}

TEMPLATE_LIST_TEST_CASE("Element forces are minus the gradient of the energy", "[law]", Element) {
  const unsigned seed = GENERATE(1u, 2u, 3u, 4u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const auto rest = rest_tetrahedron(unit_corners());
  const Corners p = random_deformation(random);
  const TestType element(rest, kModuli, p);
  const double h = 1e-8;
  Corners numeric, growth;
  for (int a = 0; a < 4; ++a)
    for (int c = 0; c < 3; ++c) {
      Corners plus = p, minus = p;
      plus(c, a) += h, minus(c, a) -= h;
      numeric(c, a) = -(energy<TestType>(rest, plus) - energy<TestType>(rest, minus)) / (2 * h);
      growth(c, a) =
          (TestType(rest, kModuli, plus).dilatation() - TestType(rest, kModuli, minus).dilatation()) /
          (2 * h);
    }
  CHECK((element.forces(kPressure) - numeric).norm() < 1e-6 * numeric.norm());
  CHECK((element.dilatation_gradient() - growth).norm() < 1e-6 * growth.norm());
}

TEMPLATE_LIST_TEST_CASE("The exact tangent is minus the derivative of the forces", "[law]", Element) {
  const unsigned seed = GENERATE(1u, 2u, 3u, 4u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const auto rest = rest_tetrahedron(unit_corners());
  const Corners p = random_deformation(random);
  const auto K = dense(TestType(rest, kModuli, p).stiffness(Tangent::kExact, kPressure));
  CHECK((K - K.transpose()).norm() < 1e-12 * K.norm());
  const double h = 1e-7;
  Eigen::Matrix<double, 12, 12> numeric;
  for (int j = 0; j < 12; ++j) {
    Corners plus = p, minus = p;
    plus(j % 3, j / 3) += h, minus(j % 3, j / 3) -= h;
    const Corners df =
        TestType(rest, kModuli, plus).forces(kPressure) - TestType(rest, kModuli, minus).forces(kPressure);
    numeric.col(j) = -df.reshaped() / (2 * h);
  }
  CHECK((K - numeric).norm() < 1e-7 * K.norm());
}

TEMPLATE_LIST_TEST_CASE("At rest both tangents are the stiffness of small-strain elasticity", "[law]",
                        Element) {
  std::mt19937 random(1);
  const Eigen::Matrix3d R = random_rotation(random);
  const auto rest = rest_tetrahedron(unit_corners());
  const TestType element(rest, kModuli, R * unit_corners());
  const auto exact = dense(element.stiffness(Tangent::kExact));
  const auto semidefinite = dense(element.stiffness(Tangent::kSemidefinite));
  CHECK((exact - semidefinite).norm() < 1e-12 * exact.norm());

  // V Bᵀ C B for the turned frame, B from the strain of each unit displacement.
  const auto [mu, lambda] = kModuli;
  Eigen::Matrix<double, 12, 12> expected;
  const Corners h = R * rest.g;
  const auto strain = [&](int dof) {
    const Eigen::Matrix3d gradient = Eigen::Vector3d::Unit(dof % 3) * h.col(dof / 3).transpose();
    return Eigen::Matrix3d(0.5 * (gradient + gradient.transpose()));
  };
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j)
      expected(i, j) = rest.volume * (2 * mu * strain(i).cwiseProduct(strain(j)).sum() +
                                      lambda * strain(i).trace() * strain(j).trace());
  CHECK((exact - expected).norm() < 1e-12 * exact.norm());
}

TEMPLATE_LIST_TEST_CASE("A bar under a little tension obeys Young's modulus and Poisson's ratio", "[law]",
                        Element) {
  const double strain = 1e-6, nu = kSilicone.poisson_ratio;
  const auto rest = rest_tetrahedron(unit_corners());
  const Corners p =
      Eigen::Vector3d(1 + strain, 1 - nu * strain, 1 - nu * strain).asDiagonal() * unit_corners();
  Eigen::Matrix3d stress = Eigen::Matrix3d::Zero();
  stress(0, 0) = kSilicone.young_modulus * strain;
  const Corners expected = -rest.volume * stress * rest.g;
  CHECK((TestType(rest, kModuli, p).forces() - expected).norm() < 1e-5 * expected.norm());
}

TEMPLATE_LIST_TEST_CASE("A rigid motion gives no force and no energy", "[law]", Element) {
  const unsigned seed = GENERATE(1u, 2u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const auto rest = rest_tetrahedron(unit_corners());
  const Corners moved =
      (random_rotation(random) * unit_corners()).colwise() + Eigen::Vector3d(0.3, -0.1, 0.2);
  const TestType element(rest, kModuli, moved);
  const double unit_strain = kSilicone.young_modulus * rest.volume;  // J, of a strain of one
  CHECK(element.forces().norm() < 1e-12 * unit_strain / 0.01);
  CHECK(std::abs(element.energy()) < 1e-12 * unit_strain);
}

TEMPLATE_LIST_TEST_CASE("Shapes at rest do not depend on the order of the corners", "[law]", Element) {
  std::mt19937 random(5);
  const Corners at_rest = unit_corners(), p = random_deformation(random);
  const std::array order{2, 0, 1, 3}, odd{1, 0, 2, 3};
  const auto rest = rest_tetrahedron(at_rest);
  const Corners forces = TestType(rest, kModuli, p).forces();
  for (const auto& corners : {order, odd}) {
    const auto other = rest_tetrahedron(at_rest(Eigen::all, corners));
    CHECK(other.volume == Approx(rest.volume));
    const Corners turned = TestType(other, kModuli, p(Eigen::all, corners)).forces();
    CHECK((turned - forces(Eigen::all, corners)).norm() < 1e-12 * forces.norm());
  }
}

}  // namespace tendril::fem::element_laws_test
