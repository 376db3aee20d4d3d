// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "rt/histogram.h"
#include "rt/trace_record.h"

namespace tendril::tools {

/// Latencies of a control loop by stage, without coordinated omission: a deadline that was slept through
/// counts as a wake-up, and as a whole cycle, that came as much too late as the stall left it.
class LatencyStages {
 public:
  static constexpr std::array<const char*, 5> kNames{"wakeup", "read", "solve", "write", "whole"};

  /// @param period_ns  of the loop
  explicit LatencyStages(int64_t period_ns) : period_ns_(period_ns) {}

  /// Adds a cycle. One that did no work, the bare timer's, adds to wakeup and whole alone.
  void add(const rt::TraceRecord& record);

  int64_t cycles() const { return cycles_; }  ///< deadlines, missed ones included
  int64_t late() const { return late_; }      ///< of these, missed because a cycle ended after them

  /// @param name  one of kNames. @throws std::out_of_range where it is not
  const rt::Histogram& stage(const std::string& name) const;

  /// Minimum, percentiles and maximum of each stage that has any, us, one line a stage.
  std::string table() const;

  /// How often which latency occurred in a stage, as bars of logarithmic length.
  std::string plot(const std::string& name) const;

  /// {"wakeup": {"min_us", "p50_us", ..., "max_us", "buckets": [[low_ns, high_ns, count], ...]}, ...}
  nlohmann::ordered_json json() const;

 private:
  int64_t period_ns_;
  int64_t cycles_ = 0, late_ = 0;
  std::array<rt::Histogram, kNames.size()> stages_;
};

}  // namespace tendril::tools
