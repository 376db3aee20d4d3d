#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

#include "fem/sparse/front_kernels.h"
#include "fem/sparse/stiffness_matrix.h"

namespace tendril::fem {

/// Memory on 64-byte boundaries, so that panels are whole cache lines.
struct AlignedDelete {
  void operator()(void* p) const noexcept;
};
template <typename Number>
using AlignedArray = std::unique_ptr<Number[], AlignedDelete>;

/// What a factor keeps of L after a factorisation: all of it, or its numbers in single precision, which
/// take half the memory and half the time to read.
enum class StoragePrecision { kDouble, kSingle };

/// Cholesky factorisation K = L Lᵀ of a stiffness matrix that carries a border B of few rows along:
/// eliminating K from [K Bᵀ; B 0] leaves −B K⁻¹ Bᵀ, so the compliance seen at the border falls out of the
/// factorisation, and Y = L⁻¹Bᵀ stands in the same columns as L, ready for K⁻¹Bᵀc by one substitution.
///
/// Multifrontal, with fronts of 3 × 3 blocks: order, tree and all places are worked out once, at
/// construction; the numbers are factored in place as often as they change. All is computed in double
/// precision, whatever is kept.
class Factor {
 public:
  /// @param border  for each row of B the nodes at which it may be nonzero
  /// @throws  std::runtime_error or std::bad_alloc if memory runs out
  /// Real-time: no (allocates).
  explicit Factor(const StiffnessMatrix& K, const std::vector<std::vector<int>>& border = {},
                  StoragePrecision storage = StoragePrecision::kDouble,
                  const FrontKernels& kernels = front_kernels());

  /// Factors the present numbers of K, whose pattern must be the one given at construction.
  /// @param B_T  3N × c, column-major: Bᵀ; what is not finite in it shows in border_compliance() and solve()
  /// @return     false if K is not positive definite or not finite (the factor is then unusable)
  /// Real-time: no (time depends on the mesh; allocates nothing).
  [[nodiscard]] bool factorize(const StiffnessMatrix& K, const Eigen::MatrixXd& B_T);

  /// B K⁻¹ Bᵀ, c × c, symmetric to the last bit.
  const Eigen::MatrixXd& border_compliance() const { return border_compliance_; }

  /// x = K⁻¹ Bᵀ c. Asks for StoragePrecision::kDouble.
  /// @param c  as many numbers as B has rows
  /// @param x  result, of size 3N
  /// Real-time: no (time depends on the mesh; allocates nothing).
  void solve(const Eigen::VectorXd& c, Eigen::VectorXd& x);

  /// V ← (L Lᵀ)⁻¹ V, to single precision: K⁻¹V of the matrix factored last, and a preconditioner for those
  /// like it. Asks for StoragePrecision::kSingle.
  /// Real-time: no (time depends on the mesh; allocates nothing).
  void precondition(EightVectors& V);

  /// X = K⁻¹ Bᵀ of eight columns of Bᵀ, to single precision. Asks for StoragePrecision::kSingle.
  /// @param first  column of Bᵀ; where there are fewer than eight from it on, the other vectors are zero
  /// @param X      result, of size 3N
  /// Real-time: no (time depends on the mesh; allocates nothing).
  void border_solutions(int first, EightVectors& X);

  size_t nonzeros() const;  ///< numbers in the columns of L, merged zeros included, the border's not
  double operations()
      const;  ///< of one factorisation, Σ (length of column)², those of the border not included
  int fronts() const { return static_cast<int>(fronts_.size()); }

 private:
  /// A block of K and its place in a front's columns.
  struct Entry {
    int slot;
    bool transposed;
    std::ptrdiff_t at;
  };
  struct FrontLayout {
    int k, n, ld, ldu;  // as in Front
    int parent;
    std::vector<int> children;
    size_t L, U;                    // where they start, in numbers
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
  AlignedArray<double> L_, U_, F_, z_;    // L_: of one front after the other where single precision is kept
  AlignedArray<float> L1_, x1_, front1_;  // in single precision: x1_ and front1_ in rows of eight
  Eigen::MatrixXd border_compliance_;
};

}  // namespace tendril::fem
