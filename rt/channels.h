// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "rt/control_law.h"
#include "rt/snapshot.h"
#include "rt/spsc_ring.h"
#include "rt/surface.h"
#include "rt/target.h"
#include "rt/trace_record.h"
#include "rt/triple_buffer.h"

namespace tendril::rt {

using TraceRing = SpscRing<TraceRecord, 4096>;

/// The first cycle in which the drives follow commands, as the path to follow must begin there.
struct RunStart {
  int64_t stamp_ns = 0;  ///< its instant
  EffectorVector p_e;    ///< where the model, corrected by sensors, puts the effectors, e, m or m³
};

/// Flags by which other threads reach the control thread.
struct Requests {
  std::atomic<bool> stop{false};          ///< end the run
  std::atomic<bool> standby{false};       ///< keep the drives without torque
  std::atomic<uint32_t> resets{0};        ///< how often a latched fault was reset
  std::atomic<bool> model_failed{false};  ///< the model thread has given up, until the next reset

  /// Lets a robot that waits after a fault start again. Real-time: no (for the operator's side).
  void reset() noexcept {
    model_failed = false;
    ++resets;
  }
};

/// How far the control thread is.
struct Progress {
  std::atomic<Phase> phase{Phase::kConnecting};  ///< of its last cycle
  std::atomic<bool> ended{false};                ///< the loop is about to return
};

/// Everything that passes between the threads of the daemon. Each channel has one writer and one reader;
/// feedback is the only one that runs back.
struct Channels {
  TripleBuffer<Snapshot> snapshots;   ///< model thread ▶ control thread, latest
  TripleBuffer<Target> targets;       ///< main thread ▶ control thread, latest
  TripleBuffer<Feedback> feedback;    ///< control thread ▶ model thread, latest
  TripleBuffer<RunStart> run_starts;  ///< control thread ▶ main thread, latest
  SurfaceChannel surface;             ///< model thread ▶ main thread, latest, while it is wanted
  TraceRing trace;                    ///< control thread ▶ main thread, every one that finds room
  Requests requests;                  ///< main and model thread ▶ control thread
  Progress progress;                  ///< control thread ▶ main thread
};

}  // namespace tendril::rt
