#pragma once

#include "rt/control_loop.h"
#include "rt/snapshot.h"
#include "rt/spsc_ring.h"
#include "rt/target.h"
#include "rt/trace_record.h"
#include "rt/triple_buffer.h"

namespace tendril::app {

/// Everything that passes between the threads of the daemon. Each channel has one writer and one reader;
/// feedback is the only one that runs back.
struct Channels {
  rt::TripleBuffer<rt::Snapshot> snapshots;  ///< model thread ▶ control thread, latest
  rt::TripleBuffer<rt::Target> targets;      ///< main thread ▶ control thread, latest
  rt::TripleBuffer<rt::Feedback> feedback;   ///< control thread ▶ model thread, latest
  rt::TraceRing trace;                       ///< control thread ▶ main thread, every one
  rt::Requests requests;                     ///< main and model thread ▶ control thread
  rt::Progress progress;                     ///< control thread ▶ main thread
};

}  // namespace tendril::app
