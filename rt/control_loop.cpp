// SPDX-License-Identifier: Apache-2.0
#include "rt/control_loop.h"

#include <span>
#include <utility>

namespace tendril::rt {
namespace {

int bits_of(hal::Wire wire, std::span<const hal::Frame> frames) noexcept {
  int bits = 0;
  for (const hal::Frame& frame : frames) bits += hal::worst_case_bits(wire, frame.length, frame.extended);
  return bits;
}

void fill(TraceRecord& record, int64_t now_ns, const hal::Measurement& measurement, const Snapshot* snapshot,
          const Decision& decision) noexcept {
  record.intended_ns = now_ns;
  record.phase = decision.phase;
  record.faults = decision.faults;
  record.latched = decision.latched;
  record.power = measurement.power;
  record.qp_solved = decision.qp_solved;
  record.qp_status = decision.qp_status;
  record.qp_iterations = decision.qp_iterations;
  record.snapshot_sequence = snapshot ? snapshot->sequence : 0;
  record.snapshot_age_ns = decision.snapshot_age_ns;
  record.sensors = measurement.sensors;
  for (Eigen::Index a = 0; a < decision.lambda.size(); ++a) {
    record.command[a] = decision.command.displacement[a];
    record.measured[a] = measurement.displacement[a];
    record.lambda[a] = decision.lambda[a];
  }
  for (Eigen::Index e = 0; e < decision.desired.size(); ++e) {
    record.desired[e] = decision.desired[e];
    record.p_e[e] = decision.p_e[e];
  }
  for (Eigen::Index e = 0; e < decision.correction.size(); ++e) record.correction[e] = decision.correction[e];
}

void fill(Feedback& feedback, int64_t now_ns, const hal::Measurement& measurement,
          const Decision& decision) noexcept {
  feedback.stamp_ns = now_ns;
  feedback.displacements_known = measurement.all_known;
  feedback.efforts_known = decision.efforts_active;
  feedback.lambda = decision.lambda;
  feedback.delta_a.resize(decision.lambda.size());
  for (Eigen::Index a = 0; a < decision.lambda.size(); ++a) feedback.delta_a[a] = measurement.displacement[a];
}

}  // namespace

const hal::Measurement ControlLoop::kNothing{};

ControlLoop::ControlLoop(hal::Bus& bus, hal::DriveMaster& drives, ControlLaw& law, Channels& channels)
    : bus_(bus), drives_(drives), law_(law), channels_(channels), wire_(drives.wire()) {}

const hal::Measurement& ControlLoop::read(const CycleStart& start) noexcept {
  const int count = bus_.receive(arrived_);
  for (int k = 0; k < count; ++k) drives_.receive(arrived_[k], arrived_[k].stamp_ns);
  record_.bus_bits = bits_of(wire_, std::span(arrived_).first(count));
  measured_ = &drives_.measure(bus_.health(), start.woken_ns);
  return *measured_;
}

const Decision& ControlLoop::solve(const hal::Measurement& measurement, const CycleStart& start) noexcept {
  snapshot_ = channels_.snapshots.has_value() ? &channels_.snapshots.latest() : nullptr;
  const Target* target = channels_.targets.has_value() ? &channels_.targets.latest() : nullptr;
  const uint32_t resets = channels_.requests.resets.load(std::memory_order_relaxed);
  return law_.step(measurement, snapshot_, target,
                   {.now_ns = start.intended_ns,
                    .wakeup_ns = start.woken_ns - start.intended_ns,
                    .late_in_a_row = start.late_in_a_row,
                    .undelivered = !delivered_,
                    .stop_requested = channels_.requests.stop.load(std::memory_order_relaxed),
                    .standby_requested = channels_.requests.standby.load(std::memory_order_relaxed),
                    .reset_requested = std::exchange(resets_, resets) != resets,
                    .model_failed = channels_.requests.model_failed.load(std::memory_order_relaxed)});
}

TraceRecord& ControlLoop::write(const hal::Measurement& measurement, const Decision& decision,
                                const CycleStart& start) noexcept {
  frames_.clear();
  drives_.command(decision.command, start.woken_ns, frames_);
  // What the queue cannot take is dropped and counted by the bus: a set-point that is late is worth less than
  // none.
  delivered_ = bus_.send(frames_) == hal::SendResult::kSent;
  if (delivered_) record_.bus_bits += bits_of(wire_, frames_);

  fill(channels_.feedback.back(), start.intended_ns, measurement, decision);
  channels_.feedback.publish();
  if (decision.phase == Phase::kRunning && record_.phase != Phase::kRunning) {
    channels_.run_starts.back() = {start.intended_ns, decision.p_e};
    channels_.run_starts.publish();
  }
  channels_.progress.phase.store(decision.phase, std::memory_order_release);
  fill(record_, start.intended_ns, measurement, snapshot_, decision);
  return record_;
}

TraceRecord& ControlLoop::cycle(const CycleStart& start) noexcept {
  const hal::Measurement& measurement = read(start);
  return write(measurement, solve(measurement, start), start);
}

void ControlLoop::run(PeriodicClock& clock, LoopCounts& counts) noexcept {
  CycleLog log(clock, counts);
  do {
    const CycleStart& start = log.wait();
    const hal::Measurement& measurement = read(start);
    log.end_of_read();
    const Decision& decision = solve(measurement, start);
    log.end_of_solve();
    log.end_of_cycle(write(measurement, decision, start));
    channels_.trace.push(record_);  // a full ring counts what it drops
  } while (record_.phase != Phase::kStopped);
  log.end_of_run();
  channels_.progress.ended.store(true, std::memory_order_release);
}

}  // namespace tendril::rt
