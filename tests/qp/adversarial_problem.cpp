#include "tests/qp/adversary.h"

#include <algorithm>
#include <cmath>

namespace tendril::qp {
namespace {

/// Draws what goes wrong with a problem, and does it.
class Trouble {
 public:
  Trouble(std::uint64_t seed, Adversary& victim) : random_(seed), victim_(victim), qp_(victim.qp) {
    n_ = chance(0.04) ? integer(9, kMaxVariables) : integer(1, 8);
    victim_.feasible = chance(0.7);
    qp_ = random_qp(random_, n_, victim_.feasible ? Rows::kFeasible : Rows::kArbitrary);
  }

  void make() {
    if (n_ > 1 && chance(0.15)) make_alike();
    if (chance(0.1)) qp_.bounds.lower = qp_.bounds.upper = inside();
    if (chance(0.05)) qp_.bounds.row_lower = qp_.bounds.row_upper = qp_.A * inside();
    if (victim_.feasible) admit(inside());
    if (chance(0.2)) change_unit(integer(0, n_ - 1), std::ldexp(1.0, integer(-20, 20)));
    if (chance(0.2)) ask_from_afar();
    if (chance(0.1)) ask_too_much();
    if (chance(0.03)) break_a_number();
  }

 private:
  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
  int integer(int from, int to) { return std::uniform_int_distribution<int>(from, to)(random_); }
  bool chance(double probability) { return uniform(0, 1) < probability; }

  /// A point that meets the bounds.
  Vector inside() const { return Vector::Zero(n_).cwiseMax(qp_.bounds.lower).cwiseMin(qp_.bounds.upper); }

  /// Moves the rows' bounds as little as lets x meet them.
  void admit(const Vector& x) {
    const Vector violation = qp_.violation(x);
    qp_.bounds.row_lower += violation;
    qp_.bounds.row_upper += violation;
  }

  /// Has the last actuator pull almost where the first does.
  void make_alike() {
    Matrix T = Matrix::Identity(n_, n_);
    T(0, n_ - 1) = 1;
    T(n_ - 1, n_ - 1) = std::pow(10, uniform(-12, -2));
    for (Matrix* S : {&qp_.H, &qp_.A}) {
      const Matrix transformed = T.transpose() * *S * T;
      *S = (transformed + transformed.transpose()) / 2;
    }
    qp_.g = T.transpose() * qp_.g;
    // Such an H is as good as singular: without bounds the minimum would be anywhere.
    const Vector room = (qp_.bounds.lower.array().isFinite()).select(qp_.bounds.lower, qp_.bounds.upper);
    for (int j = 0; j < n_; ++j) {
      const double centre = std::isfinite(room[j]) ? room[j] : 0, far = 4 / std::sqrt(qp_.A(j, j));
      if (std::isinf(qp_.bounds.lower[j])) qp_.bounds.lower[j] = centre - far;
      if (std::isinf(qp_.bounds.upper[j])) qp_.bounds.upper[j] = centre + far;
    }
  }

  /// Measures variable j in a unit of its own, as Pa next to N.
  void change_unit(int j, double size) {
    for (Matrix* S : {&qp_.H, &qp_.A}) {
      S->row(j) *= size;
      S->col(j) *= size;
    }
    qp_.g[j] *= size;
    for (Vector* side : {&qp_.bounds.lower, &qp_.bounds.upper}) (*side)[j] /= size;
    for (Vector* side : {&qp_.bounds.row_lower, &qp_.bounds.row_upper}) (*side)[j] *= size;
  }

  /// Moves the minimum of the objective alone far out of the bounds: beyond what a double holds of both at
  /// once.
  void ask_from_afar() {
    const double decades = uniform(0, 12);
    qp_.g *= std::pow(10, decades);
    victim_.extreme = decades > 3;
  }

  void ask_too_much() {
    const int k = integer(0, n_ - 1);
    const double far = qp_.row_scale(inside(), k) * std::pow(10, uniform(0, 6)) * (chance(0.5) ? 1 : -1);
    qp_.bounds.row_lower[k] += far;
    qp_.bounds.row_upper[k] += far;
    victim_.feasible = false;
  }

  void break_a_number() {
    Bounds& bounds = qp_.bounds;
    Vector& values = *std::array{&qp_.g, &bounds.lower, &bounds.upper, &bounds.row_lower,
                                 &bounds.row_upper}[static_cast<std::size_t>(integer(0, 4))];
    values[integer(0, n_ - 1)] = std::numeric_limits<double>::quiet_NaN();
    victim_.well_posed = false;
  }

  std::mt19937_64 random_;
  Adversary& victim_;
  Qp& qp_;
  int n_ = 0;
};

}  // namespace

Adversary::Adversary(std::uint64_t seed) { Trouble(seed, *this).make(); }

}  // namespace tendril::qp
