#include "fem/stiffness_matrix.h"

#include <algorithm>
#include <cassert>
#include <set>

namespace tendril::fem {

StiffnessMatrix::StiffnessMatrix(int nodes, const std::vector<std::vector<int>>& cliques) : nodes_(nodes) {
  std::vector<std::set<int>> below(nodes);
  for (int j = 0; j < nodes; ++j) below[j].insert(j);
  for (const auto& clique : cliques)
    for (int i : clique)
      for (int j : clique)
        if (i > j && i < nodes) below[j].insert(i);

  block_starts_.assign(1, 0);
  column_starts_.assign(1, 0);
  for (const auto& column : below) {
    block_rows_.insert(block_rows_.end(), column.begin(), column.end());
    block_starts_.push_back(static_cast<int>(block_rows_.size()));
    for (int c = 0; c < 3; ++c) {
      for (int i : column)
        for (int r = 0; r < 3; ++r) rows_.push_back(3 * i + r);
      column_starts_.push_back(static_cast<int>(rows_.size()));
    }
  }
  values_.assign(rows_.size(), 0.0);
}

StiffnessMatrix::Slot StiffnessMatrix::slot(int i, int j) const {
  const auto begin = block_rows_.begin() + block_starts_[j];
  const auto end = block_rows_.begin() + block_starts_[j + 1];
  const auto found = std::lower_bound(begin, end, i);
  assert(found != end && *found == i);
  const int blocks = block_starts_[j + 1] - block_starts_[j];
  return {9 * block_starts_[j] + 3 * static_cast<int>(found - begin), 3 * blocks};
}

void StiffnessMatrix::set_zero() { std::fill(values_.begin(), values_.end(), 0.0); }

void StiffnessMatrix::scale(double factor) {
  for (double& value : values_) value *= factor;
}

void StiffnessMatrix::add_diagonal(const Eigen::VectorXd& diagonal) {
  for (int j = 0; j < size(); ++j) values_[column_starts_[j] + j % 3] += diagonal[j];
}

Eigen::VectorXd StiffnessMatrix::multiply(const Eigen::VectorXd& x) const {
  Eigen::VectorXd y = Eigen::VectorXd::Zero(size());
  for (int j = 0; j < size(); ++j)
    for (int k = column_starts_[j]; k < column_starts_[j + 1]; ++k) {
      const int i = rows_[k];
      if (i < j) continue;
      y[i] += values_[k] * x[j];
      if (i > j) y[j] += values_[k] * x[i];
    }
  return y;
}

Eigen::MatrixXd StiffnessMatrix::dense() const {
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(size(), size());
  for (int j = 0; j < size(); ++j)
    for (int k = column_starts_[j]; k < column_starts_[j + 1]; ++k)
      if (const int i = rows_[k]; i >= j) A(i, j) = A(j, i) = values_[k];
  return A;
}

}  // namespace tendril::fem
