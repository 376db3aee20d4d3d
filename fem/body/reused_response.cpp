// SPDX-License-Identifier: Apache-2.0
#include "fem/body/reused_response.h"

#include <algorithm>
#include <cmath>

namespace tendril::fem {
namespace {

// Operations of a factorisation in the time that a sweep needs for each number of L, if L does not fit in the
// cache; about 25 if it does. It decides only when K is factored anew: another machine's value costs a little
// time.
constexpr double kOperationsPerNumber = 60;
// Steps after which the rate of convergence predicts the cost of the others well enough.
constexpr int kTrialSteps = 2;
constexpr int kMaxBackoff = 16;  // poses

/// W ← W + A Bᵀ.
void add_products(const EightVectors& A, const EightVectors& B, Eigen::Matrix<double, 8, 8>& W) {
  for (Eigen::Index j = 0; j < A.cols(); ++j) W += A.col(j).lazyProduct(B.col(j).transpose());
}

}  // namespace

ReusedResponse::ReusedResponse(const Constraints& constraints, const StiffnessMatrix& pattern)
    : border_(constraints, pattern.nodes(), Border::Rows::kActuatorsAndEffectors),
      factor_(pattern, border_.nodes(), StoragePrecision::kSingle),
      rotations_(pattern.nodes()),
      factored_x_(pattern.size()),
      blocks_((border_.rows() + 7) / 8),
      P_(8, pattern.size()),
      KP_(8, pattern.size()),
      W_(border_.rows(), border_.rows()),
      lambda_(constraints.actuators()),
      coefficients_(Eigen::VectorXd::Unit(8 * static_cast<int>(blocks_.size()), border_.rows() - 1)),
      factorization_cost_(factor_.operations() /
                          (kOperationsPerNumber * static_cast<double>(factor_.nonzeros()))) {
  for (RhsBlock& block : blocks_)
    for (EightVectors* V : {&block.B, &block.X, &block.R, &block.Z}) V->setZero(8, pattern.size());
  // The next pose computes r + J_aᵀλ anew, so one step towards its solution is enough.
  blocks_.back().unchecked[(border_.rows() - 1) % 8] = true;
}

bool ReusedResponse::compute(const StiffnessMatrix& K, const Eigen::VectorXd& x, const Eigen::VectorXd& r,
                             const Eigen::VectorXd& lambda) {
  border_.set(x, r);
  // At rest under its efforts the right-hand side r + J_aᵀλ is 0. So errors of the solutions do not move the
  // body.
  border_.add_efforts(lambda);
  lambda_ = lambda;
  const bool try_reuse = reusable_ && !should_factorize();
  sweeps_ = 0;
  factored_ = !(try_reuse && solve_all(K, x));
  if (factored_ && !factorize(K, x)) return false;
  const int last = border_.rows() - 1;
  for (int a = 0; a < lambda_.size(); ++a) W_.col(last).head(last) -= lambda_[a] * W_.col(a).head(last);
  return true;
}

/// Whether to factor at once: if the last pose cost more sweeps than the poses since the factorisation on
/// average, with the factorisation itself counted. From there on the average would rise. After a factor that
/// failed at the very next pose, some poses are factored without a trial.
bool ReusedResponse::should_factorize() {
  if (poses_to_skip_ > 0) {
    --poses_to_skip_;
    return true;
  }
  return poses_since_factorization_ > 1 && sweeps_ > sweeps_since_factorization_ / poses_since_factorization_;
}

bool ReusedResponse::solve_all(const StiffnessMatrix& K, const Eigen::VectorXd& x) {
  for (RhsBlock& block : blocks_) rotations_.rotate_back(block.X);
  rotations_.compute(K, factored_x_, x);
  for (int first = 0; first < border_.rows(); first += 8) {
    const int rows = std::min(8, border_.rows() - first);
    blocks_[first / 8].B.topRows(rows) = border_.transposed().middleCols(first, rows).transpose();
  }
  for (RhsBlock& block : blocks_) rotations_.rotate(block.X);
  // That step has been taken: r + J_aᵀλ of this pose is another one.
  blocks_.back().X.row((border_.rows() - 1) % 8).setZero();
  const bool solved = std::ranges::all_of(blocks_, [&](RhsBlock& block) { return solve_block(K, block); });
  if (!solved) {
    if (poses_since_factorization_ == 1) poses_to_skip_ = backoff_ = std::clamp(2 * backoff_, 1, kMaxBackoff);
    return false;
  }
  backoff_ = 0;
  sweeps_since_factorization_ += sweeps_;
  ++poses_since_factorization_;
  compute_W();
  return true;
}

/// Conjugate gradients for eight right-hand sides side by side; one that is done no longer changes.
bool ReusedResponse::solve_block(const StiffnessMatrix& K, RhsBlock& block) {
  auto& [B, X, R, Z, unchecked] = block;
  K.multiply(X, KP_);
  R = B - KP_;
  EightNumbers rho = precondition(block);
  const EightNumbers first = rho;
  // bᵀK⁻¹b, to the accuracy of W
  const EightNumbers energy = rho + (X.array() * (B + R).array()).rowwise().sum();
  const EightNumbers target = kTolerance * kTolerance * energy;
  EightNumbers beta;
  for (int steps = 0; !(rho <= target).all(); ++steps) {
    if (steps >= kTrialSteps && slower_than_factorizing(block, steps, first, rho, target)) return false;
    if (steps == 0)
      P_ = Z;
    else
      P_.array() = Z.array() + P_.array().colwise() * beta;
    K.multiply(P_, KP_);
    const EightNumbers curvature = (P_.array() * KP_.array()).rowwise().sum();
    const Eigen::Array<bool, 8, 1> done = rho <= target;
    if (!(done || curvature > 0).all()) return false;
    const EightNumbers alpha = done.select(EightNumbers::Zero(), rho / curvature);
    X.array() += P_.array().colwise() * alpha;
    R.array() -= KP_.array().colwise() * alpha;
    if ((done || unchecked).all()) {
      Z.array().colwise() *= done.cast<double>();  // of the unchecked ones it is not known
      return true;
    }
    const EightNumbers next = precondition(block);
    beta = done.select(EightNumbers::Zero(), next / rho);
    rho = next;
  }
  return true;
}

/// Whether the remaining steps, at the rate of those so far, cost more than a factorisation.
bool ReusedResponse::slower_than_factorizing(const RhsBlock& block, int steps, const EightNumbers& first,
                                             const EightNumbers& rho, const EightNumbers& target) const {
  const EightNumbers reduction = (first / rho).log() / steps, remaining = (rho / target).log();
  return !(block.unchecked || rho <= target || remaining <= factorization_cost_ * reduction).all();
}

/// Z ← P⁻¹ R.
/// @return  rᵀP⁻¹r of each
ReusedResponse::EightNumbers ReusedResponse::precondition(RhsBlock& block) {
  block.Z = block.R;
  rotations_.rotate_back(block.Z);
  factor_.precondition(block.Z);
  rotations_.rotate(block.Z);
  ++sweeps_;
  return (block.R.array() * block.Z.array()).rowwise().sum();
}

void ReusedResponse::compute_W() {
  const int rows = border_.rows();
  for (int a = 0; a < rows; a += 8)
    for (int b = 0; b < rows; b += 8) {
      const RhsBlock &A = blocks_[a / 8], &B = blocks_[b / 8];
      Eigen::Matrix<double, 8, 8> W = Eigen::Matrix<double, 8, 8>::Zero();
      add_products(A.B, B.X, W);
      add_products(A.X, B.R, W);
      add_products(A.R, B.Z, W);
      for (int i = a; i < std::min(a + 8, rows); ++i)
        for (int j = b; j < std::min(b + 8, rows); ++j) W_(i, j) = W(i - a, j - b);
    }
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < i; ++j) W_(i, j) = W_(j, i) = 0.5 * (W_(i, j) + W_(j, i));
}

bool ReusedResponse::factorize(const StiffnessMatrix& K, const Eigen::VectorXd& x) {
  reusable_ = factor_.factorize(K, border_.transposed());
  if (!reusable_) return false;
  W_ = factor_.border_compliance();
  for (int b = 0; b < static_cast<int>(blocks_.size()); ++b) factor_.border_solutions(8 * b, blocks_[b].X);
  factored_x_ = x;
  rotations_.reset();
  sweeps_since_factorization_ = factorization_cost_;
  poses_since_factorization_ = 1;
  return true;
}

void ReusedResponse::solve_step(const Eigen::VectorXd& lambda, Eigen::VectorXd& dx) {
  coefficients_.head(lambda.size()) = lambda - lambda_;
  dx.setZero(P_.cols());
  for (int b = 0; b < static_cast<int>(blocks_.size()); ++b)
    dx.noalias() += blocks_[b].X.transpose() * coefficients_.segment<8>(8 * b);
}

}  // namespace tendril::fem
