#include "fem/factor.h"

#include <cholmod.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>

namespace tendril::fem {

struct Factor::Cholmod {
  cholmod_common common{};
  cholmod_factor* L = nullptr;
  // Work space that cholmod_solve2 keeps from call to call.
  cholmod_dense* X = nullptr;
  cholmod_dense* Y = nullptr;
  cholmod_dense* E = nullptr;

  Cholmod() {
    cholmod_start(&common);
    common.supernodal = CHOLMOD_SIMPLICIAL;  // no BLAS: single-threaded, and the same bits at every run
    common.final_ll = true;                  // LLᵀ, which a matrix that is not positive definite breaks off
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_NESDIS;  // nested dissection: fewest operations on bodies like ours
    common.print = 0;
  }
  ~Cholmod() {
    cholmod_free_dense(&X, &common);
    cholmod_free_dense(&Y, &common);
    cholmod_free_dense(&E, &common);
    cholmod_free_factor(&L, &common);
    cholmod_finish(&common);
  }
};

namespace {

/// CHOLMOD's view of K; CHOLMOD only reads through it.
cholmod_sparse view(const StiffnessMatrix& K) {
  cholmod_sparse A{};
  A.nrow = A.ncol = static_cast<size_t>(K.size());
  A.nzmax = K.values().size();
  A.p = const_cast<int*>(K.column_starts().data());
  A.i = const_cast<int*>(K.rows().data());
  A.x = const_cast<double*>(K.values().data());
  A.stype = -1;  // the lower triangle counts
  A.itype = CHOLMOD_INT;
  A.xtype = CHOLMOD_REAL;
  A.dtype = CHOLMOD_DOUBLE;
  A.sorted = true;
  A.packed = true;
  return A;
}

}  // namespace

Factor::Factor(const StiffnessMatrix& K) : cholmod_(std::make_unique<Cholmod>()) {
  cholmod_sparse A = view(K);
  cholmod_->L = cholmod_analyze(&A, &cholmod_->common);
  if (!cholmod_->L) throw std::runtime_error("CHOLMOD could not analyse the stiffness matrix: out of memory");
}

Factor::~Factor() = default;

bool Factor::factorize(const StiffnessMatrix& K) {
  cholmod_sparse A = view(K);
  cholmod_->common.status = CHOLMOD_OK;
  cholmod_factorize(&A, cholmod_->L, &cholmod_->common);
  if (cholmod_->common.status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
  if (cholmod_->common.status != CHOLMOD_OK) return false;
  // CHOLMOD lets NaN pass: no pivot compares below zero.
  const cholmod_factor* L = cholmod_->L;
  const auto* starts = static_cast<const int*>(L->p);
  const auto* values = static_cast<const double*>(L->x);
  return std::all_of(starts, starts + L->n, [&](int start) { return std::isfinite(values[start]); });
}

void Factor::solve(const Eigen::MatrixXd& B, Eigen::MatrixXd& X) {
  cholmod_dense b{};
  b.nrow = static_cast<size_t>(B.rows());
  b.ncol = static_cast<size_t>(B.cols());
  b.nzmax = b.nrow * b.ncol;
  b.d = b.nrow;
  b.x = const_cast<double*>(B.data());
  b.xtype = CHOLMOD_REAL;
  b.dtype = CHOLMOD_DOUBLE;
  cholmod_solve2(CHOLMOD_A, cholmod_->L, &b, nullptr, &cholmod_->X, nullptr, &cholmod_->Y, &cholmod_->E,
                 &cholmod_->common);
  if (cholmod_->common.status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
  X = Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(cholmod_->X->x), B.rows(), B.cols());
}

}  // namespace tendril::fem
