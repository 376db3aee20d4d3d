// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "qp/metric.h"

namespace tendril::qp {

/// Where row i starts in a lower triangle without diagonal whose rows are padded to whole SIMD vectors.
constexpr int start_of_row(int i) {
  const int block = i / kSimdRows;
  return kSimdRows * (kSimdRows * block * (block + 1) / 2 + (i % kSimdRows) * (block + 1));
}

/// The constraints held at a bound, their multipliers, and the factor L D Lᵀ = G_WW + Δ_W of their Gram
/// matrix, kept up to date as constraints come and go.  [Gill, Golub, Murray & Saunders 1974, method C1;
/// Arnström et al. 2022]
///
/// Entries are numbered 0..size()-1 in order of arrival. G_WW + Δ_W is positive definite for every W
/// (Metric), hence nothing here can fail. Multipliers are scaled ones; λ ≥ 0 at an upper bound, λ ≤ 0 at a
/// lower one, free at an equality.
/// Real-time, all: bounded by the size k, O(k²) unless said otherwise; nothing allocates.
class WorkingSet {
 public:
  /// The bound at which a constraint is held, which is the sign of its multiplier.
  enum class Side : signed char { kLower = -1, kBoth = 0, kUpper = 1 };

  /// Number of entries, up to kMaxConstraints.
  int size() const { return size_; }
  /// Number of the constraint of entry i, as in Metric.
  int constraint(int i) const { return constraint_[i]; }
  const int* constraints() const { return constraint_.data(); }
  /// Side at which entry i is held.
  Side side(int i) const { return side_[i]; }
  /// Scaled multiplier of entry i.
  double multiplier(int i) const { return multiplier_[i]; }
  const double* multipliers() const { return multiplier_.data(); }

  /// Removes all entries.
  void clear() noexcept;

  /// Appends constraint k with multiplier zero.
  void add(const Metric& metric, int k, Side side) noexcept;

  /// Removes entry i, whatever its multiplier; the entries after it move up by one.
  void drop(int i) noexcept;

  /// Declares at which side entry i is held, for a bound that has become an equality or ceased to be one.
  void set_side(int i, Side side) { side_[i] = side; }

  /// Factors anew, for another Metric or against the rounding of many updates; the entries stay. O(k³).
  void refactor(const Metric& metric) noexcept;

  /// Number of add() and drop() since the last refactor().
  int updates() const { return updates_; }

  /// Moves the multipliers towards the solution of (G_WW + Δ_W) λ = b, as far as their signs allow.
  /// @param b  by how much a constraint passes its bound at λ = 0: b(i) for entry i. It is asked only about
  ///           entries that have come or moved up since the last call, unless invalidate_b() has been called
  /// @return   the entry whose multiplier came to zero first and stopped the move (the lowest of equals);
  ///           -1 where none did and λ solves the system
  template <typename Excess>
  int step_towards(const Excess& b) noexcept {
    for (int i = solved_; i < size_; ++i) forward_substitute(i, b(i));
    solved_ = size_;
    return step();
  }
  /// To be called where b has changed for entries that have not.
  void invalidate_b() { solved_ = 0; }

 private:
  double* row(int i) { return rows_.data() + start_of_row(i); }

  void forward_substitute(int i, double b) noexcept;
  int step() noexcept;

  int size_ = 0, updates_ = 0;
  int solved_ = 0;  // entries whose forward_ is up to date
  std::array<int, kMaxConstraints> constraint_{};
  std::array<Side, kMaxConstraints> side_{};
  alignas(64) Values multiplier_{};
  alignas(64) Values pivot_{}, reciprocal_{};  // D and D⁻¹
  alignas(64) Values forward_{};               // L⁻¹ b
  // L below its unit diagonal, row after row; the padding is zero.
  alignas(64) std::array<double, start_of_row(kMaxConstraints)> rows_{};
};

}  // namespace tendril::qp
