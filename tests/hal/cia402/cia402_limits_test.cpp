// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>

#include "hal/cia402/cia402_master.h"
#include "hal/cia402/cia402_setup.h"
#include "tests/hal/rig.h"

// What a drive watches by itself, because the master told it to: its soft limits and its following error.

namespace tendril::hal::cia402_limits_test {
using namespace tendril::hal::test;

constexpr int64_t kMillisecond_ns = 1'000'000;
constexpr double kCount = 0.0628 / 65536;  // m, of the rig's axes

MasterConfig limited_config(double min, double max) {
  MasterConfig config = config_of(2);
  for (AxisConfig& axis : config.axes) {
    axis.displacement_min = min;
    axis.displacement_max = max;
  }
  return config;
}

/// What was last written to an object of node 1 or 2.
std::optional<int32_t> written(const Rig& rig, int node, ObjectAddress object) {
  std::optional<int32_t> value;
  for (const Frame& frame : rig.traffic)
    if (const auto request = decode_sdo_request(frame, node);
        request && request->kind == SdoRequest::Kind::kWrite && request->object == object)
      value = static_cast<int32_t>(request->value);
  return value;
}

/// What a drive that refuses limits which cross has at the end, with the limits that it had.
SoftLimits told(SoftLimits has, SoftLimits shall) {
  AxisConfig axis{.name = "cable", .node = 2, .scale = {.counts_per_turn = 1, .displacement_per_turn = 1}};
  axis.displacement_min = shall.min;
  axis.displacement_max = shall.max;
  const MasterConfig config = config_of(1);
  std::vector<SdoStep> steps = following_steps(axis, config);
  std::erase_if(steps, [](const SdoStep& step) { return step.request.object.index != 0x607D; });
  SdoSequence sequence(2, 100, 1);
  sequence.start(steps);
  for (int64_t now_ns = 0; now_ns < 20; ++now_ns) {
    FrameBatch out;
    if (sequence.advance(now_ns, out) != SdoSequence::Status::kRunning) break;
    REQUIRE(out.size() == 1);
    const SdoRequest request = *decode_sdo_request(out[0], 2);
    SdoAnswer answer{.kind = SdoAnswer::Kind::kWritten, .object = request.object};
    if (request.kind == SdoRequest::Kind::kRead) {
      const int32_t value = request.object.sub == 1 ? has.min : has.max;
      answer = {SdoAnswer::Kind::kValue, request.object, 4, static_cast<uint32_t>(value)};
    } else {
      SoftLimits limits = has;
      (request.object.sub == 1 ? limits.min : limits.max) = static_cast<int32_t>(request.value);
      if (limits.min < limits.max)
        has = limits;
      else
        answer = {SdoAnswer::Kind::kAbort, request.object, 0, 0x06090036};
    }
    sequence.receive(answer);
  }
  FrameBatch out;
  CHECK(sequence.advance(21, out) == SdoSequence::Status::kDone);
  return has;
}

TEST_CASE("A drive that compares its soft limits takes new ones, whichever way they are shifted", "[unit]") {
  for (const SoftLimits has : {SoftLimits{INT32_MIN, INT32_MAX}, {-3000, -2000}, {-500, 500}, {2000, 3000}}) {
    const SoftLimits now = told(has, {-1000, 1000});
    CAPTURE(has.min);
    CHECK(now.min == -1000);
    CHECK(now.max == 1000);
  }
}

TEST_CASE("Soft limits are those of the displacement, the right way round on a reversed axis too", "[unit]") {
  EnabledRig rig(limited_config(-3e-3, 5e-3));
  const auto low = static_cast<int32_t>(std::lround(3e-3 / kCount));
  const auto high = static_cast<int32_t>(std::lround(5e-3 / kCount));
  CHECK(written(rig, 1, {0x607D, 1}) == -low);
  CHECK(written(rig, 1, {0x607D, 2}) == high);
  CHECK(written(rig, 2, {0x607D, 1}) == -high);
  CHECK(written(rig, 2, {0x607D, 2}) == low);
  rig.follow_measured = false;
  for (const double beyond : {20e-3, -20e-3}) {
    rig.command.displacement.fill(beyond);
    rig.run_for(100 * kMillisecond_ns);
    for (int i = 0; i < 2; ++i)
      CHECK(rig.measured.displacement[i] == Approx(beyond > 0 ? 5e-3 : -3e-3).margin(kCount));
  }
}

TEST_CASE("Soft limits reach to an axis that stands outside, and no farther than needed", "[law]") {
  const SoftLimits limits{-2000, 3000};
  for (const int32_t position : {-2000, -1, 0, 3000}) {
    CHECK(widened(limits, position).min == -2000);
    CHECK(widened(limits, position).max == 3000);
  }
  CHECK(widened(limits, -2001).min == -2052);
  CHECK(widened(limits, -2001).max == 3000);
  CHECK(widened(limits, 9000).min == -2000);
  CHECK(widened(limits, 9000).max == 9051);
  CHECK(widened({INT32_MIN + 10, INT32_MAX - 10}, INT32_MAX).max == INT32_MAX);
  CHECK(widened({INT32_MIN + 10, INT32_MAX - 10}, INT32_MIN).min == INT32_MIN);
}

TEST_CASE("An axis found outside its limits does not jump at enabling, is led back, and limited then",
          "[unit]") {
  Rig rig(limited_config(-0.5e-3, 0.5e-3));  // they stand at 0.96 and -1.92 mm
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  rig.command.enable = true;
  rig.run_for(300 * kMillisecond_ns);
  REQUIRE(rig.measured.all_enabled);
  for (int i = 0; i < 2; ++i) CHECK(rig.drives[i].position() == 1000 * (i + 1));

  rig.follow_measured = false;
  rig.command.displacement.fill(0.2e-3);
  rig.run_for(100 * kMillisecond_ns);
  for (int i = 0; i < 2; ++i) CHECK(rig.measured.displacement[i] == Approx(0.2e-3).margin(kCount));
  rig.command.enable = false;
  REQUIRE(rig.run_until([&] { return rig.measured.all_disabled; }));
  rig.command.enable = true;
  REQUIRE(rig.run_until([&] { return rig.measured.all_enabled; }));
  rig.command.displacement.fill(2e-3);
  rig.run_for(100 * kMillisecond_ns);
  for (int i = 0; i < 2; ++i) CHECK(rig.measured.displacement[i] == Approx(0.5e-3).margin(kCount));
}

TEST_CASE("A drive without soft limits is a fault that names them, unless it is not to have any", "[unit]") {
  MasterConfig config = limited_config(-3e-3, 5e-3);
  cia402_settings(config.axes[1]).soft_limits = GENERATE(true, false);
  Rig rig(config);
  rig.tamper = [](int axis, Frame& frame) {
    const auto answer = decode_sdo_answer(frame, 2);
    if (axis == 1 && answer && answer->object.index == 0x607D)
      frame = encode_sdo_answer(2, {SdoAnswer::Kind::kAbort, answer->object, 0, 0x06020000});
    return true;
  };
  if (cia402_settings(config.axes[1]).soft_limits) {
    CHECK_FALSE(rig.enable());
    CHECK(rig.master.describe(rig.measured.fault) ==
          "axis 1 'cable 1' (node 2): configuration failed at object 607D:2: no such object (SDO abort "
          "06020000)");
    CHECK(rig.drives[1].state() == DriveState::kSwitchOnDisabled);
  } else {
    CHECK(rig.enable());
    CHECK_FALSE(written(rig, 2, {0x607D, 1}));
  }
}

TEST_CASE(
    "An axis that does not follow is a fault beyond the limit that the file gives, which its drive is told "
    "too",
    "[unit]") {
  MasterConfig config = config_of(2);
  config.axes[0].following_error = 1e-3;
  EnabledRig rig(config);
  CHECK(written(rig, 1, {0x6065, 0}) == std::lround(1e-3 / kCount));
  CHECK_FALSE(written(rig, 2, {0x6065, 0}));
  for (SimulatedCia402Drive& drive : rig.drives) drive.set_jammed(true);
  rig.follow_measured = false;
  const auto start = rig.command.displacement;
  for (int i = 0; i < 2; ++i) rig.command.displacement[i] = start[i] + 0.99e-3;
  rig.run_for(50 * kMillisecond_ns);
  CHECK_FALSE(rig.faulted());
  for (int i = 0; i < 2; ++i) rig.command.displacement[i] = start[i] + 1.01e-3;
  const DriveFault fault = rig.fault(50 * kMillisecond_ns);
  CHECK(fault.kind == FaultKind::kNotFollowing);
  CHECK(fault.axis == 0);
  CHECK_THAT(rig.master.describe(fault),
             Catch::Contains("'cable 0' (node 1): axis does not follow: commanded ") &&
                 Catch::Contains(" mm, measured ") && Catch::Contains("limit 1 mm"));
  rig.run_for(20 * kMillisecond_ns);
  CHECK(rig.drives[0].power_stage() != PowerStage::kOn);
}

}  // namespace tendril::hal::cia402_limits_test
