// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>
#include <tuple>

#include "hal/bus/little_endian.h"
#include "hal/canopen/sdo.h"
#include "tests/hal/rig.h"

// No drive is left with power and nobody that watches it, and none moves when it gets power.

namespace tendril::hal::cia402_safety_test {

using test::config_of, test::EnabledRig, test::kPeriod_ns, test::Rig;

constexpr int64_t kMillisecond_ns = 1'000'000;

/// Whether a value was written to an object of a node after some frames.
bool was_written(const Rig& rig, int node, ObjectAddress object, uint32_t value, size_t from = 0) {
  for (size_t i = from; i < rig.traffic.size(); ++i)
    if (const auto request = decode_sdo_request(rig.traffic[i], node);
        request && request->kind == SdoRequest::Kind::kWrite && request->object == object &&
        request->value == value)
      return true;
  return false;
}

/// A tamper by which a drive shows that value of an object, whatever it has.
auto showing(int node, ObjectAddress object, uint32_t value) {
  return [=](int axis, Frame& frame) {
    if (axis != node - 1) return true;
    if (auto answer = decode_sdo_answer(frame, node);
        answer && answer->kind == SdoAnswer::Kind::kValue && answer->object == object) {
      answer->value = value;
      frame = encode_sdo_answer(node, *answer);
    }
    return true;
  };
}

void end(Rig& rig) {
  rig.command.enable = false;
  rig.command.finish = true;
}

TEST_CASE("Enabling moves nothing, whatever another controller has left in a drive", "[law]") {
  const auto [enabled, offset] =
      GENERATE(table<bool, int32_t>({{false, 0}, {true, 0}, {false, 5000}, {true, -5000}}));
  CAPTURE(enabled, offset);
  Rig rig(config_of(2));
  const double start = 70'000;
  rig.drives[0] = SimulatedCia402Drive(
      {.node = 1, .position_counts = start, .left_enabled = enabled, .position_offset = offset});
  CHECK((rig.drives[0].power_stage() == PowerStage::kOn) == enabled);
  rig.command.enable = true;
  double farthest = 0;
  const bool enabled_at_last = rig.run_until([&] {
    farthest = std::max(farthest, std::abs(rig.drives[0].position() - start));
    return rig.measured.all_enabled;
  });
  CHECK(enabled_at_last);
  rig.run_until(
      [&] {
        farthest = std::max(farthest, std::abs(rig.drives[0].position() - start));
        return false;
      },
      100 * kMillisecond_ns);
  CHECK(farthest < 1);
  CHECK(was_written(rig, 1, {0x60B0, 0}, 0) == (offset != 0));
}

TEST_CASE("A drive that has power and does not lose it is refused, with its statusword", "[unit]") {
  Rig rig(config_of(2));
  rig.tamper = showing(2, {0x6041, 0}, 0x1237);
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kUnexpectedValue);
  CHECK_THAT(rig.master.describe(fault),
             Catch::Contains("(node 2): it has power before it is enabled") && Catch::Contains("1237"));
}

TEST_CASE("A death of the controller stops the drives from the first instant with power on", "[law]") {
  MasterConfig config = config_of(2);
  config.heartbeat_ns = 1'000 * kMillisecond_ns;  // drives monitor it from the first one that they hear
  config.heartbeat_timeout_ns = 2'000 * kMillisecond_ns;
  Rig rig(config);
  rig.command.enable = true;
  REQUIRE(rig.run_until([&] { return rig.drives[0].power_stage() == PowerStage::kOn; }));
  rig.master_alive = false;
  rig.run_for(config.heartbeat_timeout_ns + 100 * kMillisecond_ns);
  for (const SimulatedCia402Drive& drive : rig.drives) CHECK(drive.power_stage() != PowerStage::kOn);
}

TEST_CASE("What safety hangs on is read back: a drive that acknowledges it and keeps its value is refused",
          "[law]") {
  const std::tuple<int, int, uint32_t> kept[] = {{0x1016, 1, 0},   {0x1017, 0, 0},          {0x1400, 2, 255},
                                                 {0x1800, 2, 255}, {0x1600, 2, 0x60FF0020}, {0x607D, 2, 1000},
                                                 {0x6065, 0, 7},   {0x60C2, 1, 10},         {0x60B0, 0, 500}};
  for (const auto& [index, sub, value] : kept) {
    CAPTURE(index, sub);
    MasterConfig config = config_of(2);
    for (AxisConfig& axis : config.axes) {
      axis.displacement_min = -(axis.displacement_max = 5e-3);
      axis.following_error = 1e-3;
    }
    Rig rig(config);
    const ObjectAddress object{static_cast<uint16_t>(index), static_cast<uint8_t>(sub)};
    rig.tamper = showing(1, object, value);
    rig.command.enable = true;
    const DriveFault fault = rig.fault();
    CHECK(fault.kind == FaultKind::kUnexpectedValue);
    CHECK(fault.object == (static_cast<uint32_t>(index) << 8 | static_cast<uint32_t>(sub)));
    CHECK(fault.code == value);
    CHECK(rig.drives[0].power_stage() != PowerStage::kOn);
  }
}

TEST_CASE("A drive that no longer monitors us when it is to be enabled is not enabled", "[law]") {
  Rig rig(config_of(2));
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  VirtualEndpoint& other = rig.bus.attach("other");
  other.send(encode_sdo_request(2, {SdoRequest::Kind::kWrite, {0x1016, 1}, 4, 0}));
  rig.run_for(20 * kMillisecond_ns);
  rig.command.enable = true;
  CHECK(rig.fault().object == 0x1016'01);
  CHECK(rig.measured.fault.axis == 1);
  CHECK(rig.drives[1].power_stage() != PowerStage::kOn);
}

TEST_CASE("A drive that does not say that its power is off goes on monitoring us, and is told at the end",
          "[law]") {
  EnabledRig rig(config_of(2));
  const auto shows_enabled = showing(1, {0x6041, 0}, 0x1237);
  rig.tamper = [=](int axis, Frame& frame) {
    if (axis == 0 && frame.id == 0x181) put(frame.data, 0, uint16_t{0x1237});
    return shows_enabled(axis, frame);
  };
  const size_t from = rig.traffic.size();
  end(rig);
  REQUIRE(rig.run_until([&] { return rig.measured.finished; }));
  CHECK(rig.measured.power[0] == DrivePower::kOn);
  CHECK(rig.measured.power[1] == DrivePower::kOff);
  CHECK_FALSE(was_written(rig, 1, {0x1016, 1}, 0, from));
  CHECK_THAT(describe_power(config_of(2), rig.measured),
             Catch::StartsWith("axis 'cable 0' (node 1) did not disable"));
}

TEST_CASE("A drive that hears no PDO any more is disabled over SDO", "[law]") {
  EnabledRig rig(config_of(2));
  VirtualEndpoint& other = rig.bus.attach("other");
  other.send(encode_sdo_request(1, {SdoRequest::Kind::kWrite, {0x1400, 1}, 4, 0x8000'0201}));  // off
  rig.run_for(20 * kMillisecond_ns);
  end(rig);
  REQUIRE(rig.run_until([&] { return rig.measured.finished; }, 900 * kMillisecond_ns));
  CHECK(rig.drives[0].power_stage() == PowerStage::kOff);
  CHECK(describe_power(config_of(2), rig.measured).empty());
}

TEST_CASE("A drive whose positions are lost is asked over SDO whether its power is off, and then released",
          "[law]") {
  EnabledRig rig(config_of(2));
  rig.tamper = [](int axis, Frame& frame) { return !(axis == 0 && frame.id == 0x181); };
  REQUIRE(rig.fault().kind == FaultKind::kFeedbackLost);
  const size_t from = rig.traffic.size();
  end(rig);
  REQUIRE(rig.run_until([&] { return rig.measured.finished; }));
  CHECK(was_written(rig, 1, {0x1016, 1}, 0, from));
  CHECK(describe_power(config_of(2), rig.measured).empty());
}

TEST_CASE("A drive that cannot be reached goes on monitoring us, and is told at the end", "[law]") {
  EnabledRig rig(config_of(2));
  rig.tamper = [](int axis, Frame&) { return axis != 0; };
  REQUIRE(rig.faulted() == false);
  rig.fault();
  const size_t from = rig.traffic.size();
  end(rig);
  REQUIRE(rig.run_until([&] { return rig.measured.finished; }));
  CHECK_FALSE(was_written(rig, 1, {0x1016, 1}, 0, from));
  CHECK(was_written(rig, 2, {0x1016, 1}, 0, from));
  CHECK_THAT(describe_power(config_of(2), rig.measured),
             Catch::StartsWith("axis 'cable 0' (node 1) cannot be reached"));
}

TEST_CASE("A drive that somebody else restarted is not released: its set-up may be another controller's",
          "[law]") {
  EnabledRig rig(config_of(2));
  rig.bus.attach("other").send(encode_nmt({NmtCommand::kResetCommunication, 2}));
  REQUIRE(rig.fault().kind == FaultKind::kDriveRestarted);
  const size_t from = rig.traffic.size();
  end(rig);
  REQUIRE(rig.run_until([&] { return rig.measured.finished; }));
  CHECK_FALSE(was_written(rig, 2, {0x1016, 1}, 0, from));
  CHECK(was_written(rig, 1, {0x1016, 1}, 0, from));
}

}  // namespace tendril::hal::cia402_safety_test
