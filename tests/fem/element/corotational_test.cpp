// SPDX-License-Identifier: Apache-2.0
#include "fem/element/corotational.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "tests/fem/element/elements.h"

namespace tendril::fem::corotational_test {

using testing::dense;
using testing::kModuli;
using testing::random_matrix;
using testing::random_rotation;
using testing::smallest_eigenvalue;
using testing::unit_corners;

TEST_CASE("The polar rotation is the rotation nearest to the deformation gradient", "[law]") {
  const unsigned seed = GENERATE(1u, 2u, 3u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  for (int k = 0; k < 200; ++k) {
    const Eigen::Matrix3d F = random_matrix(random, 1);
    const Eigen::Matrix3d R = polar_rotation(F);
    CHECK((R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < 1e-12);
    CHECK(R.determinant() == Approx(1).epsilon(1e-12));
    const Eigen::Matrix3d S = R.transpose() * F;
    CHECK((S - S.transpose()).norm() < 1e-11);
    for (int other = 0; other < 20; ++other)
      CHECK((F - R).norm() <= (F - random_rotation(random)).norm() + 1e-12);
  }
}

TEST_CASE("The polar rotation of a nearly flat element is still a rotation", "[law]") {
  for (const double flat : {1e-3, 1e-6, 1e-9, 0.0}) {
    const Eigen::Matrix3d R = polar_rotation(Eigen::Vector3d(1, 1.1, flat).asDiagonal());
    CHECK((R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < 1e-12);
  }
}

TEST_CASE("The tangent with frozen rotations stays semidefinite where the exact one does not", "[law]") {
  const auto rest = rest_tetrahedron(unit_corners());
  const CorotationalElement squeezed(rest, kModuli, 0.7 * unit_corners());
  CHECK(smallest_eigenvalue(dense(squeezed.stiffness(Tangent::kSemidefinite))) > -1e-12);
  CHECK(smallest_eigenvalue(dense(squeezed.stiffness(Tangent::kExact))) < -1e-3);
}

TEST_CASE("An element turned inside out says so and its rotation stays proper", "[law]") {
  const auto rest = rest_tetrahedron(unit_corners());
  Corners p = unit_corners();
  p(2, 3) = -p(2, 3);
  const CorotationalElement element(rest, kModuli, p);
  CHECK(element.inverted());
  CHECK(element.rotation().determinant() == Approx(1));
  CHECK(element.forces().allFinite());
}

}  // namespace tendril::fem::corotational_test
