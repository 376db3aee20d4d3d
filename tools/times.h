// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <numeric>
#include <vector>

#include "rt/periodic_clock.h"

namespace tendril {

/// Times of one thing, ms.
class Times {
 public:
  using Clock = int64_t() noexcept;  // ns
  explicit Times(Clock* clock = rt::now_ns) : clock_(clock) {}

  template <typename Function>
  void measure(Function&& function) {
    const auto begin = clock_();
    function();
    times_.push_back(1e-6 * static_cast<double>(clock_() - begin));
  }
  double min() const { return times_.empty() ? 0 : *std::min_element(times_.begin(), times_.end()); }
  double mean() const {
    return times_.empty()
               ? 0
               : std::accumulate(times_.begin(), times_.end(), 0.0) / static_cast<double>(times_.size());
  }
  double median() const {
    if (times_.empty()) return 0;
    std::vector<double> sorted = times_;
    std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
    return sorted[sorted.size() / 2];
  }
  nlohmann::json json() const { return {{"min", min()}, {"median", median()}}; }

 private:
  Clock* clock_;
  std::vector<double> times_;
};

}  // namespace tendril
