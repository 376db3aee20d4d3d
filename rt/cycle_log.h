// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "rt/heap_guard.h"
#include "rt/histogram.h"
#include "rt/page_faults.h"
#include "rt/periodic_clock.h"
#include "rt/thread.h"
#include "rt/trace_record.h"

namespace tendril::rt {

/// What the control thread counted over a run.
struct LoopCounts {
  int64_t cycles = 0;       ///< deadlines that passed, missed ones included
  int64_t late_cycles = 0;  ///< of these, deadlines missed because a cycle ended after them
  int64_t heap_calls = 0;   ///< -1 where they cannot be counted (sanitizers)
  PageFaults page_faults;
  Scheduling scheduling;
  Histogram wakeup;  ///< from intended to actual wake-up, missed ones included
  Histogram cycle;   ///< from actual wake-up to the end of the work

  /// Share of the deadlines that were met; 1 before the first.
  double success_rate() const noexcept {
    return cycles == 0 ? 1 : 1 - static_cast<double>(late_cycles) / static_cast<double>(cycles);
  }
};

/// How a cycle began.
struct CycleStart {
  int64_t intended_ns = 0;  ///< the instant that the cycle decides for: its deadline on the grid
  int64_t woken_ns = 0;     ///< when it began
  int late_in_a_row = 0;    ///< cycles before this one that ended late, in a row
};

/// The bookkeeping of a control loop: how long the stages of each cycle took, which deadlines it missed, and
/// the counts of the run. Its functions are called in the order of a cycle, by the control thread alone.
class CycleLog {
 public:
  /// Keeps references. Real-time: yes (system calls that take no lock but this thread's own).
  CycleLog(PeriodicClock& clock, LoopCounts& counts) noexcept;

  /// Sleeps until the next deadline. Real-time: sleeps, takes no lock.
  const CycleStart& wait() noexcept;
  /// Reading, then solving has ended. Real-time: wait-free.
  void end_of_read() noexcept { read_ns_ = now_ns(); }
  void end_of_solve() noexcept { solved_ns_ = now_ns(); }
  /// The cycle has ended: fills the fields of its record that tell times and counts, and skips the deadlines
  /// that have passed. Real-time: bounded by Histogram::kMissedCap; takes no lock but this thread's own.
  void end_of_cycle(TraceRecord& record) noexcept;

  /// The run has ended. Real-time: as end_of_cycle.
  void end_of_run() noexcept;

 private:
  PeriodicClock& clock_;
  LoopCounts& counts_;
  HeapGuard heap_;
  PageFaultCounter page_faults_;
  CycleStart start_;
  int64_t read_ns_ = 0, solved_ns_ = 0;
};

}  // namespace tendril::rt
