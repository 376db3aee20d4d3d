// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>

#include "fem/sparse/stiffness_matrix.h"

namespace tendril::fem {

/// Cholesky factorisation of a stiffness matrix by CHOLMOD: the reference that Factor is held against.
class CholmodFactor {
 public:
  enum class Method {
    kSimplicial,  ///< LDLᵀ, column by column; the order is by approximate minimum degree
    kSupernodal   ///< LLᵀ, with calls of the BLAS; the same order
  };

  /// Orders and analyses the pattern of K.
  /// @throws std::runtime_error if CHOLMOD runs out of memory
  /// Real-time: no (allocates).
  explicit CholmodFactor(const StiffnessMatrix& K, Method method = Method::kSimplicial);
  ~CholmodFactor();
  CholmodFactor(const CholmodFactor&) = delete;
  CholmodFactor& operator=(const CholmodFactor&) = delete;

  /// Factors the present numbers of K, whose pattern must be the one given at construction.
  /// @return  false if K is not positive definite or not finite (the factor is then unusable)
  /// @throws  std::bad_alloc
  /// Real-time: no (time depends on the mesh).
  [[nodiscard]] bool factorize(const StiffnessMatrix& K);

  /// Factors the same numbers again: CHOLMOD's own part of factorize(), to be timed.
  [[nodiscard]] bool factorize_again();

  /// Solves K X = B.
  /// @param B, X  3N × c, column-major; no aliasing
  /// Real-time: no (time depends on the mesh; allocates at the first call or when c grows).
  void solve(const Eigen::MatrixXd& B, Eigen::MatrixXd& X);

  double operations() const;  ///< of one factorisation, Σ (length of column)²

 private:
  struct Cholmod;
  std::unique_ptr<Cholmod> cholmod_;
};

}  // namespace tendril::fem
