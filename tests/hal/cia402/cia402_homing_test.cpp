// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>

#include "hal/cia402/cia402_master.h"
#include "tests/hal/rig.h"

// Axes and their reference: without one nothing is known of an axis, and so nothing moves but its own search.

namespace tendril::hal::cia402_homing_test {
using namespace tendril::hal::test;

constexpr int64_t kMillisecond_ns = 1'000'000;
constexpr int kBit = 15;
constexpr double kEdge = 4;  // counts from the switch at which a drive stops, from 2000 counts/s
constexpr double kCount = 0.0628 / 65536;  // m, of the rig's axes

/// `axes` axes that find their reference at the negative limit switch; drive i stands 1000 · (i + 1) counts
/// from it.
MasterConfig homing_config(int axes) {
  MasterConfig config = config_of(axes);
  for (AxisConfig& axis : config.axes) {
    cia402_settings(axis).reference = Reference::kHoming;
    cia402_settings(axis).homing.method = 17;
  }
  return config;
}

/// Sets or clears bits in the statuswords of an axis.
auto force_bits(int axis, uint16_t set, uint16_t clear) {
  return [=](int from, Frame& frame) {
    const uint32_t id = 0x181 + static_cast<uint32_t>(axis);
    if (const auto feedback = decode_drive_feedback(id, frame); from == axis && feedback)
      frame = encode_drive_feedback(
          id, {static_cast<uint16_t>((feedback->statusword | set) & ~clear), feedback->position});
    return true;
  };
}

bool has_power(const SimulatedCia402Drive& drive) { return drive.power_stage() == PowerStage::kOn; }

TEST_CASE("An axis is homed before its position is known, and enabling then moves nothing", "[unit]") {
  MasterConfig config = homing_config(1);
  cia402_settings(config.axes[0]).homing.method = static_cast<int8_t>(GENERATE(17, 18));
  config.axes[0].scale.offset = 3e-3;  // of the switch
  Rig rig(config);
  bool has_searched = false;
  REQUIRE(rig.run_until([&] {
    has_searched = has_searched || has_power(rig.drives[0]);
    return rig.measured.all_known || rig.faulted();
  }));
  REQUIRE_FALSE(rig.faulted());
  CHECK(has_searched);
  CHECK(rig.drives[0].position() == Approx(0).margin(kEdge));
  CHECK(rig.measured.displacement[0] == Approx(3e-3).margin(kEdge * kCount));

  const auto from = static_cast<int>(rig.traffic.size());
  REQUIRE(rig.enable());
  CHECK(rig.find("601#2F60600008000000", from) >= 0);  // back in cyclic synchronous position mode
  for (int k = from; k < static_cast<int>(rig.traffic.size()); ++k)
    if (const auto rpdo = decode_drive_command(0x201, rig.traffic[k])) CHECK(std::abs(rpdo->target) <= kEdge);
  CHECK(rig.drives[0].position() == Approx(0).margin(kEdge));
  rig.follow_measured = false;
  rig.command.displacement[0] = 4e-3;
  rig.run_for(100 * kMillisecond_ns);
  CHECK(rig.drives[0].position() == Approx(1e-3 / kCount).margin(1));
}

TEST_CASE("Homing in place takes the present position for the zero", "[unit]") {
  MasterConfig config = homing_config(1);
  cia402_settings(config.axes[0]).homing.method = static_cast<int8_t>(GENERATE(35, 37));
  cia402_settings(config.axes[0]).referenced_bit = kBit;
  EnabledRig rig(config);
  CHECK(rig.measured.displacement[0] == 0);
  CHECK(rig.drives[0].position() == 1000);
}

TEST_CASE("What is configured of homing is written, and nothing else", "[unit]") {
  MasterConfig config = homing_config(2);
  cia402_settings(config.axes[0]).homing = {
      .method = 18, .speed_search = 40'000, .speed_zero = 500, .acceleration = 300'000};
  cia402_settings(config.axes[1]).homing.method.reset();
  Rig rig(config);
  rig.run_until([&] { return rig.measured.all_known || rig.faulted(); });
  int at = 0;
  for (const char* text :
       {"601#2F98600012000000", "601#23996001409C0000", "601#23996002F4010000", "601#239A6000E0930400",
        "601#2F60600006000000", "601#4061600000000000", "201#1F0000000000"}) {
    CAPTURE(text);
    at = rig.find(text, at);
    CHECK(at >= 0);
  }
  for (const Frame& frame : rig.traffic)
    if (const auto request = decode_sdo_request(frame, 2))
      CHECK((request->object.index < 0x6098 || request->object.index > 0x609A));
}

TEST_CASE("Axes are homed one after the other, in their order", "[unit]") {
  Rig rig(homing_config(4));
  std::vector<int> order;
  REQUIRE(rig.run_until([&] {
    int powered = 0;
    for (int i = 0; i < 4; ++i)
      if (has_power(rig.drives[i])) {
        ++powered;
        if (order.empty() || order.back() != i) order.push_back(i);
      }
    CHECK(powered <= 1);
    return rig.measured.all_known;
  }));
  CHECK(order == std::vector<int>{0, 1, 2, 3});
}

TEST_CASE("No axis is homed before every drive is there", "[unit]") {
  Rig rig(homing_config(2));
  rig.plugs[1]->set_plugged(false);
  bool has_searched = false;
  rig.run_until([&] {
    has_searched = has_searched || has_power(rig.drives[0]);
    return false;
  });
  CHECK(rig.measured.fault.axis == 1);
  CHECK_FALSE(has_searched);
}

TEST_CASE("A homing error is a fault, the axis loses its power, and the next ones are not homed", "[unit]") {
  MasterConfig config = homing_config(2);
  cia402_settings(config.axes[0]).homing.method = 0;  // none
  Rig rig(config);
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kHomingFailed);
  CHECK(fault.axis == 0);
  CHECK_THAT(rig.master.describe(fault), Catch::Contains("axis 0 'cable 0' (node 1): homing failed"));
  rig.run_for(1'000 * kMillisecond_ns);
  for (const SimulatedCia402Drive& drive : rig.drives) CHECK_FALSE(has_power(drive));
  CHECK_FALSE(rig.measured.all_known);
  CHECK(rig.drives[1].position() == 2000);
}

TEST_CASE("Homing that does not end is a time-out, and a reset homes again", "[unit]") {
  MasterConfig config = homing_config(1);
  cia402_settings(config.axes[0]).homing.timeout_ns = 2'000 * kMillisecond_ns;
  Rig rig(config);
  rig.drives[0].set_jammed(true);
  REQUIRE(rig.run_until([&] { return has_power(rig.drives[0]); }));
  const int64_t begun_ns = rig.bus.time_ns();
  CHECK(rig.fault().kind == FaultKind::kHomingTimeout);
  CHECK(rig.bus.time_ns() - begun_ns == Approx(2e9).margin(5 * kPeriod_ns));
  rig.run_for(100 * kMillisecond_ns);
  CHECK_FALSE(has_power(rig.drives[0]));
  CHECK_FALSE(rig.measured.all_known);
  rig.drives[0].set_jammed(false);
  rig.command.reset = true;
  rig.cycle();
  rig.command.reset = false;
  CHECK(rig.run_until([&] { return rig.measured.all_known; }));
  CHECK(rig.measured.displacement[0] == Approx(0).margin(kEdge * kCount));
}

TEST_CASE("A drive fault in the middle of homing is told as what it is", "[unit]") {
  Rig rig(homing_config(1));
  REQUIRE(rig.run_until([&] { return has_power(rig.drives[0]); }));
  rig.drives[0].inject_fault(0x2310);
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kDriveFault);
  CHECK(fault.code == 0x2310);
}

TEST_CASE("What a drive still shows of an earlier homing is not taken for the present one", "[unit]") {
  Rig rig(homing_config(1));
  REQUIRE(rig.run_until([&] { return has_power(rig.drives[0]); }));
  rig.tamper = force_bits(0, kHomingAttained | kTargetReached, 0);
  rig.run_for(40 * kMillisecond_ns);
  rig.tamper = nullptr;
  CHECK_FALSE(rig.measured.all_known);
  CHECK(rig.drives[0].position() > 0);
  REQUIRE(rig.run_until([&] { return rig.measured.all_known; }));
  CHECK(rig.drives[0].position() == Approx(0).margin(kEdge));
}

TEST_CASE("The end of the run ends the search", "[unit]") {
  Rig rig(homing_config(1));
  REQUIRE(rig.run_until([&] { return has_power(rig.drives[0]); }));
  rig.command.finish = true;
  REQUIRE(rig.run_until([&] { return rig.measured.finished; }, 200 * kMillisecond_ns));
  CHECK_FALSE(has_power(rig.drives[0]));
  CHECK(rig.drives[0].state() == DriveState::kSwitchOnDisabled);  // not in fault: it was told to
  CHECK(rig.drives[0].position() > 0);
}

TEST_CASE("An axis whose drive tells that it has no reference never moves", "[unit]") {
  MasterConfig config = config_of(2);
  cia402_settings(config.axes[1]).referenced_bit = kBit;
  Rig rig(config);
  rig.tamper = force_bits(1, 0, 1u << kBit);
  rig.command.enable = true;
  const DriveFault fault = rig.fault();
  CHECK(fault.kind == FaultKind::kNotReferenced);
  CHECK(fault.axis == 1);
  CHECK_THAT(rig.master.describe(fault),
             Catch::Contains("axis 1 'cable 1' (node 2): axis has no reference: bit 15 of its statusword"));
  rig.run_for(500 * kMillisecond_ns);
  CHECK_FALSE(rig.measured.all_known);
  for (const SimulatedCia402Drive& drive : rig.drives) CHECK_FALSE(has_power(drive));
  rig.tamper = nullptr;  // somebody has homed it
  CHECK(rig.reset());
}

TEST_CASE("A reference that is lost in operation is a fault", "[unit]") {
  MasterConfig config = config_of(2);
  cia402_settings(config.axes[0]).referenced_bit = kBit;
  EnabledRig rig(config);
  rig.run_for(100 * kMillisecond_ns);
  REQUIRE_FALSE(rig.faulted());
  rig.tamper = force_bits(0, 0, 1u << kBit);
  CHECK(rig.fault(100 * kMillisecond_ns).kind == FaultKind::kNotReferenced);
  rig.run_for(20 * kMillisecond_ns);
  CHECK_FALSE(has_power(rig.drives[0]));
}

TEST_CASE("A procedure that ends without the bit that tells of a reference has found none", "[unit]") {
  MasterConfig config = homing_config(1);
  cia402_settings(config.axes[0]).referenced_bit = kBit;
  cia402_settings(config.axes[0]).homing.timeout_ns = 2'000 * kMillisecond_ns;
  Rig rig(config);
  rig.tamper = force_bits(0, 0, 1u << kBit);
  CHECK(rig.fault().kind == FaultKind::kNotReferenced);
}

TEST_CASE("A drive that tells that it still has its reference is not homed again, another one is", "[unit]") {
  const bool tells = GENERATE(false, true);
  CAPTURE(tells);
  MasterConfig config = homing_config(1);
  if (tells) cia402_settings(config.axes[0]).referenced_bit = kBit;
  EnabledRig rig(config);
  rig.follow_measured = false;
  rig.command.displacement[0] = 5e-3;
  rig.run_for(100 * kMillisecond_ns);
  const double moved = rig.drives[0].position();
  CHECK(moved == Approx(5e-3 / kCount).margin(1));

  Rig successor(config);
  successor.drives = rig.drives;
  successor.bus.set_time(rig.bus.time_ns());
  REQUIRE(successor.enable());
  CHECK((successor.find("601#2F60600006000000") >= 0) == !tells);
  CHECK(successor.drives[0].position() == Approx(tells ? moved : 0).margin(kEdge));
  CHECK(successor.measured.displacement[0] == Approx(tells ? 5e-3 : 0).margin(kEdge * kCount));
}

}  // namespace tendril::hal::cia402_homing_test
