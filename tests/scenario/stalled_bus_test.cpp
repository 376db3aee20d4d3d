// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <optional>
#include <random>

#include "app/config/master_config.h"
#include "hal/cia402/cia402.h"
#include "hal/cia402/cia402_setup.h"
#include "hal/drive/drive_protocol.h"
#include "hal/drive/supervisor.h"
#include "hal/odrive/odrive.h"
#include "tests/scenario/robot_files.h"

// A bus that takes no frames for a while: what drives hear of it when it works again.

namespace tendril::app::stalled_bus_test {

using rt::Phase;

/// The displacement that a frame commands an enabled drive to take.
std::optional<double> set_point(const hal::MasterConfig& drives, int axis, const hal::Frame& frame) {
  const hal::AxisConfig& a = drives.axes[axis];
  if (drives.protocol->name() == "odrive") {
    const auto input = hal::decode_odrive_input(frame, a.node);
    return input ? std::optional(a.scale.to_displacement(static_cast<double>(input->position)))
                 : std::nullopt;
  }
  constexpr uint16_t kEnableOperation = 0x0F;
  const auto command = hal::decode_drive_command(hal::rpdo_cob_id(a), frame);
  if (!command || (command->controlword & 0x8F) != kEnableOperation) return std::nullopt;
  return a.scale.to_displacement(command->target);
}

/// A robot on its path, and what its drives hear.
struct Running {
  explicit Running(Config of) : config(std::move(of)) {
    REQUIRE(rig.run_until(Phase::kRunning, 3));
    rig.run_for(0.7);
    listen();
    last.clear();
  }

  /// Takes what has come since.
  /// @return  the frames
  int listen() {
    int frames = 0;
    for (hal::Frame frame; ear.receive(frame); ++frames)
      for (int a = 0; a < static_cast<int>(config.actuators.size()); ++a)
        if (const auto heard = set_point(drives, a, frame)) add(a, *heard);
    return frames;
  }

  void add(int axis, double displacement) {
    const auto before = last.find(axis);
    if (before != last.end())
      largest_step = std::max(largest_step, std::abs(displacement - before->second) /
                                                (config.actuators[axis].top_rate / config.control.rate_hz));
    last[axis] = displacement;
  }

  Config config;
  hal::MasterConfig drives = master_config(config);
  VirtualRig rig{config, {}};
  hal::VirtualEndpoint& ear = rig.bus().attach("ear");
  std::map<int, double> last;  // set-point of each axis
  double largest_step = 0;     // between two that a drive hears, of what its top speed allows in a cycle
};

Config robot(const std::string& protocol) {
  return protocol == "odrive" ? testing::with_odrive("finger") : testing::finger();
}

TEST_CASE("After a bus has stalled, drives hear two cycles from before, and no set-point jumps",
          "[scenario]") {
  const std::string protocol = GENERATE("canopen", "odrive");
  // Shorter than a silence that is told, than drives wait for their controller, and longer than both.
  const double stall_s = GENERATE(0.003, 0.02, 0.045, 0.12, 1.0);
  CAPTURE(protocol, stall_s);
  Running run(robot(protocol));
  hal::VirtualEndpoint& plug = run.rig.controller_plug();
  plug.set_stalled(true);
  run.rig.run_for(stall_s);
  run.listen();  // to the drives, which go on alone
  plug.set_stalled(false);
  run.rig.run_for(1e-3 * 0.3);  // the delay of the bus, before the next cycle
  const int stale = run.listen();
  run.rig.run_for(0.2);
  run.listen();
  CAPTURE(stale);
  CHECK(stale > 0);
  CHECK(stale <= hal::kWaitingCycles * hal::frames_in_cycle(2));
  CHECK(run.largest_step < 1.01);
  if (stall_s < 0.05) CHECK(run.rig.phase() == Phase::kRunning);
  if (stall_s < 0.05) CHECK_FALSE(run.rig.controller().latched().present);
  CHECK(testing::within_limits(run.config, run.rig.trace()));
}

TEST_CASE("A bus that takes no frames for longer than positions may be late stops the robot with this reason",
          "[scenario]") {
  const std::string protocol = GENERATE("canopen", "odrive");
  CAPTURE(protocol);
  Running run(robot(protocol));
  run.rig.controller_plug().set_stalled(true);
  REQUIRE(run.rig.run_until(Phase::kStopped, 3));
  CHECK(run.rig.controller().latched().drive.kind == hal::FaultKind::kBusStalled);
  CHECK_THAT(run.rig.stop_reason(), Catch::StartsWith("bus takes no frames"));
  for (int a = 0; a < 2; ++a) CHECK(run.rig.drives().drive(a).power_stage() != hal::PowerStage::kOn);
  CHECK_FALSE(hal::describe_power(run.drives, run.rig.measurement()).empty());
}

}  // namespace tendril::app::stalled_bus_test
