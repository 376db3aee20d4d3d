// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

#include "fem/sparse/front_kernels.h"
#include "fem/sparse/stiffness_matrix.h"

namespace tendril::fem {

/// Frees memory on 64-byte boundaries: panels are whole cache lines.
struct AlignedDelete {
  void operator()(void* p) const noexcept;
};
template <typename Number>
using AlignedArray = std::unique_ptr<Number[], AlignedDelete>;

/// Precision in which a factor is stored. Single precision halves the memory and the time to read it.
enum class StoragePrecision { kDouble, kSingle };

/// Cholesky factorisation K = L Lᵀ of a stiffness matrix together with a border B of c rows.
///
/// Eliminating K from [K Bᵀ; B 0] leaves the Schur complement −B K⁻¹ Bᵀ. So the factorisation also gives the
/// compliance at the border, and Y = L⁻¹Bᵀ, from which one substitution gives K⁻¹Bᵀc.
///
/// The method is multifrontal, with 3 × 3 blocks. The constructor computes the order, the tree and the layout
/// once; factorize() then runs as often as the numbers change. All is computed in double precision, whatever
/// is stored.
class Factor {
 public:
  /// @param border  for each row of B the nodes at which it may be nonzero
  /// @throws  std::runtime_error or std::bad_alloc if memory runs out
  /// Real-time: no (allocates).
  explicit Factor(const StiffnessMatrix& K, const std::vector<std::vector<int>>& border = {},
                  StoragePrecision storage = StoragePrecision::kDouble,
                  const FrontKernels& kernels = front_kernels());

  /// Factors K, whose pattern must be the one given at construction.
  /// @param K    N/m
  /// @param B_T  Bᵀ, 3N × c; it may hold numbers that are not finite: border_compliance() and solve() then do
  ///             too
  /// @return     false if K is not positive definite or not finite; the factor is then of no use
  /// Real-time: no (time depends on the mesh; allocates nothing).
  [[nodiscard]] bool factorize(const StiffnessMatrix& K, const Eigen::MatrixXd& B_T);

  /// B K⁻¹ Bᵀ, c × c, symmetric to the last bit.
  const Eigen::MatrixXd& border_compliance() const { return border_compliance_; }

  /// x = K⁻¹ Bᵀ c. Requires StoragePrecision::kDouble.
  /// @param c  one number for each row of B
  /// @param x  overwritten; must have the size 3N
  /// Real-time: no (time depends on the mesh; allocates nothing).
  void solve(const Eigen::VectorXd& c, Eigen::VectorXd& x);

  /// V ← (L Lᵀ)⁻¹ V in single precision. Requires StoragePrecision::kSingle.
  /// @param V  8 × 3N
  /// Real-time: no (time depends on the mesh; allocates nothing).
  void precondition(EightVectors& V);

  /// X = K⁻¹ Bᵀ for eight columns of Bᵀ, in single precision. Requires StoragePrecision::kSingle.
  /// @param first  column of Bᵀ; where fewer than eight remain, the other vectors are zero
  /// @param X      overwritten, 8 × 3N
  /// Real-time: no (time depends on the mesh; allocates nothing).
  void border_solutions(int first, EightVectors& X);

  /// Numbers of L, with the zeros that merged supernodes add, without the border.
  size_t nonzeros() const;
  /// Σ (length of column)² of L, without the border: the multiply-adds of a factorisation.
  double operations() const;
  int fronts() const { return static_cast<int>(fronts_.size()); }

 private:
  /// A block of K and where it goes.
  struct Entry {
    int slot;           // in K
    bool transposed;    // K holds the other triangle's
    std::ptrdiff_t at;  // in F of the front
  };
  /// Where a front has its parts.
  struct FrontLayout {
    int k, n, ld, ldu;  // as in Front
    int parent;
    std::vector<int> children;
    size_t L, U;                    // offsets in L_ or L1_, and in U_
    std::vector<int> pivots, rows;  // nodes
    std::vector<int> border;        // rows of B
    std::vector<Entry> entries;     // blocks of K
    std::vector<RowMap> rows_in_parent;
  };

  void lay_out(int unknowns);
  void map_entries(const StiffnessMatrix& K);
  void map_rows();
  void lay_out_updates();
  Front front(const FrontLayout& layout) const;
  void assemble(const FrontLayout& layout, const StiffnessMatrix& K, const Eigen::MatrixXd& B_T,
                const Front& front) const;
  void add_to_border_compliance(const FrontLayout& root);
  void store_single(const FrontLayout& layout, const double* L);
  void forward_substitute_eight();
  void backward_substitute_eight(int first);

  const StoragePrecision storage_;
  const FrontKernels& kernels_;
  std::vector<FrontLayout> fronts_;
  AlignedArray<double> L_, U_, F_, z_;    // with kSingle, L_ is that of the present front
  AlignedArray<float> L1_, x1_, front1_;  // with kSingle; x1_ and front1_ in rows of eight
  Eigen::MatrixXd border_compliance_;
};

}  // namespace tendril::fem
