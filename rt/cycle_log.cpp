// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle_log.h"

namespace tendril::rt {

CycleLog::CycleLog(PeriodicClock& clock, LoopCounts& counts) noexcept : clock_(clock), counts_(counts) {
  counts_.scheduling = scheduling_of_this_thread();
}

const CycleStart& CycleLog::wait() noexcept {
  start_.intended_ns = clock_.wait();
  start_.woken_ns = now_ns();
  return start_;
}

void CycleLog::end_of_cycle(TraceRecord& record) noexcept {
  const int64_t ended_ns = now_ns();
  const int64_t overdue_ns = ended_ns - clock_.next_deadline_ns();
  record.missed = clock_.realign(ended_ns);
  if (record.missed > 0) counts_.wakeup.record_with_missed(overdue_ns, clock_.period_ns());
  start_.late_in_a_row = record.missed > 0 ? start_.late_in_a_row + 1 : 0;

  record.wakeup_ns = start_.woken_ns - start_.intended_ns;
  record.read_ns = read_ns_ - start_.woken_ns;
  record.solve_ns = solved_ns_ - read_ns_;
  record.cycle_ns = ended_ns - start_.woken_ns;
  counts_.wakeup.record(record.wakeup_ns);
  counts_.cycle.record(record.cycle_ns);
  counts_.cycles += 1 + record.missed;
  counts_.late_cycles += record.missed;
  record.cycles = counts_.cycles;
  record.late_cycles = counts_.late_cycles;
  record.heap_calls = heap_.calls();
  record.page_faults = page_faults_.faults().total();
}

void CycleLog::end_of_run() noexcept {
  counts_.heap_calls = HeapGuard::available() ? heap_.calls() : -1;
  counts_.page_faults = page_faults_.faults();
}

}  // namespace tendril::rt
