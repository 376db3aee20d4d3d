#pragma once

#include <Eigen/Core>
#include <vector>

namespace tendril::fem {

/// A symmetric sparse matrix of 3 × 3 blocks, one row of blocks a node, whose pattern is fixed at
/// construction.
///
/// The lower triangle is stored in compressed columns of scalars, as CHOLMOD reads it. Blocks on the diagonal
/// are stored whole; their upper halves are present and ignored by CHOLMOD.
class StiffnessMatrix {
 public:
  /// Where the block of two nodes lies: its entry (r, c) is values()[first + c * stride + r].
  struct Slot {
    int first;
    int stride;
  };

  /// @param nodes    number of nodes N; the matrix is 3N × 3N
  /// @param cliques  sets of nodes all coupled with one another (elements, cable segments); indices ≥ N are
  ///                 fixed nodes and are left out
  StiffnessMatrix(int nodes, const std::vector<std::vector<int>>& cliques);

  int size() const { return 3 * nodes_; }  ///< 3N
  const std::vector<int>& column_starts() const { return column_starts_; }
  const std::vector<int>& rows() const { return rows_; }
  std::vector<double>& values() { return values_; }
  const std::vector<double>& values() const { return values_; }

  /// Slot of the block (i, j), i ≥ j, both below N. The pair must be in the pattern.
  Slot slot(int i, int j) const;

  void set_zero();
  void add(Slot slot, const Eigen::Matrix3d& block);
  void scale(double factor);
  /// Adds a vector of size 3N to the diagonal.
  void add_diagonal(const Eigen::VectorXd& diagonal);

  /// y = A x for a vector of size 3N.
  Eigen::VectorXd multiply(const Eigen::VectorXd& x) const;

  /// Dense copy, both triangles; for tests and small systems.
  Eigen::MatrixXd dense() const;

 private:
  int nodes_;
  std::vector<int> block_starts_;  // N + 1: first block of each column of blocks
  std::vector<int> block_rows_;    // ascending in each column, the diagonal first
  std::vector<int> column_starts_;
  std::vector<int> rows_;
  std::vector<double> values_;
};

inline void StiffnessMatrix::add(Slot slot, const Eigen::Matrix3d& block) {
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) values_[slot.first + c * slot.stride + r] += block(r, c);
}

}  // namespace tendril::fem
