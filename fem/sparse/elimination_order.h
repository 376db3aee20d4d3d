#pragma once

#include <vector>

#include "fem/sparse/stiffness_matrix.h"

namespace tendril::fem {

/// An order of elimination that makes few numbers of the factor nonzero: of CHOLMOD's approximate minimum
/// degree, METIS and nested dissection, all on the graph of nodes, the one with the fewest operations.
/// @return  the N nodes in their order
/// @throws  std::runtime_error if CHOLMOD runs out of memory
/// Real-time: no (allocates; a second for 100 000 nodes).
std::vector<int> elimination_order(const StiffnessMatrix& K);

}  // namespace tendril::fem
