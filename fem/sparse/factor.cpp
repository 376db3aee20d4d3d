// SPDX-License-Identifier: Apache-2.0
#include "fem/sparse/factor.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <list>
#include <new>

#include "fem/sparse/assembly_tree.h"
#include "fem/sparse/elimination_order.h"

namespace tendril::fem {
namespace {

constexpr size_t kAlignment = 64;  // bytes: a cache line, an AVX-512 vector

template <typename Number>
AlignedArray<Number> allocate(size_t count) {
  const size_t bytes = (count * sizeof(Number) + kAlignment - 1) / kAlignment * kAlignment;
  auto* memory = static_cast<Number*>(std::aligned_alloc(kAlignment, std::max(bytes, kAlignment)));
  if (!memory) throw std::bad_alloc();
  std::memset(memory, 0, std::max(bytes, kAlignment));
  return AlignedArray<Number>(memory);
}

/// An odd number of cache lines: columns that are a power of two apart would conflict in the cache.
int column_length(int rows) {
  const int panels = (rows + kSimdRows - 1) / kSimdRows;
  return kSimdRows * (panels | 1);
}

/// Zeroes the lower triangle of columns of length ld, in whole panels.
void zero_lower(double* columns, int count, int rows, int ld) {
  for (int j = 0; j < count; ++j) {
    const int first = j / kSimdRows * kSimdRows;
    std::memset(columns + static_cast<size_t>(j) * ld + first, 0, sizeof(double) * (rows - first));
  }
}

/// Offsets in one block of memory, first fit. All pieces are laid out before the block is allocated.
class Arena {
 public:
  size_t allocate(size_t size) {
    for (auto gap = gaps_.begin(); gap != gaps_.end(); ++gap)
      if (gap->size >= size) {
        const size_t at = gap->at;
        gap->at += size;
        gap->size -= size;
        if (gap->size == 0) gaps_.erase(gap);
        return at;
      }
    if (!gaps_.empty() && gaps_.back().at + gaps_.back().size == end_) {
      end_ = gaps_.back().at;
      gaps_.pop_back();
    }
    end_ += size;
    return end_ - size;
  }
  void release(size_t at, size_t size) {
    auto next = std::find_if(gaps_.begin(), gaps_.end(), [&](const Gap& gap) { return gap.at > at; });
    auto here = gaps_.insert(next, {at, size});
    if (next != gaps_.end() && here->at + here->size == next->at) {
      here->size += next->size;
      gaps_.erase(next);
    }
    if (here == gaps_.begin()) return;
    if (auto before = std::prev(here); before->at + before->size == here->at) {
      before->size += here->size;
      gaps_.erase(here);
    }
  }
  size_t end() const { return end_; }

 private:
  struct Gap {
    size_t at, size;
  };
  std::list<Gap> gaps_;  // ascending, apart from one another
  size_t end_ = 0;
};

}  // namespace

void AlignedDelete::operator()(void* p) const noexcept { std::free(p); }

Factor::Factor(const StiffnessMatrix& K, const std::vector<std::vector<int>>& border,
               StoragePrecision storage, const FrontKernels& kernels)
    : storage_(storage), kernels_(kernels) {
  for (Supernode& s : assembly_tree(K, elimination_order(K), border)) {
    FrontLayout& layout = fronts_.emplace_back();
    layout.pivots = std::move(s.pivots);
    layout.rows = std::move(s.rows);
    layout.border = std::move(s.border);
    layout.parent = s.parent;
  }
  for (int s = 0; s < fronts(); ++s)
    if (fronts_[s].parent >= 0) fronts_[fronts_[s].parent].children.push_back(s);
  lay_out(K.size());
  map_entries(K);
  map_rows();
  lay_out_updates();
  border_compliance_.setZero(border.size(), border.size());
}

void Factor::lay_out(int unknowns) {
  size_t all_L = 0, longest_L = 0, longest_F = 0, longest_front = 0;
  for (FrontLayout& f : fronts_) {
    f.k = 3 * static_cast<int>(f.pivots.size());
    f.n = 3 * static_cast<int>(f.rows.size()) + static_cast<int>(f.border.size());
    const int rows = round_up_to_panel(f.k) + round_up_to_panel(f.n);
    f.ld = column_length(rows);
    f.ldu = column_length(f.n);
    f.L = all_L;
    all_L += static_cast<size_t>(rows) * f.k;
    longest_L = std::max(longest_L, static_cast<size_t>(rows) * f.k);
    longest_F = std::max(longest_F, static_cast<size_t>(f.ld) * f.k);
    longest_front = std::max(longest_front, static_cast<size_t>(rows) + kSimdRows);
  }
  F_ = allocate<double>(longest_F);
  if (storage_ == StoragePrecision::kDouble) {
    L_ = allocate<double>(all_L);
    z_ = allocate<double>(2 * longest_front);
  } else {
    L_ = allocate<double>(longest_L);
    L1_ = allocate<float>(all_L);
    x1_ = allocate<float>(8 * static_cast<size_t>(unknowns));
    front1_ = allocate<float>(8 * longest_front);
  }
}

void Factor::map_entries(const StiffnessMatrix& K) {
  std::vector<int> position(K.nodes()), front_of(K.nodes());
  int next = 0;
  for (int s = 0; s < fronts(); ++s)
    for (int node : fronts_[s].pivots) {
      position[node] = next++;
      front_of[node] = s;
    }
  for (int j = 0; j < K.nodes(); ++j)
    for (int slot = K.column_starts()[j]; slot < K.column_starts()[j + 1]; ++slot) {
      const int i = K.rows()[slot];
      const bool transposed = position[i] < position[j];
      const int column = transposed ? i : j, row = transposed ? j : i;
      FrontLayout& f = fronts_[front_of[column]];
      const int first = position[f.pivots[0]];
      const int pivots = static_cast<int>(f.pivots.size());
      int at_row = 3 * (position[row] - first);
      if (position[row] - first >= pivots) {
        const auto found = std::lower_bound(f.rows.begin(), f.rows.end(), row,
                                            [&](int a, int b) { return position[a] < position[b]; });
        at_row = round_up_to_panel(f.k) + 3 * static_cast<int>(found - f.rows.begin());
      }
      f.entries.push_back(
          {slot, transposed, 3 * (position[column] - first) * static_cast<std::ptrdiff_t>(f.ld) + at_row});
    }
}

void Factor::map_rows() {
  for (FrontLayout& f : fronts_) {
    if (f.parent < 0) continue;
    const FrontLayout& parent = fronts_[f.parent];
    int from = 0;
    const auto add = [&](int to) {
      auto& map = f.rows_in_parent;
      const int lane = to % kSimdRows;
      if (map.empty() || map.back().to != to - lane) map.push_back({from, to - lane, 0});
      map.back().mask |= 1u << lane;
      ++from;
    };
    // All lists are in the order of elimination.
    const int update_begin = round_up_to_panel(parent.k);
    size_t p = 0, r = 0, b = 0;
    for (const int node : f.rows) {
      while (p < parent.pivots.size() && parent.pivots[p] != node) ++p;
      const bool is_pivot = p < parent.pivots.size();
      while (!is_pivot && parent.rows[r] != node) ++r;
      const int to = is_pivot ? 3 * static_cast<int>(p) : update_begin + 3 * static_cast<int>(r);
      for (int c = 0; c < 3; ++c) add(to + c);
    }
    for (const int row : f.border) {
      while (parent.border[b] != row) ++b;
      add(update_begin + 3 * static_cast<int>(parent.rows.size()) + static_cast<int>(b));
    }
  }
}

void Factor::lay_out_updates() {
  const auto size = [](const FrontLayout& f) { return static_cast<size_t>(f.ldu) * round_up_to_panel(f.n); };
  Arena arena;
  for (FrontLayout& f : fronts_) {
    f.U = arena.allocate(size(f));
    for (int c : f.children) arena.release(fronts_[c].U, size(fronts_[c]));
  }
  U_ = allocate<double>(arena.end());
}

Front Factor::front(const FrontLayout& f) const {
  double* L = L_.get() + (storage_ == StoragePrecision::kDouble ? f.L : 0);
  return {f.k, f.n, F_.get(), f.ld, L, U_.get() + f.U, f.ldu, !f.children.empty()};
}

bool Factor::factorize(const StiffnessMatrix& K, const Eigen::MatrixXd& B_T) {
  border_compliance_.setZero();
  for (const FrontLayout& layout : fronts_) {
    const Front f = front(layout);
    assemble(layout, K, B_T, f);
    for (int c : layout.children) {
      const FrontLayout& child = fronts_[c];
      kernels_.extend_add(U_.get() + child.U, child.ldu, child.rows_in_parent.data(),
                          static_cast<int>(child.rows_in_parent.size()), f);
    }
    if (!kernels_.eliminate(f)) return false;
    if (storage_ == StoragePrecision::kSingle) store_single(layout, f.L);
    if (layout.parent < 0) add_to_border_compliance(layout);
  }
  return true;
}

void Factor::assemble(const FrontLayout& layout, const StiffnessMatrix& K, const Eigen::MatrixXd& B_T,
                      const Front& f) const {
  const int update_rows = round_up_to_panel(f.n);
  zero_lower(f.F, f.k, round_up_to_panel(f.k) + update_rows, f.ld);
  if (f.U_is_set) zero_lower(f.U, update_rows, update_rows, f.ldu);
  for (const Entry& entry : layout.entries) {
    const double* block = K.block(entry.slot);
    double* at = f.F + entry.at;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) at[c * f.ld + r] = entry.transposed ? block[3 * r + c] : block[3 * c + r];
  }
  const int first = round_up_to_panel(f.k) + 3 * static_cast<int>(layout.rows.size());
  for (size_t b = 0; b < layout.border.size(); ++b) {
    const double* row = B_T.col(layout.border[b]).data();
    double* at = f.F + first + b;
    for (const int node : layout.pivots)
      for (int c = 0; c < 3; ++c, at += f.ld) *at = row[3 * node + c];
  }
}

void Factor::add_to_border_compliance(const FrontLayout& root) {
  const double* U = U_.get() + root.U;
  for (size_t j = 0; j < root.border.size(); ++j)
    for (size_t i = j; i < root.border.size(); ++i) {
      double& low = border_compliance_(root.border[i], root.border[j]);
      low -= U[j * root.ldu + i];
      border_compliance_(root.border[j], root.border[i]) = low;
    }
}

size_t Factor::nonzeros() const {
  size_t sum = 0;
  for (const FrontLayout& f : fronts_) {
    const size_t k = f.k, n = 3 * f.rows.size();
    sum += k * (k + 1) / 2 + k * n;
  }
  return sum;
}

double Factor::operations() const {
  double sum = 0;
  for (const FrontLayout& f : fronts_)
    for (int j = 0; j < f.k; ++j) {
      const double length = f.k - j + 3.0 * static_cast<double>(f.rows.size());
      sum += length * length;
    }
  return sum;
}

}  // namespace tendril::fem
