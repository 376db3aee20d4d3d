// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <catch2/catch.hpp>
#include <functional>
#include <string>
#include <vector>

#include "hal/bus/virtual_bus.h"
#include "hal/canopen/canopen.h"
#include "hal/canopen/emergency.h"
#include "hal/cia402/cia402_master.h"
#include "hal/cia402/simulated_cia402_drive.h"
#include "hal/odrive/odrive_master.h"
#include "hal/odrive/simulated_odrive_drive.h"

namespace tendril::hal::test {

inline constexpr int64_t kPeriod_ns = 1'666'667;  // 600 Hz

/// A configuration of `axes` axes with nodes 1, 2, ... and names "cable 0"...
MasterConfig config_of(int axes);

/// The same for ODrive axes, with nodes 0, 1, ...
MasterConfig odrive_config_of(int axes, OdriveFirmware firmware = OdriveFirmware::k0_6);

/// The same with the first `count` axes on efforts, rated 1 Nm, and all kept to a range.
/// @param range  m, either way
MasterConfig on_efforts(MasterConfig config, int count, double range);

/// A camera that tells x, y, z of the tip in 10 µm, and how long ago it saw it in 10 µs.
SensorConfig camera(uint32_t id);

/// The drives of a configuration, each at a place of its own.
void add_drives(const MasterConfig& config, std::vector<SimulatedCia402Drive>& drives);
void add_drives(const MasterConfig& config, std::vector<SimulatedOdriveDrive>& drives);

/// A master and its drives on a virtual bus, with everything they say on record.
template <class Master, class Drive>
struct RigOf {
  /// @param delay_ns  of every frame
  explicit RigOf(const MasterConfig& config, int64_t delay_ns = 0)
      : bus(delay_ns),
        controller(bus.attach("controller")),
        recorder(bus.attach("recorder")),
        master(config) {
    add_drives(config, drives);
    for (size_t i = 0; i < drives.size(); ++i) plugs.push_back(&bus.attach("drive"));
    command.axes = static_cast<int>(config.axes.size());
    traffic.reserve(100'000);
  }

  /// One control period: the master's cycle, then the drives' reaction.
  void cycle() {
    const int64_t now_ns = bus.time_ns();
    Frame frame;
    while (controller.receive(frame))
      if (master_alive) master.receive(frame, frame.stamp_ns);
    if (master_alive) {
      measured = master.measure(controller.health(), now_ns);
      if (follow_measured) command.displacement = measured.displacement;
      batch.clear();
      master.command(command, now_ns, batch);
      for (const Frame& out : batch) controller.send(out);
    }
    bus.set_time(now_ns + kPeriod_ns / 2);
    for (size_t i = 0; i < drives.size(); ++i) {
      FrameBatch answers;
      while (plugs[i]->receive(frame)) drives[i].receive(frame, bus.time_ns(), answers);
      drives[i].advance(bus.time_ns(), answers);
      for (Frame answer : answers)
        if (!tamper || tamper(static_cast<int>(i), answer)) plugs[i]->send(answer);
    }
    while (recorder.receive(frame))
      if (traffic.size() < traffic.capacity()) traffic.push_back(frame);
    bus.set_time(now_ns + kPeriod_ns);
  }

  /// Cycles until `done` or for at most that long. @return whether it was done
  bool run_until(const std::function<bool()>& done, int64_t limit_ns = 5'000'000'000) {
    for (const int64_t end_ns = bus.time_ns() + limit_ns; bus.time_ns() < end_ns;) {
      cycle();
      if (done()) return true;
    }
    return false;
  }

  void run_for(int64_t duration_ns) {
    run_until([] { return false; }, duration_ns);
  }

  /// Whether a fault is latched.
  bool faulted() const { return measured.fault.kind != FaultKind::kNone; }

  /// Runs until a fault is latched and gives it.
  DriveFault fault(int64_t limit_ns = 5'000'000'000) {
    run_until([this] { return faulted(); }, limit_ns);
    return measured.fault;
  }

  /// Enables all drives at their measured positions. @return whether it worked
  bool enable() {
    if (!run_until([this] { return measured.all_known || faulted(); })) return false;
    command.enable = true;
    return run_until([this] { return measured.all_enabled; });
  }

  /// One cycle with a reset. @return whether all drives were enabled after it
  bool reset() {
    command.reset = true;
    cycle();
    command.reset = false;
    return run_until([this] { return measured.all_enabled; });
  }

  /// Index in `traffic` of the first frame at or after `from` with that text, or -1.
  int find(const std::string& text, int from = 0) const {
    for (int i = from; i < static_cast<int>(traffic.size()); ++i)
      if (to_text(traffic[i]) == text) return i;
    return -1;
  }

  VirtualBus bus;
  VirtualEndpoint& controller;
  VirtualEndpoint& recorder;
  std::vector<VirtualEndpoint*> plugs;  // of the drives
  Master master;
  std::vector<Drive> drives;
  Command command;
  Measurement measured;
  bool master_alive = true;
  bool follow_measured = true;                         // the command holds what is measured
  std::function<bool(int axis, Frame& frame)> tamper;  // with what drives send; false drops it
  std::vector<Frame> traffic;
  FrameBatch batch;
};

using Rig = RigOf<Cia402Master, SimulatedCia402Drive>;
using OdriveRig = RigOf<OdriveMaster, SimulatedOdriveDrive>;

/// The same with all drives enabled at their measured positions.
template <class AnyRig>
struct Enabled : AnyRig {
  explicit Enabled(const MasterConfig& config, int64_t delay_ns = 0) : AnyRig(config, delay_ns) {
    REQUIRE(AnyRig::enable());
  }
};

using EnabledRig = Enabled<Rig>;
using EnabledOdriveRig = Enabled<OdriveRig>;

}  // namespace tendril::hal::test
