#include "fem/corotational.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <random>

#include "fem/material.h"

namespace tendril::fem {
namespace {

const Material kSilicone{150e3, 0.45};
const Moduli kModuli{kSilicone.lame_mu(), kSilicone.lame_lambda()};

Corners unit_corners() {
  Corners p;
  p << 0, 0.01, 0, 0, 0, 0, 0.012, 0.001, 0, 0, 0, 0.009;
  return p;
}

Eigen::Matrix3d random_matrix(std::mt19937& random, double amplitude) {
  std::uniform_real_distribution<double> uniform(-amplitude, amplitude);
  return Eigen::Matrix3d::NullaryExpr([&] { return uniform(random); });
}

Eigen::Matrix3d random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
      .normalized()
      .toRotationMatrix();
}

/// A turned and strained element: strains up to about 30 %.
Corners random_deformation(std::mt19937& random) {
  const Eigen::Matrix3d F =
      random_rotation(random) * (Eigen::Matrix3d::Identity() + random_matrix(random, 0.2));
  return F * unit_corners();
}

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

TEST_CASE("Element forces are minus the gradient of the energy", "[law]") {
  const unsigned seed = GENERATE(1u, 2u, 3u, 4u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const auto rest = rest_tetrahedron(unit_corners());
  const Corners p = random_deformation(random);
  const auto forces = CorotationalElement(rest, kModuli, p).forces();
  const double h = 1e-8;
  Corners numeric;
  for (int a = 0; a < 4; ++a)
    for (int c = 0; c < 3; ++c) {
      Corners plus = p, minus = p;
      plus(c, a) += h, minus(c, a) -= h;
      numeric(c, a) = -(CorotationalElement(rest, kModuli, plus).energy() -
                        CorotationalElement(rest, kModuli, minus).energy()) /
                      (2 * h);
    }
  CHECK((forces - numeric).norm() < 1e-6 * forces.norm());
}

Eigen::Matrix<double, 12, 12> dense(const std::array<Eigen::Matrix3d, 10>& blocks) {
  Eigen::Matrix<double, 12, 12> K;
  int k = 0;
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b <= a; ++b, ++k) {
      K.block<3, 3>(3 * a, 3 * b) = blocks[k];
      K.block<3, 3>(3 * b, 3 * a) = blocks[k].transpose();
    }
  return K;
}

TEST_CASE("The exact tangent is minus the derivative of the forces", "[law]") {
  const unsigned seed = GENERATE(1u, 2u, 3u, 4u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const auto rest = rest_tetrahedron(unit_corners());
  const Corners p = random_deformation(random);
  const auto K = dense(CorotationalElement(rest, kModuli, p).stiffness(Tangent::kExact));
  CHECK((K - K.transpose()).norm() < 1e-12 * K.norm());
  const double h = 1e-7;
  Eigen::Matrix<double, 12, 12> numeric;
  for (int j = 0; j < 12; ++j) {
    Corners plus = p, minus = p;
    plus(j % 3, j / 3) += h, minus(j % 3, j / 3) -= h;
    const Corners df = CorotationalElement(rest, kModuli, plus).forces() -
                       CorotationalElement(rest, kModuli, minus).forces();
    numeric.col(j) = -df.reshaped() / (2 * h);
  }
  CHECK((K - numeric).norm() < 1e-7 * K.norm());
}

TEST_CASE("At rest both tangents are the stiffness of small-strain elasticity", "[law]") {
  std::mt19937 random(1);
  const Eigen::Matrix3d R = random_rotation(random);
  const auto rest = rest_tetrahedron(unit_corners());
  const CorotationalElement element(rest, kModuli, R * unit_corners());
  const auto exact = dense(element.stiffness(Tangent::kExact));
  const auto frozen = dense(element.stiffness(Tangent::kSemidefinite));
  CHECK((exact - frozen).norm() < 1e-12 * exact.norm());

  // V Bᵀ C B for the turned frame, B from the strain of each unit displacement.
  const double mu = kSilicone.lame_mu(), lambda = kSilicone.lame_lambda();
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

TEST_CASE("A bar under simple tension obeys Young's modulus and Poisson's ratio", "[law]") {
  const double strain = 1e-3, nu = kSilicone.poisson_ratio;
  const auto rest = rest_tetrahedron(unit_corners());
  const Corners p =
      Eigen::Vector3d(1 + strain, 1 - nu * strain, 1 - nu * strain).asDiagonal() * unit_corners();
  Eigen::Matrix3d stress = Eigen::Matrix3d::Zero();
  stress(0, 0) = kSilicone.young_modulus * strain;
  const Corners expected = -rest.volume * stress * rest.g;
  CHECK((CorotationalElement(rest, kModuli, p).forces() - expected).norm() < 1e-9 * expected.norm());
}

TEST_CASE("The polar rotation of a nearly flat element is still a rotation", "[law]") {
  for (const double flat : {1e-3, 1e-6, 1e-9, 0.0}) {
    const Eigen::Matrix3d R = polar_rotation(Eigen::Vector3d(1, 1.1, flat).asDiagonal());
    CHECK((R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < 1e-12);
  }
}

TEST_CASE("A rigid motion gives no force and no energy", "[law]") {
  const unsigned seed = GENERATE(1u, 2u);
  CAPTURE(seed);
  std::mt19937 random(seed);
  const auto rest = rest_tetrahedron(unit_corners());
  const Corners moved =
      (random_rotation(random) * unit_corners()).colwise() + Eigen::Vector3d(0.3, -0.1, 0.2);
  const CorotationalElement element(rest, kModuli, moved);
  const double scale = kSilicone.young_modulus * std::pow(rest.volume, 2.0 / 3);  // N, of a strain of one
  CHECK(element.forces().norm() < 1e-12 * scale);
  CHECK(std::abs(element.energy()) < 1e-20 * kSilicone.young_modulus);
}

TEST_CASE("The tangent with frozen rotations stays semidefinite where the exact one does not", "[law]") {
  const auto rest = rest_tetrahedron(unit_corners());
  const CorotationalElement squeezed(rest, kModuli, 0.7 * unit_corners());
  const auto smallest = [](const Eigen::Matrix<double, 12, 12>& K) {
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 12, 12>>(K).eigenvalues()[0] / K.norm();
  };
  CHECK(smallest(dense(squeezed.stiffness(Tangent::kSemidefinite))) > -1e-12);
  CHECK(smallest(dense(squeezed.stiffness(Tangent::kExact))) < -1e-3);
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

}  // namespace
}  // namespace tendril::fem
