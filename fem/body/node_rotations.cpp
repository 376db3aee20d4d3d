// SPDX-License-Identifier: Apache-2.0
#include "fem/body/node_rotations.h"

#include <algorithm>

#include "fem/element/corotational.h"

namespace tendril::fem {

NodeRotations::NodeRotations(int nodes) : rotations_(nodes, Eigen::Matrix3d::Identity()) {}

void NodeRotations::compute(const StiffnessMatrix& pattern, const Eigen::VectorXd& from,
                            const Eigen::VectorXd& to) {
  for (auto& A : rotations_) A.setZero();
  for (int j = 0; j < pattern.nodes(); ++j)
    for (int k = pattern.column_starts()[j] + 1; k < pattern.column_starts()[j + 1]; ++k) {
      const int i = pattern.rows()[k];
      const Eigen::Vector3d was = from.segment<3>(3 * i) - from.segment<3>(3 * j);
      const Eigen::Vector3d is = to.segment<3>(3 * i) - to.segment<3>(3 * j);
      const Eigen::Matrix3d A = is * (was / was.squaredNorm()).transpose();
      rotations_[i] += A;
      rotations_[j] += A;
    }
  // Scaled to be near a rotation, where the iteration converges fast.
  for (auto& A : rotations_) {
    const double norm = A.norm();
    A = norm > 0 ? polar_rotation((std::sqrt(3.0) / norm) * A) : Eigen::Matrix3d::Identity();
  }
}

void NodeRotations::reset() { std::ranges::fill(rotations_, Eigen::Matrix3d::Identity()); }

void NodeRotations::rotate(EightVectors& V) const {
  for (int i = 0; i < static_cast<int>(rotations_.size()); ++i) {
    const Eigen::Matrix<double, 8, 3> v = V.middleCols<3>(3 * i);
    V.middleCols<3>(3 * i) = v * rotations_[i].transpose();
  }
}

void NodeRotations::rotate_back(EightVectors& V) const {
  for (int i = 0; i < static_cast<int>(rotations_.size()); ++i) {
    const Eigen::Matrix<double, 8, 3> v = V.middleCols<3>(3 * i);
    V.middleCols<3>(3 * i) = v * rotations_[i];
  }
}

}  // namespace tendril::fem
