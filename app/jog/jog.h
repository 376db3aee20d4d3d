#pragma once

#include <cstdint>

#include "hal/drive/drives.h"

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
class Jog {
 public:
  enum class Phase : std::uint8_t { kConnecting, kEnabling, kMoving, kSettling, kDisabling, kDone };
  enum class Ending : std::uint8_t {
    kArrived,
    kStopped,    ///< as asked
    kBeyond,     ///< the goal lies outside the limits; the drive was never enabled
    kStrayed,    ///< the axis was too far from its command
    kDriveFault  ///< see drive_fault()
  };

  explicit Jog(const JogConfig& config);

  /// One cycle.
  /// @param measurement  of a master of this one axis
  /// @param stop         come to a halt and end
  /// Real-time: yes (bounded, no allocation).
  const hal::Command& step(const hal::Measurement& measurement, bool stop) noexcept;

  Phase phase() const noexcept { return phase_; }
  Ending ending() const noexcept { return ending_; }  ///< once kDisabling
  double start() const noexcept { return start_; }    ///< displacement before the motion, once enabling
  double commanded() const noexcept { return command_.position[0]; }
  const hal::DriveFault& drive_fault() const noexcept { return fault_; }

 private:
  void connect(const hal::Measurement& measurement) noexcept;
  void move(bool stop) noexcept;
  void end(Ending ending) noexcept;
  void enter(Phase phase) noexcept;
  bool out_of_hand(const hal::Measurement& measurement) const noexcept;

  JogConfig config_;
  Phase phase_ = Phase::kConnecting;
  Ending ending_ = Ending::kArrived;
  hal::Command command_;
  hal::DriveFault fault_;
  double start_ = 0, goal_ = 0, speed_ = 0;
  std::int64_t cycles_ = 0;  // in this phase
};

}  // namespace tendril::app
