// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "fem/sparse/stiffness_matrix.h"

namespace tendril::fem {

/// A fill-reducing order of elimination. Of CHOLMOD's approximate minimum degree, METIS and nested
/// dissection, all on the graph of nodes, the one with the fewest operations.
/// @return  the N nodes in their order
/// @throws  std::runtime_error if CHOLMOD runs out of memory
/// Real-time: no (allocates; a second for 100 000 nodes).
std::vector<int> elimination_order(const StiffnessMatrix& K);

}  // namespace tendril::fem
