#pragma once

#include <Eigen/Core>
#include <memory>

#include "fem/stiffness_matrix.h"

namespace tendril::fem {

/// Cholesky factorisation P K Pᵀ = L Lᵀ of a stiffness matrix by CHOLMOD: the pattern is analysed once, the
/// numbers are factored as often as they change.
class CholmodFactor {
 public:
  /// Orders and analyses the pattern of K.
  /// @throws std::runtime_error if CHOLMOD runs out of memory
  /// Real-time: no (allocates).
  explicit CholmodFactor(const StiffnessMatrix& K);
  ~CholmodFactor();
  CholmodFactor(const CholmodFactor&) = delete;
  CholmodFactor& operator=(const CholmodFactor&) = delete;

  /// Factors the present numbers of K, whose pattern must be the one given at construction.
  /// @return  false if K is not positive definite or not finite (the factor is then unusable)
  /// @throws  std::bad_alloc
  /// Real-time: no (time depends on the mesh).
  [[nodiscard]] bool factorize(const StiffnessMatrix& K);

  /// Solves K X = B.
  /// @param B, X  3N × c, column-major; no aliasing
  /// Real-time: no (time depends on the mesh; allocates at the first call or when c grows).
  void solve(const Eigen::MatrixXd& B, Eigen::MatrixXd& X);

 private:
  struct Cholmod;
  std::unique_ptr<Cholmod> cholmod_;
};

}  // namespace tendril::fem
