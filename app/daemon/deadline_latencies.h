// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/histogram.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// Calls for the latency of the wake-up at every deadline of a cycle, s, as rt::CycleLog counts them: of the
/// cycle itself, and of the deadlines that passed while it was at work, each as if a cycle had begun there
/// when this one ended. Real-time: no.
template <class Function>
void for_each_latency(const rt::TraceRecord& record, double period_s, Function&& function) {
  function(1e-9 * static_cast<double>(record.wakeup_ns));
  if (record.missed == 0) return;
  double overdue_s = 1e-9 * static_cast<double>(record.wakeup_ns + record.cycle_ns) - period_s;
  for (int step = 0; step <= rt::Histogram::kMissedCap && overdue_s > 0; ++step, overdue_s -= period_s)
    function(overdue_s);
}

}  // namespace tendril::app
