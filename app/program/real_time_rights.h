// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "rt/idle_latency_limit.h"
#include "rt/thread.h"

namespace tendril::app {

/// What a thread that is refused its real-time priority is to do. Real-time: no.
inline rt::RtRights rights_of(bool allow_non_rt) {
  return allow_non_rt ? rt::RtRights::kIgnore : rt::RtRights::kRequire;
}

/// Locks the process's memory, or logs why it runs without.
/// @return  whether it is locked
/// @throws rt::RtError where it is refused and must not be
/// Real-time: no.
bool lock_memory(bool allow_non_rt);

/// Keeps CPUs from deep sleep, or logs why not: cycles are then later, and nothing is wrong with them.
/// @param limit_s  a CPU may take so long to wake
/// @return         nothing where it is refused
/// Real-time: no.
std::unique_ptr<rt::IdleLatencyLimit> limit_idle_latency(double limit_s);

}  // namespace tendril::app
