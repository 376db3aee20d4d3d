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

/// How a bordered matrix [K Bᵀ; B 0] is eliminated, K's nodes only: supernodes, children before parents, each
/// parent taking in the updates of its children [Liu, "The multifrontal method for sparse matrix solution:
/// theory and practice", 1992].
///
/// Supernodes that are small for what it costs to begin one are merged with their parents, at the price of
/// some zeros that are computed with.
/// @param order   the N nodes in their order of elimination, e.g. elimination_order(); the tree may change it
/// to
///                another with the same result
/// @param border  for each row of B the nodes at which it may be nonzero
/// Real-time: no (allocates).
std::vector<Supernode> assembly_tree(const StiffnessMatrix& K, const std::vector<int>& order,
                                     const std::vector<std::vector<int>>& border);

}  // namespace tendril::fem
