// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "app/config/config.h"
#include "hal/bus/bus.h"
#include "hal/drive/drives.h"
#include "rt/channels.h"
#include "rt/control_loop.h"
#include "rt/controller.h"

namespace tendril::app {

/// A latched fault in a sentence for people; empty where there is none. May be called while another thread
/// runs the loop. Real-time: no (allocates).
std::string describe(const rt::LatchedFault& fault, const Config& config, const hal::DriveMaster& master);

/// The control side of a robot, wired: drives, controller, loop and the channels to the other threads. The
/// same for the daemon, for measurements and in virtual time; they differ in the bus and in who calls the
/// loop.
struct ControlStack {
  /// @param law    limits of the controller
  /// @param drives  master of the drives on that bus
  /// @param bus    kept by reference; no more than kWaitingCycles' frames may wait for it from now on
  /// Real-time: no (allocates).
  ControlStack(const rt::ControllerConfig& law, std::unique_ptr<hal::DriveMaster> drives, hal::Bus& bus);

  /// Why the controller stopped, in a sentence for people; empty where it was asked to, or did not. Not while
  /// another thread runs the loop.
  /// @param config  of the robot
  /// Real-time: no (allocates).
  std::string stop_reason(const Config& config) const;

  std::unique_ptr<hal::DriveMaster> master;
  rt::Controller controller;
  std::unique_ptr<rt::Channels> channels;
  rt::ControlLoop loop;
};

}  // namespace tendril::app
