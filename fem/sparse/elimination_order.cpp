// SPDX-License-Identifier: Apache-2.0
#include "fem/sparse/elimination_order.h"

#include <cholmod.h>

#include <limits>
#include <stdexcept>

namespace tendril::fem {
namespace {

/// The pattern of blocks of K for CHOLMOD, without numbers. CHOLMOD does not write to it.
cholmod_sparse graph_of(const StiffnessMatrix& K) {
  cholmod_sparse A{};
  A.nrow = A.ncol = static_cast<size_t>(K.nodes());
  A.nzmax = K.rows().size();
  A.p = const_cast<int*>(K.column_starts().data());
  A.i = const_cast<int*>(K.rows().data());
  A.stype = -1;  // the lower triangle counts
  A.itype = CHOLMOD_INT;
  A.xtype = CHOLMOD_PATTERN;
  A.dtype = CHOLMOD_DOUBLE;
  A.sorted = true;
  A.packed = true;
  return A;
}

}  // namespace

std::vector<int> elimination_order(const StiffnessMatrix& K) {
  cholmod_sparse A = graph_of(K);
  std::vector<int> order;
  double fewest = std::numeric_limits<double>::infinity();
  for (const int method : {CHOLMOD_AMD, CHOLMOD_METIS, CHOLMOD_NESDIS}) {
    cholmod_common common;
    cholmod_start(&common);
    common.print = 0;
    common.nmethods = 1;
    common.method[0].ordering = method;
    common.supernodal = CHOLMOD_SIMPLICIAL;
    cholmod_factor* L = cholmod_analyze(&A, &common);
    if (L && common.fl < fewest) {
      fewest = common.fl;
      const int* permutation = static_cast<const int*>(L->Perm);
      order.assign(permutation, permutation + K.nodes());
    }
    cholmod_free_factor(&L, &common);
    cholmod_finish(&common);
  }
  if (order.empty()) throw std::runtime_error("CHOLMOD could not order the stiffness matrix: out of memory");
  return order;
}

}  // namespace tendril::fem
