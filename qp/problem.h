#pragma once

#include <cstdint>

#include "qp/metric.h"

namespace tendril::qp {

/// What Problem::prepare says of a pair (H, A).
enum class Preparation {
  kReady,
  kBadSize,       // not square, not alike, empty, or larger than kMaxVariables
  kNotFinite,     // NaN or infinity, or entries so far apart that scaling overflows
  kNotSymmetric,  // H or A differs from its transpose by more than 1e-8 of √(diagonal · diagonal)
  kIndefinite,    // H or A has a negative eigenvalue that rounding does not explain
};

/// One sentence for a log; static storage.
/// Real-time: wait-free.
const char* name(Preparation preparation) noexcept;

/// Which of several solutions is meant, where H is singular.
enum class Ties {
  kAny,          ///< whichever
  kLeastEnergy,  ///< that of the least ½ xᵀA x; exactly, not at the price of a larger objective
};

/// The part of the quadratic program that depends on the snapshot alone, ready for any g and bounds:
///
///     min ½ xᵀH x + gᵀx   s.t.   lower ≤ x ≤ upper,   row_lower ≤ A x ≤ row_upper.
///
/// [Largilliere 2015, eqs. 5-6, with H = W_eaᵀW_ea + ε (‖W_eaᵀW_ea‖∞/‖W_aa‖∞) W_aa and A = W_aa]
/// A value of about 100 KiB, of which a solve touches some 100 n² bytes; fill it in place.
class Problem {
 public:
  /// Takes over a snapshot's H and A, in place of the previous one.
  /// @param H  n × n, symmetric positive semidefinite, objective unit / x unit²; n = 1..kMaxVariables
  /// @param A  n × n, symmetric positive semidefinite (W_aa), row unit / x unit
  /// @param ties  kLeastEnergy makes a problem of two levels: least objective first, then least energy
  /// @return   kReady, or why not; if not, solve() answers kIllPosed until the next success
  /// Real-time: bounded (about 9 n³ multiplications), no allocation, no lock. Meant for the model thread.
  Preparation prepare(const Matrix& H, const Matrix& A, Ties ties = Ties::kAny) noexcept;

  /// Number of variables; 0 where nothing is prepared.
  int n() const { return n_; }
  /// Different for each successful prepare() of this process, shared by copies; 0 where nothing is prepared.
  std::uint64_t id() const { return n_ == 0 ? 0 : id_; }
  /// True where H is singular or nearly so: then optimum() is made from H + μ D⁻², D ≈ diag(H)^-½, μ = 1e-6.
  bool proximal() const { return proximal_; }
  /// Whether the least energy is asked for, too.
  bool two_levels() const { return energy_weight_ > 0; }
  /// η of a problem of two levels, whose optimum() is made from H + η A; else 0.
  double energy_weight() const { return energy_weight_; }
  /// The constraints in the metric of H, where the optimum is sought.
  const Metric& optimum() const { return optimum_; }
  /// The constraints in the metric of D⁻², well conditioned, where rows that conflict find their least
  /// violation.
  const Metric& least() const { return least_; }

 private:
  int n_ = 0;
  bool proximal_ = false;
  double energy_weight_ = 0;
  std::uint64_t id_ = 0;
  Metric optimum_, least_;
};

}  // namespace tendril::qp
