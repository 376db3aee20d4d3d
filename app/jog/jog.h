// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/drive/drives.h"
#include "rt/control_law.h"

namespace tendril::app {

/// Where one axis shall go, and what it may not do on the way. Displacements in m or m³.
struct JogConfig {
  double distance = 0;             ///< from where the axis stands, signed
  double speed = 0;                ///< > 0, m/s or m³/s
  double least = 0, greatest = 0;  ///< of the displacement
  double lag = 0;                  ///< > 0: farther from its command the axis must not be found
  double period_s = 0;
};

/// Moves one axis by hand, without a model: the first careful motion of a drive that was just wired up. It
/// ramps up, goes on at a constant speed, ramps down, waits for the axis, and lets go of it.
///
/// The axis is disabled at once where it strays from its command or the drive reports a fault.
///
/// Of the phases of a run it uses kRunning for the motion and kStopping for waiting until the axis has
/// arrived behind its command.
class Jog final : public rt::ControlLaw {
 public:
  enum class Ending : uint8_t {
    kArrived,
    kStopped,    ///< as asked
    kBeyond,     ///< the goal lies outside the limits; the drive was never enabled
    kStrayed,    ///< the axis was too far from its command
    kDriveFault  ///< see drive_fault()
  };

  explicit Jog(const JogConfig& config);

  /// @param measurement  of a master of this one axis
  /// @param cycle        stop_requested: come to a halt and end
  /// Snapshot and target are not used. Real-time: bounded; allocates nothing, takes no lock.
  const rt::Decision& step(const hal::Measurement& measurement, const rt::Snapshot* snapshot,
                           const rt::Target* target, const rt::CycleInput& cycle) noexcept override;

  Ending ending() const noexcept { return ending_; }  ///< from phase kDisabling on
  double start() const noexcept { return start_; }    ///< displacement before the motion, once enabling
  double commanded() const noexcept { return decision_.command.displacement[0]; }
  const hal::DriveFault& drive_fault() const noexcept { return fault_; }

 private:
  void connect(const hal::Measurement& measurement) noexcept;
  void resume_delivered(bool undelivered) noexcept;
  void move(bool stop) noexcept;
  void end(Ending ending) noexcept;
  void enter(rt::Phase phase) noexcept;
  bool strays(const hal::Measurement& measurement) const noexcept;

  JogConfig config_;
  rt::Decision decision_;
  Ending ending_ = Ending::kArrived;
  hal::DriveFault fault_;
  double delivered_ = 0;  // the last command that the bus took
  double start_ = 0, goal_ = 0, speed_ = 0;
  int64_t cycles_ = 0;  // in this phase
};

}  // namespace tendril::app
