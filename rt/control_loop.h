// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "hal/bus/bus.h"
#include "hal/bus/frame_batch.h"
#include "hal/bus/wire.h"
#include "hal/drive/drives.h"
#include "rt/channels.h"
#include "rt/control_law.h"
#include "rt/cycle_log.h"
#include "rt/periodic_clock.h"

namespace tendril::rt {

/// The control loop: reads the bus, lets the control law decide, writes the bus. The only caller of the bus
/// and, in run(), of the clock.
class ControlLoop {
 public:
  /// Keeps references to everything.
  ControlLoop(hal::Bus& bus, hal::DriveMaster& drives, ControlLaw& law, Channels& channels);

  /// One cycle; in virtual time the whole of the loop.
  /// @return  valid until the next call; its timing fields are the caller's to fill
  /// Real-time: bounded by the QP's cap and hal::kMaxWaiting; allocates nothing, takes no lock but the
  /// kernel's in the system calls of the bus. On CAN such a call may also work off what other devices have
  /// left to this CPU (softirqs): keep their interrupts elsewhere.
  TraceRecord& cycle(const CycleStart& start) noexcept;

  /// The stages of a cycle, each handed what the one before it returned. Whoever times them calls them one by
  /// one, as run() does.
  /// Real-time: as cycle().
  const hal::Measurement& read(const CycleStart& start) noexcept;
  const Decision& solve(const hal::Measurement& measurement, const CycleStart& start) noexcept;
  TraceRecord& write(const hal::Measurement& measurement, const Decision& decision,
                     const CycleStart& start) noexcept;

  /// What was measured last. Not while another thread runs the loop. Real-time: yes.
  const hal::Measurement& measurement() const noexcept { return *measured_; }

  /// Cycles on the clock's grid until the run has stopped, tracing every one.
  /// @param counts  filled by the time it returns
  /// Real-time: the control thread itself.
  void run(PeriodicClock& clock, LoopCounts& counts) noexcept;

 private:
  static const hal::Measurement kNothing;

  hal::Bus& bus_;
  hal::DriveMaster& drives_;
  ControlLaw& law_;
  Channels& channels_;
  const hal::Measurement* measured_ = &kNothing;
  const Snapshot* snapshot_ = nullptr;  // this cycle's
  uint32_t resets_ = 0;                 // passed on
  std::array<hal::Frame, hal::kMaxWaiting> arrived_;
  hal::FrameBatch frames_;
  hal::Wire wire_;
  bool delivered_ = true;  // the last cycle's frames were taken by the bus
  TraceRecord record_;
};

}  // namespace tendril::rt
