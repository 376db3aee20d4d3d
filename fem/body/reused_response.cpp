#include "fem/body/reused_response.h"

#include <algorithm>
#include <cmath>

namespace tendril::fem {
namespace {

// Operations of a factorisation that take as long as a sweep takes for each number of L, where L does not fit
// in the cache; about 25 where it does. It tells when K is to be factored anew and nothing else, so that
// another machine's figure costs a little time.
constexpr double kOperationsPerNumber = 60;
// Steps after which the rate of convergence is known well enough to tell what the rest costs.
constexpr int kTrialSteps = 2;
constexpr int kLongestWait = 16;  // poses

/// W ← W + A Bᵀ.
void add_products(const EightVectors& A, const EightVectors& B, Eigen::Matrix<double, 8, 8>& W) {
  for (Eigen::Index j = 0; j < A.cols(); ++j) W += A.col(j).lazyProduct(B.col(j).transpose());
}

}  // namespace

ReusedResponse::ReusedResponse(const Constraints& constraints, const StiffnessMatrix& pattern)
    : border_(constraints, pattern.nodes(), Border::Rows::kActuatorsAndEffectors),
      factor_(pattern, border_.nodes(), Kept::kSingle),
      rotations_(pattern.nodes()),
      factored_x_(pattern.size()),
      batches_((border_.rows() + 7) / 8),
      P_(8, pattern.size()),
      KP_(8, pattern.size()),
      W_(border_.rows(), border_.rows()),
      lambda_(constraints.actuators()),
      coefficients_(Eigen::VectorXd::Unit(8 * static_cast<int>(batches_.size()), border_.rows() - 1)),
      price_(factor_.operations() / (kOperationsPerNumber * static_cast<double>(factor_.nonzeros()))) {
  for (Batch& batch : batches_)
    for (EightVectors* V : {&batch.B, &batch.X, &batch.R, &batch.Z}) V->setZero(8, pattern.size());
  // The next pose tells anew what is out of balance: one step towards it serves.
  batches_.back().unchecked[(border_.rows() - 1) % 8] = true;
}

bool ReusedResponse::compute(const StiffnessMatrix& K, const Eigen::VectorXd& x, const Eigen::VectorXd& r,
                             const Eigen::VectorXd& lambda) {
  border_.set(x, r);
  // At rest under its efforts the body has nothing left to solve for, so that what is wrong with the
  // solutions moves it no further.
  border_.add_efforts(lambda);
  lambda_ = lambda;
  const bool try_reuse = reusable_ && !worn_out();
  sweeps_ = 0;
  factored_ = !(try_reuse && reuse(K, x));
  if (factored_ && !factorize(K, x)) return false;
  const int last = border_.rows() - 1;
  for (int a = 0; a < lambda_.size(); ++a) W_.col(last).head(last) -= lambda_[a] * W_.col(a).head(last);
  return true;
}

/// Whether to factor at once. A factor is given up where a pose would take longer with it than poses have
/// taken on average since it was made, its making included: from there on the average would rise. It is not
/// tried for a while where it could not serve the very next pose.
bool ReusedResponse::worn_out() {
  if (waiting_ > 0) {
    --waiting_;
    return true;
  }
  return poses_ > 1 && sweeps_ > spent_ / poses_;
}

bool ReusedResponse::reuse(const StiffnessMatrix& K, const Eigen::VectorXd& x) {
  for (Batch& batch : batches_) rotations_.turn_back(batch.X);
  rotations_.find(K, factored_x_, x);
  for (int first = 0; first < border_.rows(); first += 8) {
    const int rows = std::min(8, border_.rows() - first);
    batches_[first / 8].B.topRows(rows) = border_.transposed().middleCols(first, rows).transpose();
  }
  for (Batch& batch : batches_) rotations_.turn(batch.X);
  // The last pose's forces out of balance are not these: that step has been taken.
  batches_.back().X.row((border_.rows() - 1) % 8).setZero();
  const bool solved = std::ranges::all_of(batches_, [&](Batch& batch) { return solve(K, batch); });
  if (!solved) {
    if (poses_ == 1) waiting_ = patience_ = std::clamp(2 * patience_, 1, kLongestWait);
    return false;
  }
  patience_ = 0;
  spent_ += sweeps_;
  ++poses_;
  find_W();
  return true;
}

/// Eight conjugate gradient iterations in step; a right side that is done stands still.
bool ReusedResponse::solve(const StiffnessMatrix& K, Batch& batch) {
  auto& [B, X, R, Z, unchecked] = batch;
  K.multiply(X, KP_);
  R = B - KP_;
  EightNumbers rho = precondition(batch);
  const EightNumbers first = rho;
  // (bᵀK⁻¹b) to the accuracy that W has
  const EightNumbers energy = rho + (X.array() * (B + R).array()).rowwise().sum();
  const EightNumbers target = kTolerance * kTolerance * energy;
  EightNumbers beta;
  for (int steps = 0; !(rho <= target).all(); ++steps) {
    if (steps >= kTrialSteps && hopeless(batch, steps, first, rho, target)) return false;
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
      Z.array().colwise() *= done.cast<double>();  // of the others it is not known
      return true;
    }
    const EightNumbers next = precondition(batch);
    beta = done.select(EightNumbers::Zero(), next / rho);
    rho = next;
  }
  return true;
}

/// Whether the steps to come, at the rate of those so far, cost more than a factorisation.
bool ReusedResponse::hopeless(const Batch& batch, int steps, const EightNumbers& first,
                              const EightNumbers& rho, const EightNumbers& target) const {
  const EightNumbers gained = (first / rho).log() / steps, missing = (rho / target).log();
  return !(batch.unchecked || rho <= target || missing <= price_ * gained).all();
}

/// Z ← P⁻¹ R.
/// @return  rᵀP⁻¹r of each
ReusedResponse::EightNumbers ReusedResponse::precondition(Batch& batch) {
  batch.Z = batch.R;
  rotations_.turn_back(batch.Z);
  factor_.precondition(batch.Z);
  rotations_.turn(batch.Z);
  ++sweeps_;
  return (batch.R.array() * batch.Z.array()).rowwise().sum();
}

void ReusedResponse::find_W() {
  const int rows = border_.rows();
  for (int a = 0; a < rows; a += 8)
    for (int b = 0; b < rows; b += 8) {
      const Batch &A = batches_[a / 8], &B = batches_[b / 8];
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
  for (int b = 0; b < static_cast<int>(batches_.size()); ++b) factor_.border_solutions(8 * b, batches_[b].X);
  factored_x_ = x;
  rotations_.reset();
  spent_ = price_;
  poses_ = 1;
  return true;
}

void ReusedResponse::move(const Eigen::VectorXd& lambda, Eigen::VectorXd& dx) {
  coefficients_.head(lambda.size()) = lambda - lambda_;
  dx.setZero(P_.cols());
  for (int b = 0; b < static_cast<int>(batches_.size()); ++b)
    dx.noalias() += batches_[b].X.transpose() * coefficients_.segment<8>(8 * b);
}

}  // namespace tendril::fem
