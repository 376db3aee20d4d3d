#include "rt/control_loop.h"

#include <span>

#include "hal/bus/bus_budget.h"
#include "rt/heap_guard.h"

namespace tendril::rt {
namespace {

int bits_of(std::span<const hal::Frame> frames) noexcept {
  int bits = 0;
  for (const hal::Frame& frame : frames) bits += hal::worst_case_bits(frame.length, frame.extended);
  return bits;
}

void fill(TraceRecord& record, std::int64_t now_ns, const hal::Measurement& measurement,
          const Snapshot* snapshot, const Decision& decision) noexcept {
  record.intended_ns = now_ns;
  record.phase = decision.phase;
  record.faults = decision.faults;
  record.qp_solved = decision.qp_solved;
  record.qp_status = decision.qp_status;
  record.qp_iterations = decision.qp_iterations;
  record.snapshot_sequence = snapshot ? snapshot->sequence : 0;
  record.snapshot_age_ns = decision.snapshot_age_ns;
  record.sensors = measurement.sensors;
  for (Eigen::Index a = 0; a < decision.lambda.size(); ++a) {
    record.command[a] = decision.command.position[a];
    record.measured[a] = measurement.position[a];
    record.lambda[a] = decision.lambda[a];
  }
  for (Eigen::Index e = 0; e < decision.desired.size(); ++e) {
    record.desired[e] = decision.desired[e];
    record.p_e[e] = decision.p_e[e];
  }
}

void fill(Feedback& feedback, std::int64_t now_ns, const hal::Measurement& measurement,
          const Decision& decision) noexcept {
  feedback.stamp_ns = now_ns;
  feedback.displacements_known = measurement.all_known;
  feedback.efforts_known = decision.lambda_acts;
  feedback.lambda = decision.lambda;
  feedback.delta_a.resize(decision.lambda.size());
  for (Eigen::Index a = 0; a < decision.lambda.size(); ++a) feedback.delta_a[a] = measurement.position[a];
}

}  // namespace

ControlLoop::ControlLoop(hal::Bus& bus, hal::DriveMaster& drives, Controller& controller,
                         TripleBuffer<Snapshot>& snapshots, TripleBuffer<Target>& targets,
                         TripleBuffer<Feedback>& feedback, const Requests& requests)
    : bus_(bus),
      drives_(drives),
      controller_(controller),
      snapshots_(snapshots),
      targets_(targets),
      feedback_(feedback),
      requests_(requests) {}

const hal::Measurement& ControlLoop::read(std::int64_t woken_ns) noexcept {
  const int count = bus_.receive(arrived_);
  for (int k = 0; k < count; ++k) drives_.receive(arrived_[k], arrived_[k].stamp_ns);
  record_.bus_bits = bits_of(std::span(arrived_).first(count));
  return drives_.measure(bus_.health(), woken_ns);
}

const Decision& ControlLoop::solve(const hal::Measurement& measurement, std::int64_t intended_ns,
                                   std::int64_t woken_ns, int late_in_a_row) noexcept {
  snapshot_ = snapshots_.has_value() ? &snapshots_.latest() : nullptr;
  const Target* target = targets_.has_value() ? &targets_.latest() : nullptr;
  const Cycle cycle{.now_ns = intended_ns,
                    .wakeup_ns = woken_ns - intended_ns,
                    .late_in_a_row = late_in_a_row,
                    .stop_requested = requests_.stop.load(std::memory_order_relaxed),
                    .model_failed = requests_.model_failed.load(std::memory_order_relaxed)};
  return controller_.step(measurement, snapshot_, target, cycle);
}

TraceRecord& ControlLoop::write(const hal::Measurement& measurement, const Decision& decision,
                                std::int64_t intended_ns, std::int64_t woken_ns) noexcept {
  frames_.clear();
  drives_.command(decision.command, woken_ns, frames_);
  // What the queue cannot take is counted by the bus.
  if (bus_.send(frames_) == hal::SendResult::kSent) record_.bus_bits += bits_of(frames_);

  fill(feedback_.back(), intended_ns, measurement, decision);
  feedback_.publish();
  fill(record_, intended_ns, measurement, snapshot_, decision);
  return record_;
}

TraceRecord& ControlLoop::cycle(std::int64_t intended_ns, std::int64_t woken_ns, int late_in_a_row) noexcept {
  const hal::Measurement& measurement = read(woken_ns);
  return write(measurement, solve(measurement, intended_ns, woken_ns, late_in_a_row), intended_ns, woken_ns);
}

void ControlLoop::run(PeriodicClock& clock, TraceRing& trace, LoopCounts& counts,
                      Progress& progress) noexcept {
  counts.scheduling = scheduling_of_this_thread();
  const HeapGuard heap;
  const PageFaultCounter page_faults;
  int late_in_a_row = 0;
  Phase phase = Phase::kConnecting;
  while (phase != Phase::kStopped) {
    const std::int64_t intended_ns = clock.wait();
    const std::int64_t woken_ns = now_ns();
    const hal::Measurement& measurement = read(woken_ns);
    const std::int64_t read_ns = now_ns();
    const Decision& decision = solve(measurement, intended_ns, woken_ns, late_in_a_row);
    const std::int64_t solved_ns = now_ns();
    TraceRecord& record = write(measurement, decision, intended_ns, woken_ns);
    phase = record.phase;

    const std::int64_t ended_ns = now_ns();
    const std::int64_t overdue_ns = ended_ns - clock.next_deadline_ns();
    record.missed = clock.realign(ended_ns);
    if (record.missed > 0) counts.wakeup.record_with_missed(overdue_ns, clock.period_ns());
    late_in_a_row = record.missed > 0 ? late_in_a_row + 1 : 0;
    record.wakeup_ns = woken_ns - intended_ns;
    record.read_ns = read_ns - woken_ns;
    record.solve_ns = solved_ns - read_ns;
    record.cycle_ns = ended_ns - woken_ns;
    record.heap_calls = heap.calls();
    record.page_faults = page_faults.faults().total();
    counts.wakeup.record(record.wakeup_ns);
    counts.cycle.record(record.cycle_ns);
    counts.cycles += 1 + record.missed;
    counts.late_cycles += record.missed;
    record.cycles = counts.cycles;
    record.late_cycles = counts.late_cycles;
    trace.push(record);  // a full ring counts what it drops
  }
  counts.heap_calls = HeapGuard::available() ? heap.calls() : -1;
  counts.page_faults = page_faults.faults();
  progress.ended.store(true, std::memory_order_release);
}

}  // namespace tendril::rt
