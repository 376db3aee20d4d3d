// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace tendril::app {

/// Counts values by bounds, as Prometheus wants a histogram. Real-time: no (made by a constructor that
/// allocates; add() does not).
class ValueHistogram {
 public:
  /// @param bounds  growing; each counts the values up to it, itself included
  explicit ValueHistogram(std::vector<double> bounds)
      : bounds_(std::move(bounds)), counts_(bounds_.size() + 1) {}

  void add(double value) {
    std::size_t k = 0;
    while (k < bounds_.size() && value > bounds_[k]) ++k;
    ++counts_[k];
    sum_ += value;
  }

  const std::vector<double>& bounds() const { return bounds_; }
  const std::vector<uint64_t>& counts() const { return counts_; }  ///< between bounds; the last one above all
  double sum() const { return sum_; }

 private:
  std::vector<double> bounds_;
  std::vector<uint64_t> counts_;
  double sum_ = 0;
};

}  // namespace tendril::app
