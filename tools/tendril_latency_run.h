// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/config/config.h"
#include "rt/thread.h"
#include "tools/tendril_latency_stages.h"

namespace tendril::tools {

struct LatencyOptions {
  double rate_hz = 0;
  double duration_s = 0;        ///< of measuring; 0: until a signal
  int priority = 0;             ///< SCHED_FIFO, of the thread that is measured
  int cpu = -1;                 ///< of that thread; -1: any
  int model_cpu = -1;           ///< of the model thread; -1: any
  int housekeeping_cpu = -1;    ///< of main thread and drives; -1: any
  double model_rate_limit = 0;  ///< Hz; 0: as fast as it can
  std::string bus;              ///< a virtual CAN interface; empty: a local bus of the run's own
  bool allow_non_rt = false;
};

/// What a run tells beside its latencies.
struct LatencyFacts {
  std::string scheduling;
  bool memory_locked = false;
  bool idle_latency_held = false;  ///< whether CPUs were kept from deep sleep
  double seconds = 0;              ///< that were measured
  double model_rate_hz = 0;
  uint64_t trace_dropped = 0;                      ///< cycles that are missing from the latencies
  std::optional<int64_t> heap_calls, page_faults;  ///< of the control thread; nothing where not counted
  std::vector<std::string>
      problems;  ///< each a sentence: why the figures are not those of an undisturbed run
};

/// Called about once a second with the seconds measured so far.
using TellProgress = std::function<void(double seconds)>;

/// Runs a robot's control loop, its model thread, and its simulated drives, and adds each cycle in which the
/// drives follow to the stages. The daemon's limit on late cycles is lifted: they are what is looked for.
/// @throws rt::RtError where real-time rights are missing; app::ConfigError
LatencyFacts run_robot(app::Config config, const LatencyOptions& options, LatencyStages& stages,
                       const TellProgress& tell);

/// Runs the clock of the control loop with no work in it.
/// @throws rt::RtError where real-time rights are missing
LatencyFacts run_timer(const LatencyOptions& options, LatencyStages& stages, const TellProgress& tell);

}  // namespace tendril::tools
