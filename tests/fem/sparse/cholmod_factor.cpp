// SPDX-License-Identifier: Apache-2.0
#include "tests/fem/sparse/cholmod_factor.h"

#include <cholmod.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>
#include <vector>

namespace tendril::fem {

struct CholmodFactor::Cholmod {
  cholmod_common common{};
  cholmod_factor* L = nullptr;
  // K in columns of scalars, as CHOLMOD reads it.
  std::vector<int> starts, rows;
  std::vector<double> values;
  // Work space that cholmod_solve2 keeps from call to call.
  cholmod_dense* X = nullptr;
  cholmod_dense* Y = nullptr;
  cholmod_dense* E = nullptr;

  explicit Cholmod(Method method) {
    cholmod_start(&common);
    common.supernodal = method == Method::kSimplicial ? CHOLMOD_SIMPLICIAL : CHOLMOD_SUPERNODAL;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_AMD;
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

/// The pattern of K in columns of scalars. Blocks on the diagonal stay whole: CHOLMOD ignores the upper half.
void set_pattern(const StiffnessMatrix& K, std::vector<int>& starts, std::vector<int>& rows) {
  starts.assign(1, 0);
  for (int j = 0; j < K.nodes(); ++j)
    for (int c = 0; c < 3; ++c) {
      for (int k = K.column_starts()[j]; k < K.column_starts()[j + 1]; ++k)
        for (int r = 0; r < 3; ++r) rows.push_back(3 * K.rows()[k] + r);
      starts.push_back(static_cast<int>(rows.size()));
    }
}

void set_values(const StiffnessMatrix& K, std::vector<double>& values) {
  auto value = values.begin();
  for (int j = 0; j < K.nodes(); ++j)
    for (int c = 0; c < 3; ++c)
      for (int k = K.column_starts()[j]; k < K.column_starts()[j + 1]; ++k)
        value = std::copy_n(K.block(k) + 3 * c, 3, value);
}

cholmod_sparse view(std::vector<int>& starts, std::vector<int>& rows, std::vector<double>& values) {
  cholmod_sparse A{};
  A.nrow = A.ncol = starts.size() - 1;
  A.nzmax = values.size();
  A.p = starts.data();
  A.i = rows.data();
  A.x = values.data();
  A.stype = -1;  // the lower triangle counts
  A.itype = CHOLMOD_INT;
  A.xtype = CHOLMOD_REAL;
  A.dtype = CHOLMOD_DOUBLE;
  A.sorted = true;
  A.packed = true;
  return A;
}

}  // namespace

CholmodFactor::CholmodFactor(const StiffnessMatrix& K, Method method)
    : cholmod_(std::make_unique<Cholmod>(method)) {
  set_pattern(K, cholmod_->starts, cholmod_->rows);
  cholmod_->values.resize(cholmod_->rows.size());
  cholmod_sparse A = view(cholmod_->starts, cholmod_->rows, cholmod_->values);
  cholmod_->L = cholmod_analyze(&A, &cholmod_->common);
  if (!cholmod_->L) throw std::runtime_error("CHOLMOD could not analyse the stiffness matrix: out of memory");
}

CholmodFactor::~CholmodFactor() = default;

bool CholmodFactor::factorize(const StiffnessMatrix& K) {
  set_values(K, cholmod_->values);
  return factorize_again();
}

bool CholmodFactor::factorize_again() {
  cholmod_sparse A = view(cholmod_->starts, cholmod_->rows, cholmod_->values);
  cholmod_->common.status = CHOLMOD_OK;
  cholmod_factorize(&A, cholmod_->L, &cholmod_->common);
  if (cholmod_->common.status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
  if (cholmod_->common.status != CHOLMOD_OK) return false;
  // LDLᵀ goes on where a pivot is negative, and NaN passes every comparison of CHOLMOD's.
  const cholmod_factor* L = cholmod_->L;
  if (L->is_super) return true;
  const auto* starts = static_cast<const int*>(L->p);
  const auto* values = static_cast<const double*>(L->x);
  return std::all_of(starts, starts + L->n,
                     [&](int start) { return values[start] > 0 && std::isfinite(values[start]); });
}

double CholmodFactor::operations() const { return cholmod_->common.fl; }

void CholmodFactor::solve(const Eigen::MatrixXd& B, Eigen::MatrixXd& X) {
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
