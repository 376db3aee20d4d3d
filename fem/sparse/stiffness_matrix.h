// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

namespace tendril::fem {

/// Eight vectors of size 3N, as 8 × 3N: the eight numbers of an unknown are contiguous, so that a matrix is
/// read once for all of them.
using EightVectors = Eigen::Matrix<double, 8, Eigen::Dynamic>;

/// A symmetric sparse matrix of 3 × 3 blocks, one row of blocks for each node. Its pattern is fixed at
/// construction.
///
/// The lower triangle is stored in compressed columns of blocks. Block (i, j), i ≥ j, is nine contiguous
/// numbers, column by column. Blocks on the diagonal are stored in full.
class StiffnessMatrix {
 public:
  /// @param nodes    number of nodes N; the matrix is 3N × 3N
  /// @param cliques  sets of nodes that are all coupled with one another (elements, cable segments); indices
  ///                 ≥ N are fixed nodes and are left out
  StiffnessMatrix(int nodes, const std::vector<std::vector<int>>& cliques);

  int nodes() const { return nodes_; }                                      ///< N
  int size() const { return 3 * nodes_; }                                   ///< 3N
  const std::vector<int>& column_starts() const { return column_starts_; }  ///< N + 1: first slot of a column
  const std::vector<int>& rows() const { return rows_; }  ///< node of each slot's row; the diagonal first

  /// Slot of the block (i, j), i ≥ j, both below N.
  /// @throws std::out_of_range if the pair is not in the pattern
  int slot(int i, int j) const;
  /// Slot of a block that is no part of the matrix: contributions of fixed nodes go there.
  int discard_slot() const { return static_cast<int>(rows_.size()); }

  /// The nine numbers of a block, column by column.
  double* block(int slot) { return &values_[9 * static_cast<size_t>(slot)]; }
  const double* block(int slot) const { return &values_[9 * static_cast<size_t>(slot)]; }

  void set_zero();
  void add(int slot, const Eigen::Matrix3d& block) {
    Eigen::Map<Eigen::Matrix3d>(this->block(slot)) += block;
  }
  void scale(double factor);
  /// Adds a vector of size 3N to the diagonal.
  void add_diagonal(const Eigen::VectorXd& diagonal);

  /// y = A x for a vector of size 3N.
  Eigen::VectorXd multiply(const Eigen::VectorXd& x) const;
  /// Y = A X. Allocates nothing once Y has its size.
  void multiply(const EightVectors& X, EightVectors& Y) const;

  /// Dense copy, both triangles; for tests and small systems.
  Eigen::MatrixXd dense() const;

 private:
  int nodes_;
  std::vector<int> column_starts_;
  std::vector<int> rows_;
  std::vector<double> values_;
};

}  // namespace tendril::fem
