// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/drive/drives.h"
#include "qp/solver.h"
#include "rt/faults.h"
#include "rt/snapshot.h"
#include "rt/target.h"

namespace tendril::rt {

/// Where a run stands. Each phase leads to the next, or on to one of the last four; kStandby leads back to
/// kConnecting.
enum class Phase : uint8_t {
  kConnecting,  ///< until every drive has told its position, and every required sensor is fresh
  kModelling,   ///< until the model rests at the measured lengths and has published a snapshot
  kEnabling,    ///< until every drive follows its command; they hold where they are
  kRunning,
  kStopping,   ///< the ramp of StopAction
  kStandby,    ///< drives without torque, but watched; until there is no fault and they are wanted
  kDisabling,  ///< until no drive holds torque and all are told the end
  kStopped,
};

/// "connect", "model", "enable", "run", "stop", "standby", "disable", "stopped". Real-time: wait-free.
const char* name(Phase phase) noexcept;

/// What one cycle is told beside measurement, snapshot and target.
struct CycleInput {
  int64_t now_ns = 0;     ///< the instant the cycle is for: its intended wake-up
  int64_t wakeup_ns = 0;  ///< how much later it began: by so much snapshot and target are older
  /// Cycles before this one that ended late, in a row. A long stall is one cycle: it is left to the drives,
  /// which watch our heartbeat.
  int late_in_a_row = 0;
  /// The bus did not take all frames of the cycle before: drives may not know its command, and what follows
  /// must go on from the last one that they know.
  bool undelivered = false;
  bool stop_requested = false;     ///< the operator wants the run to end
  bool standby_requested = false;  ///< the operator wants the drives without torque
  bool reset_requested = false;    ///< in this cycle the operator takes note of the fault and wants to go on
  bool model_failed = false;       ///< the model thread has given up
};

/// The fault that has stopped the robot. The first one is kept: later ones are mostly its consequence.
struct LatchedFault {
  bool present = false;
  Fault fault = Fault::kDrives;
  hal::DriveFault drive;  ///< where it is kDrives
  int lost_sensor = -1;   ///< index, where it is kSensorLost
  int64_t since_ns = 0;   ///< the cycle it was found in
};

/// What one cycle came to.
struct Decision {
  Phase phase = Phase::kConnecting;
  hal::Command command;         ///< to the drives
  FaultSet faults;              ///< present in this cycle
  LatchedFault latched;         ///< until it is reset
  ActuatorVector lambda;        ///< efforts the command stands for, m, N or Pa
  bool efforts_active = false;  ///< drives may exert lambda already, so that the model is to follow it
  EffectorVector desired;       ///< target served, e, m or m³
  EffectorVector p_e;  ///< where the model, corrected by sensors, puts the effectors under lambda, e, m or m³
  EffectorVector correction;  ///< of p_e by sensors, e, m or m³; empty: there is none
  bool qp_solved = false;     ///< whether a QP was posed in this cycle
  qp::Status qp_status = qp::Status::kOptimal;
  int qp_iterations = 0;
  int64_t snapshot_age_ns = 0;
};

/// What decides in each cycle of the control loop: from what is measured, known and wanted to what the drives
/// shall do.
class ControlLaw {
 public:
  virtual ~ControlLaw() = default;

  /// One cycle.
  /// @param snapshot  nullptr until there is one
  /// @param target    nullptr until there is one
  /// @return  valid until the next call; phase kStopped ends the run
  /// Real-time: bounded; allocates nothing, takes no lock.
  virtual const Decision& step(const hal::Measurement& measurement, const Snapshot* snapshot,
                               const Target* target, const CycleInput& cycle) noexcept = 0;
};

}  // namespace tendril::rt
