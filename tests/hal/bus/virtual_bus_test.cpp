// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/virtual_bus.h"

#include <array>
#include <catch2/catch.hpp>

namespace tendril::hal::virtual_bus_test {

TEST_CASE("A frame reaches all other nodes after the delay, in order, with the time of its arrival",
          "[unit]") {
  VirtualBus bus(1000);
  VirtualEndpoint& a = bus.attach("a");
  VirtualEndpoint& b = bus.attach("b");
  VirtualEndpoint& c = bus.attach("c");
  Frame frame;
  CHECK(a.send({.id = 1}) == SendResult::kSent);
  bus.set_time(500);
  CHECK(b.send({.id = 2}) == SendResult::kSent);
  bus.set_time(999);
  CHECK_FALSE(c.receive(frame));
  bus.set_time(7000);
  REQUIRE(c.receive(frame));
  CHECK(frame.id == 1);
  CHECK(frame.stamp_ns == 1000);
  REQUIRE(c.receive(frame));
  CHECK(frame.id == 2);
  CHECK(frame.stamp_ns == 1500);
  CHECK_FALSE(c.receive(frame));
  REQUIRE(a.receive(frame));  // not its own
  CHECK(frame.id == 2);
  CHECK_FALSE(a.receive(frame));
}

TEST_CASE("Frames sent together arrive together, as many as there is room for", "[unit]") {
  VirtualBus bus(1000);
  VirtualEndpoint& a = bus.attach("a");
  VirtualEndpoint& b = bus.attach("b");
  const std::array<Frame, 3> sent{Frame{.id = 1}, Frame{.id = 2}, Frame{.id = 3}};
  std::array<Frame, 2> received;
  CHECK(a.send(sent) == SendResult::kSent);
  CHECK(b.receive(received) == 0);
  bus.set_time(1000);
  CHECK(b.receive(received) == 2);
  CHECK(received[1].id == 2);
  CHECK(b.receive(received) == 1);
  CHECK(received[0].id == 3);
}

TEST_CASE("An unplugged node notices nothing and is not heard", "[unit]") {
  VirtualBus bus;
  VirtualEndpoint& a = bus.attach("a");
  VirtualEndpoint& b = bus.attach("b");
  Frame frame;
  b.set_plugged(false);
  CHECK(a.send({.id = 1}) == SendResult::kSent);
  CHECK(b.send({.id = 2}) == SendResult::kSent);
  CHECK(b.health() == BusHealth::kActive);
  b.set_plugged(true);
  CHECK_FALSE(b.receive(frame));
  CHECK_FALSE(a.receive(frame));
}

TEST_CASE("A node in bus-off can neither send nor receive, an error-passive one can", "[unit]") {
  VirtualBus bus;
  VirtualEndpoint& a = bus.attach("a");
  VirtualEndpoint& b = bus.attach("b");
  Frame frame;
  b.set_health(BusHealth::kOff);
  CHECK(b.send({.id = 2}) == SendResult::kDown);
  a.send({.id = 1});
  CHECK_FALSE(b.receive(frame));
  b.set_health(BusHealth::kPassive);
  CHECK(b.send({.id = 2}) == SendResult::kSent);
  a.send({.id = 1});
  CHECK(b.receive(frame));
}

TEST_CASE("What waits while a node's bus is stalled comes first, up to its limit, then what is sent next",
          "[unit]") {
  VirtualBus bus;
  VirtualEndpoint& a = bus.attach("a");
  VirtualEndpoint& b = bus.attach("b");
  a.limit_waiting(4);
  a.set_stalled(true);
  const std::array<Frame, 3> cycle{Frame{.id = 1}, Frame{.id = 2}, Frame{.id = 3}};
  CHECK(a.send(cycle) == SendResult::kSent);
  CHECK(a.health() == BusHealth::kActive);
  CHECK(a.send(cycle) == SendResult::kQueueFull);
  CHECK(a.health() == BusHealth::kStalled);
  CHECK(a.dropped() == 2);
  CHECK(b.send({.id = 7}) == SendResult::kSent);
  Frame frame;
  CHECK_FALSE(a.receive(frame));
  CHECK_FALSE(b.receive(frame));
  bus.set_time(1'000'000'000);
  a.set_stalled(false);
  CHECK(a.send({.id = 9}) == SendResult::kSent);
  CHECK(a.health() == BusHealth::kActive);
  for (const uint32_t id : {1, 2, 3, 1, 9}) {
    REQUIRE(b.receive(frame));
    CHECK(frame.id == id);
  }
  CHECK_FALSE(b.receive(frame));
}

TEST_CASE("A full queue drops the newest frames and counts them", "[unit]") {
  VirtualBus bus(0, 3);
  VirtualEndpoint& a = bus.attach("a");
  VirtualEndpoint& b = bus.attach("b");
  for (uint32_t id = 0; id < 5; ++id) a.send({.id = id});
  CHECK(b.dropped() == 2);
  Frame frame;
  for (uint32_t id = 0; id < 3; ++id) {
    REQUIRE(b.receive(frame));
    CHECK(frame.id == id);
  }
  CHECK_FALSE(b.receive(frame));
}

}  // namespace tendril::hal::virtual_bus_test
