// SPDX-License-Identifier: Apache-2.0
#include "tests/qp/adversarial_problem.h"

#include <algorithm>
#include <cmath>

namespace tendril::qp {
namespace {

/// Draws what goes wrong with a problem, and does it.
class Corruption {
 public:
  Corruption(uint64_t seed, AdversarialProblem& target) : random_(seed), target_(target), qp_(target.qp) {
    n_ = chance(0.04) ? integer(9, kMaxVariables) : integer(1, 8);
    target_.feasible = chance(0.7);
    qp_ = random_qp(random_, n_, target_.feasible ? Rows::kFeasible : Rows::kArbitrary);
  }

  void apply() {
    if (n_ > 1 && chance(0.15)) duplicate_nearly();
    if (chance(0.1)) qp_.bounds.lower = qp_.bounds.upper = inside();
    if (chance(0.05)) qp_.bounds.row_lower = qp_.bounds.row_upper = qp_.A * inside();
    if (target_.feasible) make_feasible(inside());
    if (chance(0.2)) rescale(integer(0, n_ - 1), std::ldexp(1.0, integer(-20, 20)));
    if (chance(0.2)) move_target_far();
    if (chance(0.1)) make_row_infeasible();
    if (chance(0.03)) insert_nan();
  }

 private:
  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
  int integer(int from, int to) { return std::uniform_int_distribution<int>(from, to)(random_); }
  bool chance(double probability) { return uniform(0, 1) < probability; }

  /// A point that meets the bounds.
  Vector inside() const { return Vector::Zero(n_).cwiseMax(qp_.bounds.lower).cwiseMin(qp_.bounds.upper); }

  /// Moves the rows' bounds as little as lets x meet them.
  void make_feasible(const Vector& x) {
    const RowVector violation = qp_.violation(x);
    qp_.bounds.row_lower += violation;
    qp_.bounds.row_upper += violation;
  }

  /// Has the last actuator pull almost where the first does.
  void duplicate_nearly() {
    Matrix T = Matrix::Identity(n_, n_);
    T(0, n_ - 1) = 1;
    T(n_ - 1, n_ - 1) = std::pow(10, uniform(-12, -2));
    const auto transform = [&](auto& S) {
      const Matrix transformed = T.transpose() * S * T;
      S = (transformed + transformed.transpose()) / 2;
    };
    transform(qp_.H);
    transform(qp_.A);
    qp_.g = T.transpose() * qp_.g;
    // Such an H is as good as singular: without bounds the minimum would be anywhere.
    const Vector room = (qp_.bounds.lower.array().isFinite()).select(qp_.bounds.lower, qp_.bounds.upper);
    for (int j = 0; j < n_; ++j) {
      const double centre = std::isfinite(room[j]) ? room[j] : 0, distance = 4 / std::sqrt(qp_.A(j, j));
      if (std::isinf(qp_.bounds.lower[j])) qp_.bounds.lower[j] = centre - distance;
      if (std::isinf(qp_.bounds.upper[j])) qp_.bounds.upper[j] = centre + distance;
    }
  }

  /// Measures variable j in a unit of its own, as Pa next to N.
  void rescale(int j, double size) {
    const auto scale = [&](auto& S) {
      S.row(j) *= size;
      S.col(j) *= size;
    };
    scale(qp_.H);
    scale(qp_.A);
    qp_.g[j] *= size;
    for (Vector* side : {&qp_.bounds.lower, &qp_.bounds.upper}) (*side)[j] /= size;
    for (RowVector* side : {&qp_.bounds.row_lower, &qp_.bounds.row_upper}) (*side)[j] *= size;
  }

  /// Moves the minimum of the objective alone far out of the bounds: beyond what a double holds of both at
  /// once.
  void move_target_far() {
    const double decades = uniform(0, 12);
    qp_.g *= std::pow(10, decades);
    target_.extreme = decades > 3;
  }

  void make_row_infeasible() {
    const int k = integer(0, n_ - 1);
    const double distance = qp_.row_scale(inside(), k) * std::pow(10, uniform(0, 6)) * (chance(0.5) ? 1 : -1);
    qp_.bounds.row_lower[k] += distance;
    qp_.bounds.row_upper[k] += distance;
    target_.feasible = false;
  }

  void insert_nan() {
    Bounds& bounds = qp_.bounds;
    double* values =
        std::array{qp_.g.data(), bounds.lower.data(), bounds.upper.data(), bounds.row_lower.data(),
                   bounds.row_upper.data()}[static_cast<std::size_t>(integer(0, 4))];
    values[integer(0, n_ - 1)] = std::numeric_limits<double>::quiet_NaN();
    target_.well_posed = false;
  }

  std::mt19937_64 random_;
  AdversarialProblem& target_;
  Qp& qp_;
  int n_ = 0;
};

}  // namespace

AdversarialProblem::AdversarialProblem(uint64_t seed) { Corruption(seed, *this).apply(); }

}  // namespace tendril::qp
