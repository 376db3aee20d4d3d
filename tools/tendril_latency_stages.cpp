// SPDX-License-Identifier: Apache-2.0
#include "tools/tendril_latency_stages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

namespace tendril::tools {
namespace {

constexpr std::array kPercentiles{50.0, 99.0, 99.9, 99.99};
constexpr int kBarLength = 48;

enum Stage { kWakeup, kRead, kSolve, kWrite, kWhole };

double us(int64_t ns) { return 1e-3 * static_cast<double>(ns); }

/// The row of a plot that a latency belongs to: three rows a decade, from 1, 2 and 5.
int row_of(int64_t ns) {
  const double decade = std::floor(std::log10(static_cast<double>(std::max<int64_t>(1, ns))));
  const double lead = static_cast<double>(ns) / std::pow(10, decade);
  return 3 * static_cast<int>(decade) + (lead >= 5 ? 2 : lead >= 2 ? 1 : 0);
}

double row_begin_us(int row) { return 1e-3 * std::pow(10, row / 3) * std::array{1, 2, 5}[row % 3]; }

template <typename Function>
void for_each_bucket(const rt::Histogram& histogram, Function&& function) {
  for (int i = 0; i < rt::Histogram::kBuckets; ++i)
    if (const auto bucket = histogram.bucket(i); bucket.count > 0) function(bucket);
}

}  // namespace

void LatencyStages::add(const rt::TraceRecord& record) {
  const int64_t whole_ns = record.wakeup_ns + record.cycle_ns;
  stages_[kWakeup].record(record.wakeup_ns);
  stages_[kWhole].record(whole_ns);
  if (record.cycle_ns > 0) {
    stages_[kRead].record(record.read_ns);
    stages_[kSolve].record(record.solve_ns);
    stages_[kWrite].record(record.cycle_ns - record.read_ns - record.solve_ns);
  }
  if (record.missed > 0)
    for (const Stage stage : {kWakeup, kWhole})
      stages_[stage].record_with_missed(whole_ns - period_ns_, period_ns_);
  cycles_ += 1 + record.missed;
  late_ += record.missed;
}

const rt::Histogram& LatencyStages::stage(const std::string& name) const {
  const auto found = std::ranges::find(kNames, name);
  if (found == kNames.end()) throw std::out_of_range("there is no stage " + name);
  return stages_[static_cast<std::size_t>(found - kNames.begin())];
}

std::string LatencyStages::table() const {
  std::string text = fmt::format("{:<8}{:>10}", "us", "min");
  for (const double p : kPercentiles) text += fmt::format("{:>10}", fmt::format("{}%", p));
  text += fmt::format("{:>10}\n", "max");
  for (std::size_t k = 0; k < stages_.size(); ++k) {
    if (stages_[k].count() == 0) continue;
    text += fmt::format("{:<8}{:>10.1f}", kNames[k], us(stages_[k].min_ns()));
    for (const double p : kPercentiles) text += fmt::format("{:>10.1f}", us(stages_[k].percentile_ns(p)));
    text += fmt::format("{:>10.1f}\n", us(stages_[k].max_ns()));
  }
  return text + fmt::format("{} cycles, {} late\n", cycles_, late_);
}

std::string LatencyStages::plot(const std::string& name) const {
  const rt::Histogram& histogram = stage(name);
  std::map<int, int64_t> rows;
  for_each_bucket(histogram, [&](const auto& bucket) { rows[row_of(bucket.low_ns)] += bucket.count; });
  std::string text = fmt::format("{}, us\n", name);
  if (rows.empty()) return text;
  for (int row = rows.begin()->first; row <= rows.rbegin()->first; ++row) {
    const int64_t count = rows[row];
    const double share = count == 0 ? 0
                                    : std::log10(1.0 + static_cast<double>(count)) /
                                          std::log10(1.0 + static_cast<double>(histogram.count()));
    text += fmt::format("{:>9g} |{:<{}} {}\n", row_begin_us(row),
                        std::string(static_cast<std::size_t>(std::ceil(share * kBarLength)), '#'), kBarLength,
                        count);
  }
  return text;
}

nlohmann::ordered_json LatencyStages::json() const {
  nlohmann::ordered_json result;
  for (std::size_t k = 0; k < stages_.size(); ++k) {
    if (stages_[k].count() == 0) continue;
    nlohmann::ordered_json stage;
    stage["min_us"] = us(stages_[k].min_ns());
    for (const double p : kPercentiles) stage[fmt::format("p{}_us", p)] = us(stages_[k].percentile_ns(p));
    stage["max_us"] = us(stages_[k].max_ns());
    stage["buckets"] = nlohmann::ordered_json::array();
    for_each_bucket(stages_[k], [&](const auto& bucket) {
      stage["buckets"].push_back({bucket.low_ns, bucket.high_ns, bucket.count});
    });
    result[kNames[k]] = stage;
  }
  return result;
}

}  // namespace tendril::tools
