#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "hal/bus/bus.h"
#include "hal/bus/frame_batch.h"
#include "hal/drive/drives.h"
#include "rt/controller.h"
#include "rt/histogram.h"
#include "rt/page_faults.h"
#include "rt/periodic_clock.h"
#include "rt/spsc_ring.h"
#include "rt/thread.h"
#include "rt/trace_record.h"
#include "rt/triple_buffer.h"

namespace tendril::rt {

using TraceRing = SpscRing<TraceRecord, 4096>;

/// Flags by which other threads reach the control thread.
struct Requests {
  std::atomic<bool> stop{false};          ///< end the run
  std::atomic<bool> model_failed{false};  ///< the model thread has given up
};

/// What the control thread tells of itself beside the trace, which nobody may be reading.
struct Progress {
  std::atomic<bool> ended{false};  ///< run() is about to return
};

/// What the control thread counted over a run.
struct LoopCounts {
  std::int64_t cycles = 0;       ///< deadlines that passed, missed ones included
  std::int64_t late_cycles = 0;  ///< of these, deadlines missed because a cycle ended after them
  std::int64_t heap_calls = 0;   ///< -1 where they cannot be counted (sanitizers)
  PageFaults page_faults;
  Scheduling scheduling;
  Histogram wakeup;  ///< from intended to actual wake-up, missed ones included
  Histogram cycle;   ///< from actual wake-up to the end of the work

  /// Share of the deadlines that were met; 1 before the first.
  double success_rate() const noexcept {
    return cycles == 0 ? 1 : 1 - static_cast<double>(late_cycles) / static_cast<double>(cycles);
  }
};

/// The control loop: reads the bus, lets the controller decide, writes the bus. The only caller of the bus
/// and, in run(), of the clock.
class ControlLoop {
 public:
  /// Keeps references to everything.
  ControlLoop(hal::Bus& bus, hal::DriveMaster& drives, Controller& controller,
              TripleBuffer<Snapshot>& snapshots, TripleBuffer<Target>& targets,
              TripleBuffer<Feedback>& feedback, const Requests& requests);

  /// One cycle; in virtual time the whole of the loop.
  /// @param intended_ns    the instant that the controller decides for
  /// @param woken_ns       the instant of the call
  /// @param late_in_a_row  cycles before this one that ended late, in a row
  /// @return  valid until the next call; its timing fields are the caller's to fill
  /// Real-time: bounded by the QP's cap and hal::kMaxWaiting; allocates nothing, takes no lock but the
  /// kernel's in the system calls of the bus. On CAN such a call may also work off what other devices have
  /// left to this CPU (softirqs): keep their interrupts elsewhere.
  TraceRecord& cycle(std::int64_t intended_ns, std::int64_t woken_ns, int late_in_a_row) noexcept;

  /// The stages of a cycle, each handed what the one before it returned. Whoever times them calls them one by
  /// one, as run() does.
  /// Real-time: as cycle().
  const hal::Measurement& read(std::int64_t woken_ns) noexcept;
  const Decision& solve(const hal::Measurement& measurement, std::int64_t intended_ns, std::int64_t woken_ns,
                        int late_in_a_row) noexcept;
  TraceRecord& write(const hal::Measurement& measurement, const Decision& decision, std::int64_t intended_ns,
                     std::int64_t woken_ns) noexcept;

  /// Cycles on the clock's grid until the run has stopped, tracing every one.
  /// @param counts  filled by the time it returns
  /// Real-time: the control thread itself.
  void run(PeriodicClock& clock, TraceRing& trace, LoopCounts& counts, Progress& progress) noexcept;

 private:
  hal::Bus& bus_;
  hal::DriveMaster& drives_;
  Controller& controller_;
  TripleBuffer<Snapshot>& snapshots_;
  TripleBuffer<Target>& targets_;
  TripleBuffer<Feedback>& feedback_;
  const Requests& requests_;
  const Snapshot* snapshot_ = nullptr;  // this cycle's
  std::array<hal::Frame, hal::kMaxWaiting> arrived_;
  hal::FrameBatch frames_;
  TraceRecord record_;
};

}  // namespace tendril::rt
