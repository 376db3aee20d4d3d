// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <random>

#include "fem/element/material.h"
#include "fem/element/tetrahedron.h"

namespace tendril::fem::testing {

inline const Material kSilicone{150e3, 0.45};
inline const Moduli kModuli{kSilicone.lame_mu(), kSilicone.lame_lambda()};

/// A tetrahedron of about a centimetre.
inline Corners unit_corners() {
  Corners p;
  p << 0, 0.01, 0, 0, 0, 0, 0.012, 0.001, 0, 0, 0, 0.009;
  return p;
}

inline Eigen::Matrix3d random_matrix(std::mt19937& random, double amplitude) {
  std::uniform_real_distribution<double> uniform(-amplitude, amplitude);
  return Eigen::Matrix3d::NullaryExpr([&] { return uniform(random); });
}

inline Eigen::Matrix3d random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
      .normalized()
      .toRotationMatrix();
}

/// A turned and strained element: strains up to about 30 %.
inline Corners random_deformation(std::mt19937& random) {
  const Eigen::Matrix3d F =
      random_rotation(random) * (Eigen::Matrix3d::Identity() + random_matrix(random, 0.2));
  return F * unit_corners();
}

inline Eigen::Matrix<double, 12, 12> dense(const Blocks& blocks) {
  Eigen::Matrix<double, 12, 12> K;
  int k = 0;
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b <= a; ++b, ++k) {
      K.block<3, 3>(3 * a, 3 * b) = blocks[k];
      K.block<3, 3>(3 * b, 3 * a) = blocks[k].transpose();
    }
  return K;
}

/// As a share of the largest.
inline double smallest_eigenvalue(const Eigen::MatrixXd& K) {
  const Eigen::VectorXd all = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K).eigenvalues();
  return all.minCoeff() / all.cwiseAbs().maxCoeff();
}

}  // namespace tendril::fem::testing
