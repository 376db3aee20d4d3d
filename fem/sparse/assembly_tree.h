// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "fem/sparse/stiffness_matrix.h"

namespace tendril::fem {

/// Nodes that are eliminated together, in one front.
struct Supernode {
  std::vector<int> pivots;  ///< nodes, in the order of their elimination
  std::vector<int> rows;    ///< nodes eliminated later that they are coupled with, in that order
  std::vector<int> border;  ///< rows of the border that are not zero here, ascending
  int parent = -1;          ///< index of the supernode that holds rows[0]; −1: there is none
};

/// The assembly tree for the elimination of K from the bordered matrix [K Bᵀ; B 0]: supernodes, children
/// before parents. Each parent adds the updates of its children [Liu, "The multifrontal method for sparse
/// matrix solution: theory and practice", 1992].
///
/// Small supernodes are merged with their parents if that is cheaper, although some zeros are then computed
/// with.
/// @param order   the N nodes in their order of elimination, e.g. elimination_order(); the tree may use
///                another order with the same fill-in
/// @param border  for each row of B the nodes at which it may be nonzero
/// Real-time: no (allocates).
std::vector<Supernode> assembly_tree(const StiffnessMatrix& K, const std::vector<int>& order,
                                     const std::vector<std::vector<int>>& border);

}  // namespace tendril::fem
