// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/run_log.h"

#include <spdlog/spdlog.h>

#include "app/operation/fault_advice.h"
#include "app/robot/control_stack.h"
#include "hal/sensor/sensor.h"

namespace tendril::app {
namespace {

constexpr int64_t kFaultInterval_ns = 1'000'000'000;

}  // namespace

RunLog::RunLog(const Config& config, const hal::DriveMaster& master)
    : config_(config), master_(master), identified_(config.actuators.size(), false), sensors_(config) {}

void RunLog::add(const rt::TraceRecord& record) {
  if (record.phase != last_.phase) spdlog::info("phase: {}", rt::name(record.phase));
  if (record.phase == rt::Phase::kStandby && record.latched.present &&
      (last_.phase != rt::Phase::kStandby || !last_.latched.present))
    spdlog::error("stopped, waits for a reset: {}. {}", describe(record.latched, config_, master_),
                  advice(record.latched));
  if (record.faults.bits() != last_.faults.bits()) log_faults(record.faults, record.intended_ns);
  for (const SensorWatch::Change& change : sensors_.add(record)) log_sensor(change);
  // A real-time thread must do neither: each may wait for the kernel's locks or for a disk.
  if (record.page_faults != last_.page_faults || record.heap_calls != last_.heap_calls) new_stalls_ = true;
  last_ = record;
}

void RunLog::log_identities() {
  for (std::size_t i = 0; i < identified_.size(); ++i) {
    if (identified_[i]) continue;
    const std::string identity = master_.identity(static_cast<int>(i));
    if (identity.empty()) continue;
    identified_[i] = true;
    spdlog::info("{}", identity);
  }
}

void RunLog::log_stalls() {
  if (!new_stalls_) return;
  new_stalls_ = false;
  spdlog::warn("the control thread has taken {} page faults and made {} heap calls; there should be none",
               last_.page_faults, last_.heap_calls);
}

void RunLog::log_faults(rt::FaultSet faults, int64_t now_ns) {
  if (now_ns < faults_due_ns_) return;
  faults_due_ns_ = now_ns + kFaultInterval_ns;
  for (const rt::FaultRule& rule : rt::kFaultTable)
    if (faults.has(rule.fault)) spdlog::warn("{}", rule.words);
  if (faults.bits() == 0) spdlog::info("no fault any more");
}

void RunLog::log_sensor(const SensorWatch::Change& change) {
  const hal::SensorConfig& sensor = config_.sensors[change.sensor].frame;
  if (change.lost)
    spdlog::warn("{}", hal::describe_loss(sensor));
  else
    spdlog::info("sensor '{}' is back after {:.3g} s", sensor.name, change.stale_s);
}

}  // namespace tendril::app
