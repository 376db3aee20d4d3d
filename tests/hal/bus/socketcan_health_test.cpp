// SPDX-License-Identifier: Apache-2.0
#include <linux/can.h>
#include <linux/can/error.h>

#include <array>
#include <catch2/catch.hpp>
#include <string>

#include "hal/bus/open_bus.h"
#include "tests/hal/bus/raw_can.h"
#include "tests/hal/bus/vcan0.h"
#include "tests/hal/bus/wait_for_frames.h"
#include "tests/patience.h"

// The state of interface and controller: refused at opening, or told as the health of the bus.

namespace tendril::hal::socketcan_health_test {
using tendril::testing::comes_true;
using testing::OwnInterface, testing::put, testing::put_error;
using testing::read_error, testing::wait_for;
using testing::shell, testing::skipped_without_root, testing::skipped_without_vcan0, testing::Vcan;

TEST_CASE("An interface that does not exist is an error that says what to do", "[unit]") {
  CHECK_THROWS_AS(open_bus("nosuchcan0", BusRole::kJoin), BusError);
  CHECK_THROWS_WITH(open_bus("nosuchcan0", BusRole::kJoin),
                    Catch::Contains("no CAN interface 'nosuchcan0'") && Catch::Contains("ip link") &&
                        Catch::Contains("local:PATH"));
  CHECK_THROWS_WITH(open_bus("a_name_longer_than_any_interface", BusRole::kHost),
                    Catch::Contains("no CAN interface"));
}

TEST_CASE("An interface that is no CAN bus is refused", "[unit]") {
  // Without CAN in the kernel the socket fails before the interface is looked at.
  CHECK_THROWS_WITH(open_bus("lo", BusRole::kJoin), Catch::Contains("not a CAN interface") ||
                                                        Catch::Contains("no CAN support") ||
                                                        Catch::Contains("cannot open a CAN socket"));
}

TEST_CASE("A bus tells how many frames its transmit queue holds", "[vcan]") {
  if (skipped_without_vcan0() || skipped_without_root()) return;
  const OwnInterface interface("txqueuelen 7 up");
  CHECK(open_bus(interface.name(), BusRole::kJoin)->transmit_queue() == 7);
}

TEST_CASE("Error frames of the controller become the health of the bus", "[vcan]") {
  if (skipped_without_vcan0()) return;
  const Vcan vcan;
  const auto bus = open_bus(vcan.name(), BusRole::kJoin);
  const auto after = [&](uint32_t error_class, uint8_t controller_state) {
    put_error(vcan.name(), error_class, controller_state);
    read_error(*bus);  // error frames are never handed on as data
    return name(bus->health());
  };
  CHECK(after(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_WARNING) == std::string("error-active"));
  CHECK(after(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE) == std::string("error-passive"));
  CHECK(after(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE) == std::string("error-active"));
  CHECK(after(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_PASSIVE) == std::string("error-passive"));
  CHECK(after(CAN_ERR_BUSOFF, 0) == std::string("bus-off"));
  CHECK(after(CAN_ERR_RESTARTED, 0) == std::string("error-active"));
  CHECK(bus->dropped() == 0);
}

TEST_CASE("Frames that the controller itself has lost are counted", "[vcan]") {
  if (skipped_without_vcan0()) return;
  const Vcan vcan;
  const auto bus = open_bus(vcan.name(), BusRole::kJoin);
  for (const auto overflow : std::to_array<uint8_t>({CAN_ERR_CRTL_RX_OVERFLOW, CAN_ERR_CRTL_TX_OVERFLOW})) {
    const uint64_t before = bus->dropped();
    put_error(vcan.name(), CAN_ERR_CRTL, overflow);
    read_error(*bus);
    CHECK(bus->dropped() == before + 1);
    CHECK(bus->health() == BusHealth::kActive);
  }
}

TEST_CASE("Error frames do not keep back the data frames behind them, however many they are", "[vcan]") {
  if (skipped_without_vcan0()) return;
  const Vcan vcan;
  const auto bus = open_bus(vcan.name(), BusRole::kJoin);
  for (int i = 0; i < 200; ++i) put_error(vcan.name(), CAN_ERR_CRTL, CAN_ERR_CRTL_RX_WARNING);
  put_error(vcan.name(), CAN_ERR_CRTL, CAN_ERR_CRTL_RX_PASSIVE);
  can_frame data{};
  data.can_id = 0x181;
  put(vcan.name(), data);
  std::array<Frame, kMaxWaiting> frames;
  REQUIRE(wait_for(*bus, frames, 1) == 1);
  CHECK(frames[0].id == 0x181);
  CHECK(bus->health() == BusHealth::kPassive);
}

TEST_CASE("An interface whose controller is bus-off is refused with what to do", "[vcan]") {
  if (skipped_without_vcan0() || skipped_without_root()) return;
  // To the kernel, a pair of which one end is down looks like a controller that is bus-off: no carrier.
  const std::string peer = "peer" + std::to_string(::getpid());
  const OwnInterface interface("up", "vxcan peer name " + peer);
  // The kernel tells of a carrier, gone or come, a while later.
  const auto refusal = [&]() -> std::string {
    try {
      open_bus(interface.name(), BusRole::kJoin);
    } catch (const BusError& error) {
      return error.what();
    }
    return {};
  };
  REQUIRE(comes_true([&] { return !refusal().empty(); }));
  CHECK_THAT(refusal(), Catch::Contains("bus-off") && Catch::Contains("type can restart"));
  REQUIRE(shell("ip link set " + peer + " up") == 0);
  CHECK(comes_true([&] { return refusal().empty(); }));
}

TEST_CASE("An interface that goes down is noticed and survived", "[vcan]") {
  if (skipped_without_vcan0() || skipped_without_root()) return;
  const OwnInterface interface;
  const auto a = open_bus(interface.name(), BusRole::kHost), b = open_bus(interface.name(), BusRole::kJoin);
  REQUIRE(interface.set("down") == 0);
  CHECK(a->send({.id = 1}) == SendResult::kDown);
  CHECK(a->health() == BusHealth::kDown);
  CHECK_THROWS_WITH(open_bus(interface.name(), BusRole::kJoin),
                    Catch::Contains("is down") && Catch::Contains("ip link set"));
  Frame frame;
  CHECK_FALSE(b->receive(frame));
  CHECK(b->health() == BusHealth::kDown);
  REQUIRE(interface.set("up") == 0);
  CHECK(a->send({.id = 2}) == SendResult::kSent);
  CHECK(a->health() == BusHealth::kActive);
  REQUIRE(wait_for(*b, frame));
  CHECK(frame.id == 2);
  CHECK(b->health() == BusHealth::kActive);
}

TEST_CASE("An interface that is removed leaves a bus that is down and harms nobody", "[vcan]") {
  if (skipped_without_vcan0() || skipped_without_root()) return;
  const OwnInterface interface;
  const auto a = open_bus(interface.name(), BusRole::kHost), b = open_bus(interface.name(), BusRole::kJoin);
  REQUIRE(interface.remove() == 0);
  Frame frame;
  for (int tries = 0; tries < 3; ++tries) {
    CHECK(a->send({.id = 1}) == SendResult::kDown);
    CHECK_FALSE(b->receive(frame));
    CHECK(a->health() == BusHealth::kDown);
    CHECK(b->health() == BusHealth::kDown);
  }
}

}  // namespace tendril::hal::socketcan_health_test
