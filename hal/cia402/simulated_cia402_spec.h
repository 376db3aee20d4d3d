// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hal/cia402/cia402.h"
#include "hal/sim/simulated_servo.h"

namespace tendril::hal {

/// The properties of a simulated CiA 402 drive.
struct SimulatedCia402Spec {
  int node = 1;          // 1..127
  int pdo = 1;           // 1..4: which pair of PDOs it has
  uint32_t rpdo_id = 0;  // COB-IDs with which these are mapped and on at power-on; 0: they are not
  uint32_t tpdo_id = 0;
  double top_speed = 1e6;      // counts/s, > 0
  double position_counts = 0;  // at power-on, from the place that homing makes the zero
  bool incremental = false;    // its encoder counts from power-on until it has been homed
  int referenced_bit = -1;  // of the statusword, 0..15: set while it has a reference; -1: it has no such bit
  ServoTuning tuning{};
  uint32_t error_window = 0xFFFF'FFFF;        // 6065 at power-on, counts; 0xFFFFFFFF: not monitored
  uint32_t rpdo_target = kMapTargetPosition;  // the target in an RPDO that is mapped at power-on
  uint32_t rated_torque_mNm = 1000;           // 6076
  double torque_limit = 2;                    // > 0, in rated torques: the force limit of its SimulatedServo
  bool left_enabled = false;  // at power-on it is as another controller left it: in "operation enabled",
                              // which no NMT command ends, in cyclic synchronous position mode, at its target
  int32_t position_offset = 0;  // 60B0 at power-on, counts
};

}  // namespace tendril::hal
