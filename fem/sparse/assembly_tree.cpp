// SPDX-License-Identifier: Apache-2.0
#include "fem/sparse/assembly_tree.h"

#include <algorithm>
#include <numeric>

namespace tendril::fem {
namespace {

using Lists = std::vector<std::vector<int>>;

/// Cost of a front, in nanoseconds on a processor of 2022; only ratios matter.
double cost(double pivots, double rows) {
  constexpr double kFront = 250, kBlock = 100, kOperation = 0.02, kUpdate = 0.25;
  const double all = pivots + rows;
  // Σ (all − j)² over the pivots j.
  const double operations = pivots * (all * all - all * pivots + pivots * pivots / 3);
  return kFront + kBlock * (pivots / 8) + kOperation * operations + kUpdate * rows * rows / 2;
}

std::vector<int> positions(const std::vector<int>& order) {
  std::vector<int> position(order.size());
  for (size_t p = 0; p < order.size(); ++p) position[order[p]] = static_cast<int>(p);
  return position;
}

/// For each position the later positions it is coupled with in K.
Lists later_neighbours(const StiffnessMatrix& K, const std::vector<int>& position) {
  Lists later(K.nodes());
  for (int j = 0; j < K.nodes(); ++j)
    for (int k = K.column_starts()[j] + 1; k < K.column_starts()[j + 1]; ++k) {
      const auto [first, second] = std::minmax(position[j], position[K.rows()[k]]);
      later[first].push_back(second);
    }
  return later;
}

/// Parent of each position in the elimination tree: its first later neighbour in the factor [Liu 1986].
std::vector<int> elimination_tree(const Lists& later) {
  const int n = static_cast<int>(later.size());
  Lists earlier(n);
  for (int j = 0; j < n; ++j)
    for (int i : later[j]) earlier[i].push_back(j);
  std::vector<int> parent(n, -1), ancestor(n, -1);
  for (int i = 0; i < n; ++i)
    for (int j : earlier[i])
      while (j != -1 && j != i) {
        const int next = ancestor[j];
        ancestor[j] = i;
        if (next == -1) parent[j] = i;
        j = next;
      }
  return parent;
}

/// Postorder: children before parents, each subtree contiguous.
std::vector<int> postorder(const std::vector<int>& parent) {
  const int n = static_cast<int>(parent.size());
  Lists children(n);
  std::vector<int> stack, order;
  for (int j = n - 1; j >= 0; --j) (parent[j] < 0 ? stack : children[parent[j]]).push_back(j);
  while (!stack.empty()) {  // parents first, reversed at the end
    const int j = stack.back();
    stack.pop_back();
    order.push_back(j);
    stack.insert(stack.end(), children[j].rbegin(), children[j].rend());
  }
  std::reverse(order.begin(), order.end());
  return order;
}

/// list ← sorted union of it and the entries of `other` that are greater than `beyond`.
void unite(std::vector<int>& list, const std::vector<int>& other, int beyond) {
  std::vector<int> both;
  both.reserve(list.size() + other.size());
  std::set_union(list.begin(), list.end(), std::upper_bound(other.begin(), other.end(), beyond), other.end(),
                 std::back_inserter(both));
  list.swap(both);
}

/// The fundamental supernodes of the factor, before any are merged; positions instead of nodes.
std::vector<Supernode> fundamental_supernodes(Lists later) {
  const int n = static_cast<int>(later.size());
  const std::vector<int> parent = elimination_tree(later);
  for (auto& list : later) std::sort(list.begin(), list.end());
  for (int j = 0; j < n; ++j)
    if (parent[j] >= 0) unite(later[parent[j]], later[j], parent[j]);

  std::vector<Supernode> result;
  std::vector<int> supernode_of(n);
  for (int j = 0; j < n; ++j) {
    const bool continues = j > 0 && parent[j - 1] == j && later[j - 1].size() == later[j].size() + 1;
    if (!continues) result.emplace_back();
    result.back().pivots.push_back(j);
    supernode_of[j] = static_cast<int>(result.size()) - 1;
  }
  for (auto& s : result) {
    s.rows = std::move(later[s.pivots.back()]);
    if (!s.rows.empty()) s.parent = supernode_of[s.rows[0]];
  }
  return result;
}

void add_border(std::vector<Supernode>& tree, const Lists& border, const std::vector<int>& position) {
  std::vector<int> supernode_of(position.size());
  for (size_t s = 0; s < tree.size(); ++s)
    for (int p : tree[s].pivots) supernode_of[p] = static_cast<int>(s);
  for (size_t row = 0; row < border.size(); ++row)
    for (int node : border[row])
      // A row that is nonzero at a node fills in at all ancestors.
      for (int s = supernode_of[position[node]]; s >= 0; s = tree[s].parent) {
        auto& rows = tree[s].border;
        if (!rows.empty() && rows.back() == static_cast<int>(row)) break;
        rows.push_back(static_cast<int>(row));
      }
}

/// Merges supernodes into their parents where that is cheaper.
std::vector<Supernode> merge(std::vector<Supernode> tree) {
  const int n = static_cast<int>(tree.size());
  Lists children(n);
  std::vector<char> gone(n, 0);
  const auto price = [&](size_t pivots, const Supernode& rows_of) {
    return cost(3.0 * static_cast<double>(pivots),
                static_cast<double>(3 * rows_of.rows.size() + rows_of.border.size()));
  };
  for (int p = 0; p < n; ++p) {
    auto& parent = tree[p];
    std::vector<int> kept;
    std::vector<int> merged;
    size_t pivots = parent.pivots.size();
    // The last children first: they are the largest as a rule.
    for (auto c = children[p].rbegin(); c != children[p].rend(); ++c) {
      const auto& child = tree[*c];
      const double apart = price(child.pivots.size(), child) + price(pivots, parent);
      if (price(child.pivots.size() + pivots, parent) < apart) {
        pivots += child.pivots.size();
        merged.push_back(*c);
      } else {
        kept.push_back(*c);
      }
    }
    std::vector<int> all;
    for (int c : merged) {
      all.insert(all.end(), tree[c].pivots.begin(), tree[c].pivots.end());
      kept.insert(kept.end(), children[c].begin(), children[c].end());
      gone[c] = 1;
    }
    all.insert(all.end(), parent.pivots.begin(), parent.pivots.end());
    parent.pivots = std::move(all);
    for (int c : kept) tree[c].parent = p;
    children[p] = kept;
    if (parent.parent >= 0) children[parent.parent].push_back(p);
  }

  // The remaining supernodes, still children before parents.
  std::vector<int> index(n, -1);
  std::vector<Supernode> result;
  for (int s = 0; s < n; ++s)
    if (!gone[s]) {
      index[s] = static_cast<int>(result.size());
      result.push_back(std::move(tree[s]));
    }
  for (auto& s : result)
    if (s.parent >= 0) s.parent = index[s.parent];
  return result;
}

}  // namespace

std::vector<Supernode> assembly_tree(const StiffnessMatrix& K, const std::vector<int>& order,
                                     const std::vector<std::vector<int>>& border) {
  std::vector<int> post = postorder(elimination_tree(later_neighbours(K, positions(order))));
  for (int& p : post) p = order[p];
  const std::vector<int> position = positions(post);
  std::vector<Supernode> tree = fundamental_supernodes(later_neighbours(K, position));
  add_border(tree, border, position);
  tree = merge(std::move(tree));

  // From positions to nodes. Merging has moved pivots, so the rows are sorted again.
  std::vector<int> final_position(post.size());
  int next = 0;
  for (const auto& s : tree)
    for (int p : s.pivots) final_position[p] = next++;
  for (auto& s : tree) {
    std::sort(s.rows.begin(), s.rows.end(),
              [&](int a, int b) { return final_position[a] < final_position[b]; });
    for (auto* list : {&s.pivots, &s.rows})
      for (int& p : *list) p = post[p];
  }
  return tree;
}

}  // namespace tendril::fem
