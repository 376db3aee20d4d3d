// SPDX-License-Identifier: Apache-2.0
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <span>
#include <thread>
#include <vector>

#include "hal/bus/open_bus.h"
#include "tests/hal/bus/local_bus.h"
#include "tests/hal/heap_count.h"
#include "tests/patience.h"

// What becomes of frames on a local bus: to whom they go, in which order, when, and which are dropped.

namespace tendril::hal::local_bus_frames_test {
using tendril::testing::kPatience_s;
using testing::now_ns, testing::RawJoiner, testing::SocketPath, testing::wait_for_local;

TEST_CASE("Frames sent together reach the others of a local bus in their order, however many", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  const auto a = open_bus(at.name(), BusRole::kJoin), b = open_bus(at.name(), BusRole::kJoin);
  std::vector<Frame> sent, received(400);
  CHECK(host->receive(received) == 0);
  CHECK(host->receive(received) == 0);  // both have joined
  for (uint32_t id = 0; id < 300; ++id) sent.push_back({.id = id});
  const auto got_all_by = [&](Bus& bus) {
    std::fill(received.begin(), received.end(), Frame{});
    return bus.receive(received) == 300 && std::equal(sent.begin(), sent.end(), received.begin());
  };
  REQUIRE(a->send(sent) == SendResult::kSent);
  CHECK(got_all_by(*host));
  CHECK(got_all_by(*b));
  REQUIRE(host->send(sent) == SendResult::kSent);
  CHECK(got_all_by(*a));
  CHECK(got_all_by(*b));
  REQUIRE(a->send(std::span(sent).first(3)) == SendResult::kSent);
  CHECK(host->receive(std::span(received).first(2)) == 2);  // no more than there is room for
  CHECK(host->receive(received) == 1);
  CHECK(received[0] == sent[2]);
}

TEST_CASE("A frame on a local bus tells when it was sent, also through the host and however late it is read",
          "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  const auto a = open_bus(at.name(), BusRole::kJoin), b = open_bus(at.name(), BusRole::kJoin);
  Frame frame;
  CHECK_FALSE(host->receive(frame));
  CHECK_FALSE(host->receive(frame));  // both have joined
  const int64_t before_ns = now_ns();
  REQUIRE(a->send({.id = 1}) == SendResult::kSent);
  const int64_t after_ns = now_ns();
  std::this_thread::sleep_for(std::chrono::milliseconds(5));  // it is read late, at least so much
  for (Bus* bus : {host.get(), b.get()}) {
    REQUIRE(bus->receive(frame));
    CHECK(frame.stamp_ns >= before_ns);
    CHECK(frame.stamp_ns <= after_ns);
  }
}

TEST_CASE("Frames sent together wake the peer on a local bus once", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  const RawJoiner raw(at);
  const std::array<Frame, 5> cycle{};
  Frame frame;
  CHECK_FALSE(host->receive(frame));
  REQUIRE(host->send(cycle) == SendResult::kSent);
  char packet[4096];
  CHECK(::recv(raw.fd, packet, sizeof packet, 0) > 0);
  CHECK(::recv(raw.fd, packet, sizeof packet, 0) < 0);
}

TEST_CASE("Frames of every length up to 64 bytes cross a local bus together, whole", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  const auto joiner = open_bus(at.name(), BusRole::kJoin), other = open_bus(at.name(), BusRole::kJoin);
  std::vector<Frame> sent, received(200);
  CHECK(host->receive(received) == 0);
  CHECK(host->receive(received) == 0);  // both have joined
  for (int k = 0; k < 130; ++k) {
    Frame frame{.id = static_cast<uint32_t>(k), .length = static_cast<uint8_t>(k % (kMaxFrameBytes + 1))};
    for (int i = 0; i < frame.length; ++i) frame.data[i] = static_cast<uint8_t>(7 * k + i);
    sent.push_back(frame);
  }
  REQUIRE(joiner->send(sent) == SendResult::kSent);
  for (Bus* bus : {host.get(), other.get()}) {
    REQUIRE(bus->receive(received) == static_cast<int>(sent.size()));
    CHECK(std::equal(sent.begin(), sent.end(), received.begin()));
  }
}

TEST_CASE("A remote frame on a local bus is one", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost), joiner = open_bus(at.name(), BusRole::kJoin);
  REQUIRE(joiner->send(*parse_frame("049#R")) == SendResult::kSent);
  Frame frame;
  REQUIRE(wait_for_local(*host, frame));
  CHECK(to_text(frame) == "049#R");
}

TEST_CASE("Everyone on a local bus hears everyone else", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  const auto a = open_bus(at.name(), BusRole::kJoin), b = open_bus(at.name(), BusRole::kJoin);
  Frame frame;
  const Frame from_a = *parse_frame("202#0F0010270000"), from_host = *parse_frame("1FFFFFF0#01");
  REQUIRE(a->send(from_a) == SendResult::kSent);
  REQUIRE(wait_for_local(*host, frame));
  CHECK(frame == from_a);
  // b had connected before but is only known to the host once it has looked for it.
  REQUIRE_FALSE(host->receive(frame));
  REQUIRE(a->send(from_a) == SendResult::kSent);
  REQUIRE(wait_for_local(*host, frame));
  REQUIRE(wait_for_local(*b, frame));
  CHECK(frame == from_a);
  CHECK_FALSE(a->receive(frame));  // not its own
  REQUIRE(host->send(from_host) == SendResult::kSent);
  REQUIRE(wait_for_local(*a, frame));
  CHECK(frame == from_host);
  REQUIRE(wait_for_local(*b, frame));
  CHECK(frame == from_host);
  CHECK_FALSE(host->receive(frame));
}

TEST_CASE("The host of a local bus can be waited for with poll", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  pollfd descriptor{host->descriptor(), POLLIN, 0};
  CHECK(::poll(&descriptor, 1, 0) == 0);
  const auto joiner = open_bus(at.name(), BusRole::kJoin);
  CHECK(::poll(&descriptor, 1, static_cast<int>(1e3 * kPatience_s)) == 1);  // someone wants to join
  Frame frame;
  CHECK_FALSE(host->receive(frame));
  CHECK(::poll(&descriptor, 1, 0) == 0);
  joiner->send({.id = 1});
  CHECK(::poll(&descriptor, 1, static_cast<int>(1e3 * kPatience_s)) == 1);
}

TEST_CASE("A queue that nobody empties drops frames and counts them", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  const auto joiner = open_bus(at.name(), BusRole::kJoin);
  uint64_t sent = 0, dropped = 0;
  for (int i = 0; i < 20'000; ++i) joiner->send({.id = 1}) == SendResult::kSent ? ++sent : ++dropped;
  CHECK(dropped > 0);
  CHECK(joiner->dropped() == dropped);
  CHECK(joiner->health() == BusHealth::kStalled);
  Frame frame;
  uint64_t received = 0;
  while (host->receive(frame)) ++received;
  CHECK(received == sent);
  CHECK(joiner->send({.id = 1}) == SendResult::kSent);
  CHECK(joiner->health() == BusHealth::kActive);
}

TEST_CASE("After a local bus has stalled, few cycles come from before, and then the present one", "[law]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost), joiner = open_bus(at.name(), BusRole::kJoin);
  const int axes = GENERATE(1, 4, 12);
  const int frames = axes + 2;
  joiner->limit_waiting(2 * frames);
  Frame frame;
  CHECK_FALSE(host->receive(frame));
  std::vector<Frame> cycle(static_cast<size_t>(frames));
  uint8_t sent = 0;
  for (; sent < 200; ++sent) {  // cycles in which the host, which stands for the drives, does not look
    for (Frame& each : cycle) each = {.id = 0x201, .length = 8, .data = {sent}};
    joiner->send(cycle);
  }
  CHECK(joiner->health() == BusHealth::kStalled);
  int stale = 0;
  while (host->receive(frame)) {
    ++stale;
    CHECK(frame.data[0] < 20);  // those that found room, none of the later ones
  }
  CAPTURE(axes, stale);
  CHECK(stale >= 2 * frames);
  CHECK(stale <= 20 * frames);  // of 768 bytes 16 packets find room, of 640 bytes 20
  for (Frame& each : cycle) each = {.id = 0x201, .length = 8, .data = {sent}};
  CHECK(joiner->send(cycle) == SendResult::kSent);
  REQUIRE(wait_for_local(*host, frame));
  CHECK(frame.data[0] == sent);
}

TEST_CASE("Host and joiner in two threads lose no frame that was accepted", "[rt]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  const auto joiner = open_bus(at.name(), BusRole::kJoin);
  constexpr uint32_t kFrames = 5000;
  std::atomic<bool> given_up{false};
  std::thread sender([&] {
    for (uint32_t id = 0; id < kFrames && !given_up;)
      if (joiner->send({.id = id & 0x7FF}) == SendResult::kSent) ++id;
  });
  Frame frame;
  uint32_t next = 0;
  while (next < kFrames && wait_for_local(*host, frame) && frame.id == (next & 0x7FF)) ++next;
  given_up = true;  // a sender that finds no room would go on for ever
  sender.join();
  CHECK(next == kFrames);
}

#ifndef TENDRIL_SANITIZED
TEST_CASE("Sending and receiving on a local bus make no heap call", "[rt]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  const auto joiner = open_bus(at.name(), BusRole::kJoin);
  Frame frame;
  const uint64_t before = test::heap_calls();
  bool moved = joiner->send({.id = 1}) == SendResult::kSent;
  moved = wait_for_local(*host, frame) && moved;
  host->send({.id = 2});
  moved = wait_for_local(*joiner, frame) && moved;
  const uint64_t made = test::heap_calls() - before;
  CHECK(made == 0);
  CHECK(moved);
}
#endif

}  // namespace tendril::hal::local_bus_frames_test
