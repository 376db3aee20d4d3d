// SPDX-License-Identifier: Apache-2.0
#include "fem/sparse/stiffness_matrix.h"

#include <algorithm>
#include <stdexcept>

namespace tendril::fem {

StiffnessMatrix::StiffnessMatrix(int nodes, const std::vector<std::vector<int>>& cliques) : nodes_(nodes) {
  std::vector<std::vector<int>> below(nodes);
  for (int j = 0; j < nodes; ++j) below[j].push_back(j);
  for (const auto& clique : cliques)
    for (int i : clique)
      for (int j : clique)
        if (i > j && i < nodes) below[j].push_back(i);

  column_starts_.assign(1, 0);
  for (auto& column : below) {
    std::sort(column.begin(), column.end());
    column.erase(std::unique(column.begin(), column.end()), column.end());
    rows_.insert(rows_.end(), column.begin(), column.end());
    column_starts_.push_back(static_cast<int>(rows_.size()));
  }
  values_.assign(9 * (rows_.size() + 1), 0.0);
}

int StiffnessMatrix::slot(int i, int j) const {
  const auto begin = rows_.begin() + column_starts_.at(j);
  const auto end = rows_.begin() + column_starts_.at(j + 1);
  const auto found = std::lower_bound(begin, end, i);
  if (found == end || *found != i) throw std::out_of_range("the stiffness matrix couples no such nodes");
  return static_cast<int>(found - rows_.begin());
}

void StiffnessMatrix::set_zero() { std::fill(values_.begin(), values_.end(), 0.0); }

void StiffnessMatrix::scale(double factor) {
  for (double& value : values_) value *= factor;
}

void StiffnessMatrix::add_diagonal(const Eigen::VectorXd& diagonal) {
  for (int j = 0; j < nodes_; ++j)
    for (int r = 0; r < 3; ++r) block(column_starts_[j])[4 * r] += diagonal[3 * j + r];
}

Eigen::VectorXd StiffnessMatrix::multiply(const Eigen::VectorXd& x) const {
  Eigen::VectorXd y = Eigen::VectorXd::Zero(size());
  for (int j = 0; j < nodes_; ++j) {
    const Eigen::Vector3d x_j = x.segment<3>(3 * j);
    Eigen::Vector3d y_j = Eigen::Map<const Eigen::Matrix3d>(block(column_starts_[j])) * x_j;
    for (int k = column_starts_[j] + 1; k < column_starts_[j + 1]; ++k) {
      const Eigen::Map<const Eigen::Matrix3d> A_ij(block(k));
      y.segment<3>(3 * rows_[k]) += A_ij * x_j;
      y_j += A_ij.transpose() * x.segment<3>(3 * rows_[k]);
    }
    y.segment<3>(3 * j) += y_j;
  }
  return y;
}

void StiffnessMatrix::multiply(const EightVectors& X, EightVectors& Y) const {
  using EightOfNode = Eigen::Matrix<double, 8, 3>;
  Y.setZero(8, size());
  for (int j = 0; j < nodes_; ++j) {
    const EightOfNode X_j = X.middleCols<3>(3 * j);
    EightOfNode Y_j = X_j * Eigen::Map<const Eigen::Matrix3d>(block(column_starts_[j])).transpose();
    for (int k = column_starts_[j] + 1; k < column_starts_[j + 1]; ++k) {
      const Eigen::Map<const Eigen::Matrix3d> A_ij(block(k));
      Y.middleCols<3>(3 * rows_[k]) += X_j * A_ij.transpose();
      Y_j += X.middleCols<3>(3 * rows_[k]) * A_ij;
    }
    Y.middleCols<3>(3 * j) += Y_j;
  }
}

Eigen::MatrixXd StiffnessMatrix::dense() const {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(size(), size());
  for (int j = 0; j < nodes_; ++j)
    for (int k = column_starts_[j]; k < column_starts_[j + 1]; ++k) {
      const Eigen::Map<const Eigen::Matrix3d> A_ij(block(k));
      A.block<3, 3>(3 * rows_[k], 3 * j) = A_ij;
      A.block<3, 3>(3 * j, 3 * rows_[k]) = A_ij.transpose();
    }
  return A;
}

}  // namespace tendril::fem
