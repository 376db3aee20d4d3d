// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "app/config/config.h"
#include "app/robot/motion.h"
#include "app/robot/motion_profile.h"
#include "rt/channels.h"
#include "rt/target.h"

namespace tendril::app {

/// What the effectors shall do from moment to moment: follow the path of the robot file, go where an operator
/// wants them, or stay. Whatever is asked begins where the effectors are wanted at that moment, so the target
/// never jumps. Where the robot file limits acceleration and jerk, the target keeps to them, but in aim(),
/// whose caller has a plan of its own. Real-time: no, for all of it (allocates).
class TargetSource {
 public:
  enum class Mode {
    kNone,    ///< nothing is wanted yet; the robot stays where it was enabled
    kPath,    ///< the path of the robot file
    kPaused,  ///< on that path, time stands still
    kTarget,  ///< on the way to a target, or there
    kHold,    ///< stays where it was when it was told to
  };

  /// Keeps a reference to the configuration.
  /// @param rest  where the coordinates of other effectors than the path's stay, e, m or m³
  TargetSource(const Config& config, rt::EffectorVector rest);

  /// The drives follow commands from now on. At first, where the robot file has a path, it begins; after
  /// end(), the robot stays where it is.
  void begin(const rt::RunStart& start);
  /// The drives follow no longer: nothing is wanted until begin().
  void end();
  bool begun() const { return begun_; }

  /// The straight piece of the way that is valid now; none in mode kNone.
  std::optional<rt::Target> at(int64_t now_ns) const;

  /// Where the effectors are wanted, e, m or m³; where they were at the start while nothing is wanted.
  rt::EffectorVector wanted(int64_t now_ns) const;

  /// Goes straight to a goal, then on at a velocity until the age limit of targets has passed, unless another
  /// target comes; then stays. So a stream of targets that come late or are lost still moves smoothly.
  /// @param goal         e, m or m³
  /// @param duration_ns  until it is reached, >= 0
  /// @param velocity     beyond the goal, e, m/s or m³/s
  void aim(int64_t now_ns, const rt::EffectorVector& goal, int64_t duration_ns,
           const rt::EffectorVector& velocity);

  /// Goes straight to a goal at a speed and stays; within the limits of the file, from rest to rest: a target
  /// on its way comes to rest first.
  /// @param speed  m/s
  void go(int64_t now_ns, const rt::EffectorVector& goal, double speed);

  void hold(int64_t now_ns);

  /// Begins the path of the robot file, which there must be, anew.
  void follow_path(int64_t now_ns);
  void pause(int64_t now_ns);   ///< in mode kPath; else as hold()
  void resume(int64_t now_ns);  ///< in mode kPaused; else nothing
  /// How fast time passes on the path, 0 to 1 of what the robot file says, from now on.
  void set_path_rate(int64_t now_ns, double rate);

  Mode mode() const { return mode_; }
  double path_rate() const { return path_rate_; }

  /// The path as the robot file has it, since begin(); nullptr once an operator has asked for anything else.
  const Motion* undisturbed_path() const { return undisturbed_ && path_ ? &*path_ : nullptr; }

 private:
  void stay(int64_t now_ns);
  /// The time of the path at an instant.
  struct PathClock {
    int64_t path_ns;
    double rate, change;  // s/s, 1/s
  };

  PathClock path_clock(int64_t now_ns) const;
  rt::Target path_target(int64_t now_ns) const;
  void set_path_clock(int64_t now_ns, double rate);
  /// From the motion at an instant to rest.
  MotionProfile coming_to_rest(int64_t now_ns) const;
  double distance(const rt::EffectorVector& a, const rt::EffectorVector& b) const;

  const Config& config_;
  std::optional<MotionLimits> limits_;
  rt::EffectorVector positions_;  // 1 for coordinates that are positions, 0 for volumes
  rt::EffectorVector rest_;
  rt::EffectorVector start_;  // where the model put the effectors at the start
  bool begun_ = false, again_ = false, undisturbed_ = true;
  Mode mode_ = Mode::kNone;

  std::optional<Motion> path_;
  double path_rate_ = 1;                // asked for
  double clock_rate_ = 1;               // of path time: path_rate_, or 0
  int64_t clock_ns_ = 0, path_ns_ = 0;  // path time at an instant
  std::optional<MotionProfile> clock_;  // within limits: path time since then, s, while its rate changes

  rt::Target to_goal_, beyond_;           // in modes kTarget and kHold, but
  std::optional<MotionProfile> profile_;  // within limits, from profile_ns_ on
  int64_t profile_ns_ = 0;
};

/// "none", "path", "paused", "target", "hold".
const char* name(TargetSource::Mode mode);

}  // namespace tendril::app
