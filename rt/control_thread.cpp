// SPDX-License-Identifier: Apache-2.0
#include "rt/control_thread.h"

namespace tendril::rt {

ControlThread::ControlThread(const ThreadConfig& config, RtRights rights, double rate_hz, ControlLoop& loop,
                             Channels& channels)
    : channels_(channels),
      counts_(std::make_unique<LoopCounts>()),
      thread_(config, rights, [this, &loop, rate_hz] {
        PeriodicClock clock(rate_hz);
        loop.run(clock, *counts_);
      }) {}

ControlThread::~ControlThread() { channels_.requests.stop = true; }  // the thread is joined next

}  // namespace tendril::rt
