// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/bus/frame_batch.h"

namespace tendril::hal {

/// State of a drive's power stage, for all protocols alike.
enum class PowerStage : uint8_t {
  kOff,
  kOn,    // holds or moves its actuator
  kFault  // off, and stays so until the fault is cleared
};

/// The drive's side of a protocol, for one axis of a simulated robot.
class SimulatedDrive {
 public:
  virtual ~SimulatedDrive() = default;

  /// Processes a frame at an instant and appends the answers; frames for other nodes are ignored.
  /// @param now_ns  never before an earlier call's
  /// Real-time: yes (bounded, no allocation).
  virtual void receive(const Frame& frame, int64_t now_ns, FrameBatch& out) noexcept = 0;

  /// Lets time pass up to `now_ns`: motion, heartbeats, time-outs.
  /// Real-time: yes (bounded, no allocation).
  virtual void advance(int64_t now_ns, FrameBatch& out) noexcept = 0;

  /// Displacement of its actuator, m or m³. Real-time: yes.
  virtual double displacement() const noexcept = 0;

  /// Sets the load from the body. A load above the force limit drives the drive backwards.
  /// @param effort  of the actuator, N or Pa
  /// Real-time: yes.
  virtual void set_load(double effort) noexcept = 0;

  /// Real-time: yes.
  virtual PowerStage power_stage() const noexcept = 0;

  /// Makes the drive fail by the next `advance` with the error of a hot power stage. Real-time: yes.
  virtual void overheat() noexcept = 0;

  /// Makes the drive fail by the next `advance`.
  /// @param code  not 0; EMCY error code with CiA 402 (the low 16 bits), error bits of the axis with ODrive
  /// Real-time: yes.
  virtual void inject_fault(uint32_t code) noexcept = 0;

  /// Jams its mechanics or releases them. While jammed the position stays, and only the following-error
  /// window can detect it. Real-time: yes.
  virtual void set_jammed(bool jammed) noexcept = 0;

  /// Suppresses its heartbeats, or sends them again; all else goes on. Real-time: yes.
  virtual void set_silent(bool silent) noexcept = 0;

 protected:
  SimulatedDrive() = default;
  SimulatedDrive(const SimulatedDrive&) = delete;
  SimulatedDrive& operator=(const SimulatedDrive&) = delete;
};

}  // namespace tendril::hal
