// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/run_status.h"

#include <fmt/format.h>

#include <algorithm>

#include "hal/sensor/sensor.h"

namespace tendril::app {
namespace {

/// Of all deadlines so far.
double on_time_percent(const rt::TraceRecord& record) {
  const auto deadlines = static_cast<double>(std::max<int64_t>(record.cycles, 1));
  return 100 * (1 - static_cast<double>(record.late_cycles) / deadlines);
}

}  // namespace

RunStatus::RunStatus(const Config& config, int64_t now_ns) : config_(config) { before_.at_ns = now_ns; }

void RunStatus::add(const rt::TraceRecord& record) {
  bus_bits_ += record.bus_bits;
  last_ = record;
}

std::string RunStatus::service_line(int64_t now_ns, uint64_t model_refreshes,
                                    const std::vector<SensorWatch::Losses>& sensors,
                                    const std::string& fault) {
  const Counts now{now_ns, last_.cycles - last_.late_cycles, bus_bits_, model_refreshes};
  const double elapsed_s = 1e-9 * static_cast<double>(now.at_ns - before_.at_ns);
  const auto per_second = [&](auto count) { return static_cast<double>(count) / elapsed_s; };
  std::string line = now.cycles == before_.cycles
                         ? "the control thread stands still"
                         : fmt::format("{}, {:.0f} of {:g} Hz", rt::name(last_.phase),
                                       per_second(now.cycles - before_.cycles), config_.control.rate_hz);
  line += fmt::format(", late {}, on time {:.3f} %, bus {:.0f} %, model {:.0f} Hz", last_.late_cycles,
                      on_time_percent(last_),
                      100 * per_second(now.bus_bits - before_.bus_bits) / config_.bus.bitrate,
                      per_second(now.model_refreshes - before_.model_refreshes));
  if (!fault.empty()) line += "; waits for tendrilctl reset: " + fault;
  for (const rt::FaultRule& rule : rt::kFaultTable)
    if (fault.empty() && last_.faults.has(rule.fault)) line += fmt::format("; {}", rule.words);
  for (std::size_t s = 0; s < sensors.size(); ++s)
    if (sensors[s].lost) line += "; " + hal::describe_loss(config_.sensors[s].frame);
  before_ = now;
  return line;
}

std::string RunStatus::terminal_line(double running_s, std::optional<double> error_mm,
                                     double model_rate_hz) const {
  const std::string error = error_mm ? fmt::format("{:.2f} mm", *error_mm) : "-";
  return fmt::format("{:5.0f} s  {:8}  error {:>8}  model {:5.0f} Hz  late {}", running_s,
                     rt::name(last_.phase), error, model_rate_hz, last_.late_cycles);
}

}  // namespace tendril::app
