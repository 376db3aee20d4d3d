// SPDX-License-Identifier: Apache-2.0
#include <linux/can.h>
#include <linux/can/error.h>
#include <sched.h>

#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hal/bus/open_bus.h"
#include "tests/hal/bus/raw_can.h"
#include "tests/hal/bus/vcan0.h"
#include "tests/hal/bus/wait_for_frames.h"
#include "tests/hal/heap_count.h"
#include "tests/patience.h"

namespace tendril::hal::socketcan_test {
using tendril::testing::comes_true;
using testing::becomes_readable, testing::read_error, testing::wait_for;
using testing::OwnInterface, testing::put, testing::put_error;
using testing::shell, testing::skipped_without_root, testing::skipped_without_vcan0, testing::Vcan;

/// Tells when the kernel has delivered all that this thread has sent. What is sent waits in a queue of the
/// CPU for its delivery, so the thread keeps to one CPU as long as the object lives.
class Fence {
 public:
  static constexpr uint32_t kMark = 0x7FE;  // what else hears must not want it

  explicit Fence(const std::string& interface)
      : sender_(open_bus(interface, BusRole::kHost, std::array{kMark})),
        ear_(open_bus(interface, BusRole::kJoin, std::array{kMark})) {
    REQUIRE(::sched_getaffinity(0, sizeof before_, &before_) == 0);
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(::sched_getcpu(), &one);
    REQUIRE(::sched_setaffinity(0, sizeof one, &one) == 0);
  }
  ~Fence() { ::sched_setaffinity(0, sizeof before_, &before_); }
  Fence(const Fence&) = delete;
  Fence& operator=(const Fence&) = delete;

  /// @return  false where patience ended before
  bool wait() {
    ++round_;
    return comes_true([&] {  // a mark may find no room in a queue, so others follow
      sender_->send({.id = kMark, .length = 1, .data = {round_}});
      Frame frame;
      while (ear_->receive(frame))
        if (frame.data[0] == round_) return true;
      return false;
    });
  }

 private:
  std::unique_ptr<Bus> sender_, ear_;
  cpu_set_t before_;
  uint8_t round_ = 0;
};

TEST_CASE("Frames cross a real SocketCAN interface unchanged, and not back to their sender", "[vcan]") {
  if (skipped_without_vcan0()) return;
  const Vcan vcan;
  const auto a = open_bus(vcan.name(), BusRole::kHost), b = open_bus(vcan.name(), BusRole::kJoin);
  CHECK(a->describe() == "CAN interface " + vcan.name());
  Frame frame;
  for (const char* text : {"202#0F0010270000", "080#", "1FFFFFF0#0102030405060708"}) {
    CAPTURE(text);
    REQUIRE(a->send(*parse_frame(text)) == SendResult::kSent);
    REQUIRE(wait_for(*b, frame));
    CHECK(to_text(frame) == text);
  }
  CHECK_FALSE(a->receive(frame));
  CHECK(a->health() == BusHealth::kActive);
  CHECK(b->dropped() == 0);
}

TEST_CASE("A frame of more than 8 bytes is dropped with all after it and counted, as CAN does not carry it",
          "[vcan]") {
  if (skipped_without_vcan0()) return;
  const Vcan vcan;
  const auto a = open_bus(vcan.name(), BusRole::kHost), b = open_bus(vcan.name(), BusRole::kJoin);
  const std::array<Frame, 3> frames{Frame{.id = 1}, Frame{.id = 2, .length = 9}, Frame{.id = 3}};
  CHECK(a->send(frames) == SendResult::kQueueFull);
  CHECK(a->dropped() == 2);
  Frame frame;
  REQUIRE(wait_for(*b, frame));
  CHECK(frame.id == 1);
  CHECK_FALSE(b->receive(frame));
  CHECK(a->health() == BusHealth::kActive);
}

TEST_CASE("Frames sent together cross a real SocketCAN interface in their order, however many", "[vcan]") {
  if (skipped_without_vcan0()) return;
  const Vcan vcan;
  const auto a = open_bus(vcan.name(), BusRole::kHost), b = open_bus(vcan.name(), BusRole::kJoin);
  std::vector<Frame> sent, received(200);
  for (uint32_t id = 0; id < 150; ++id) sent.push_back({.id = id, .length = 1, .data = {uint8_t(id)}});
  REQUIRE(a->send(sent) == SendResult::kSent);
  REQUIRE(wait_for(*b, received, 150) == 150);
  received.resize(150);
  CHECK(received == sent);
  REQUIRE(a->send(std::span(sent).first(3)) == SendResult::kSent);
  REQUIRE(wait_for(*b, std::span(received).first(2), 2) == 2);  // no more than there is room for
  REQUIRE(wait_for(*b, received, 1) == 1);
  CHECK(received[0] == sent[2]);
  CHECK(a->send(std::span<const Frame>()) == SendResult::kSent);
  CHECK(b->receive(received) == 0);
}

TEST_CASE("A frame from a real SocketCAN interface tells when the kernel got it, however late it is read",
          "[vcan]") {
  if (skipped_without_vcan0()) return;
  const Vcan vcan;
  const auto now_ns = [] { return std::chrono::steady_clock::now().time_since_epoch().count(); };
  const auto a = open_bus(vcan.name(), BusRole::kHost), b = open_bus(vcan.name(), BusRole::kJoin);
  // Where nobody else has asked for stamps, the kernel begins with them a moment after we have.
  CHECK(comes_true([&] {
    Frame frame;
    const int64_t before_ns = now_ns();
    REQUIRE_FALSE(b->receive(frame));
    REQUIRE(a->send({.id = 1}) == SendResult::kSent);
    REQUIRE(becomes_readable(*b));
    const int64_t after_ns = now_ns();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));  // it is read late, at least so much
    REQUIRE(b->receive(frame));
    REQUIRE(frame.stamp_ns >= before_ns);
    return frame.stamp_ns <= after_ns;
  }));
}

TEST_CASE("A bus opened for some identifiers hears these, and nothing else reaches its queue", "[vcan]") {
  if (skipped_without_vcan0()) return;
  const Vcan vcan;
  const std::vector<uint32_t> wanted = {0x181, 0x701, kExtendedMark | 0x702};
  const auto bus = open_bus(vcan.name(), BusRole::kJoin, wanted);
  const pollfd readable{bus->descriptor(), POLLIN, 0};
  for (const canid_t id : {0x182u, 0x181u | CAN_EFF_FLAG, 0x181u | CAN_RTR_FLAG, 0x702u,
                           0x702u | CAN_EFF_FLAG | CAN_RTR_FLAG, 0x10000702u | CAN_EFF_FLAG, 0x7FFu}) {
    CAPTURE(id);
    can_frame foreign{};
    foreign.can_id = id;
    put(vcan.name(), foreign);
    pollfd descriptor = readable;
    // Who waits for the bus is not even woken. Where the kernel takes its time this look comes too early to
    // see it; that none of them came is seen below, by what comes first.
    CHECK(::poll(&descriptor, 1, 0) == 0);
  }
  Frame frame;
  const auto other = open_bus(vcan.name(), BusRole::kHost);
  for (const uint32_t id : wanted) {
    const Frame sent{.id = id & ~kExtendedMark, .extended = (id & kExtendedMark) != 0};
    REQUIRE(other->send(sent) == SendResult::kSent);
    REQUIRE(wait_for(*bus, frame));
    CHECK(frame == sent);
  }
  put_error(vcan.name(), CAN_ERR_BUSOFF, 0);  // of the controller it hears all the same
  read_error(*bus);
  CHECK(bus->health() == BusHealth::kOff);
  CHECK_THROWS_WITH(open_bus(vcan.name(), BusRole::kJoin, std::vector<uint32_t>(513, 1)),
                    Catch::Contains("513 identifiers") && Catch::Contains("512"));
}

TEST_CASE("Frames that found no room in the receiver's queue are counted", "[vcan]") {
  if (skipped_without_vcan0()) return;
  const Vcan vcan;
  const auto a = open_bus(vcan.name(), BusRole::kHost);
  const auto b = open_bus(vcan.name(), BusRole::kJoin, std::array{0x123u});
  Fence fence(vcan.name());
  // A few at a time: more than the kernel holds between sender and receiver it would drop untold.
  constexpr int kSent = 20'000, kTogether = 100;
  int accepted = 0;
  for (int i = 0; i < kSent; ++i) {
    if (a->send({.id = 0x123}) == SendResult::kSent) ++accepted;
    if (i % kTogether == 0) REQUIRE(fence.wait());
  }
  REQUIRE(fence.wait());
  Frame frame;
  int received = 0;
  while (b->receive(frame)) ++received;
  a->send({.id = 0x123});  // the kernel tells the count with the next frame
  REQUIRE(wait_for(*b, frame));
  CHECK(received < accepted);
  CHECK(b->dropped() == static_cast<uint64_t>(accepted - received));
}

TEST_CASE("A flood of frames for others does not touch the queue", "[vcan]") {
  if (skipped_without_vcan0()) return;
  const Vcan vcan;
  const std::vector<uint32_t> wanted = {0x181};
  const auto bus = open_bus(vcan.name(), BusRole::kJoin, wanted),
             other = open_bus(vcan.name(), BusRole::kHost);
  Fence fence(vcan.name());
  for (int i = 0; i < 20'000; ++i) other->send({.id = 0x182});
  REQUIRE(fence.wait());
  REQUIRE(other->send({.id = 0x181}) == SendResult::kSent);
  Frame frame;
  REQUIRE(wait_for(*bus, frame));
  CHECK(frame.id == 0x181);
  CHECK(bus->dropped() == 0);
}

TEST_CASE("A flood of our own frames is behind us after one reading, and what comes then is new", "[vcan]") {
  if (skipped_without_vcan0()) return;
  const Vcan vcan;
  const auto bus = open_bus(vcan.name(), BusRole::kJoin, std::array{0x181u, 0x182u});
  const auto other = open_bus(vcan.name(), BusRole::kHost);
  Fence fence(vcan.name());
  std::vector<Frame> frames(kMaxWaiting);
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 5000; ++i) {
      other->send({.id = 0x181});
      if (i % 100 == 0) REQUIRE(fence.wait());
    }
    REQUIRE(fence.wait());  // for what the kernel still has in hand
    const int count = bus->receive(frames);
    CHECK(count > 340);  // 16 ms of a bus of 1 Mbit/s
    CHECK(count < kMaxWaiting);
    REQUIRE(other->send({.id = 0x182}) == SendResult::kSent);
    REQUIRE(wait_for(*bus, frames, 1) == 1);
    CHECK(frames[0].id == 0x182);
  }
}

TEST_CASE("A remote frame asks for data and carries none, whatever length it tells", "[vcan]") {
  if (skipped_without_vcan0()) return;
  const Vcan vcan;
  const auto bus = open_bus(vcan.name(), BusRole::kJoin), other = open_bus(vcan.name(), BusRole::kHost);
  can_frame frame{};
  frame.can_id = CAN_RTR_FLAG | 0x701;
  frame.can_dlc = 1;
  put(vcan.name(), frame);
  Frame received;
  REQUIRE(wait_for(*bus, received));
  CHECK(to_text(received) == "701#R");
  REQUIRE(other->send(received) == SendResult::kSent);
  REQUIRE(wait_for(*bus, received));
  CHECK(to_text(received) == "701#R");
}

TEST_CASE("A transmit queue that is full takes no frame after the one it refused, and is no end of the bus",
          "[vcan]") {
  if (skipped_without_vcan0() || skipped_without_root()) return;
  const OwnInterface interface;
  // A bus on which a frame takes minutes, and a queue of three frames.
  if (shell("tc qdisc add dev " + interface.name() + " root netem limit 3 delay 200s") != 0) {
    WARN("skipped: no sch_netem in this kernel, or no tc, to make an interface slow with");
    return;
  }
  const auto a = open_bus(interface.name(), BusRole::kHost), b = open_bus(interface.name(), BusRole::kJoin);
  const std::array<Frame, 5> cycle{Frame{.id = 1}, Frame{.id = 2}, Frame{.id = 3}, Frame{.id = 4},
                                   Frame{.id = 5}};
  CHECK(a->send(cycle) == SendResult::kQueueFull);
  CHECK(a->dropped() == 2);
  CHECK(a->health() == BusHealth::kStalled);
  std::array<Frame, 5> received;
  REQUIRE(wait_for(*b, received, 3) == 3);  // others on this machine hear what the queue took
  for (int i = 0; i < 3; ++i) CHECK(received[i] == cycle[i]);
  REQUIRE(shell("tc qdisc del dev " + interface.name() + " root") == 0);
  CHECK(a->send(cycle) == SendResult::kSent);
  CHECK(a->dropped() == 2);
  CHECK(a->health() == BusHealth::kActive);
}

TEST_CASE("No more frames wait in the kernel than was said, however long its transmit queue is", "[vcan]") {
  if (skipped_without_vcan0() || skipped_without_root()) return;
  const OwnInterface interface("txqueuelen 1000 up");
  // A bus on which a frame takes a quarter of a minute, once two have passed.
  if (shell("tc qdisc add dev " + interface.name() + " root tbf rate 8bit burst 32 limit 100000") != 0) {
    WARN("skipped: no sch_tbf in this kernel, or no tc, to make an interface slow with");
    return;
  }
  const auto bus = open_bus(interface.name(), BusRole::kHost);
  constexpr int kLimit = 12;
  bus->limit_waiting(kLimit);
  int taken = 0;
  while (taken < 200 && bus->send({.id = 1}) == SendResult::kSent) ++taken;
  CHECK(taken >= kLimit);
  CHECK(taken <= 2 + kLimit * 896 / 640 + 1);  // a frame is counted with 640 to 896 bytes
  CHECK(bus->health() == BusHealth::kStalled);
}

TEST_CASE("A frame of CAN FD, which is longer than any of ours, is passed over", "[vcan]") {
  if (skipped_without_vcan0() || skipped_without_root()) return;
  const OwnInterface interface("mtu 72 up");
  const auto bus = open_bus(interface.name(), BusRole::kJoin);
  canfd_frame frame{};
  frame.can_id = 0x181;
  frame.len = 64;
  put(interface.name(), frame);
  can_frame classic{};
  classic.can_id = 0x182;
  put(interface.name(), classic);
  Frame received;
  REQUIRE(wait_for(*bus, received));
  CHECK(received.id == 0x182);
}

#ifndef TENDRIL_SANITIZED
TEST_CASE("Sending and receiving on SocketCAN make no heap call", "[vcan]") {
  if (skipped_without_vcan0()) return;
  const Vcan vcan;
  const auto a = open_bus(vcan.name(), BusRole::kHost), b = open_bus(vcan.name(), BusRole::kJoin);
  std::array<Frame, 5> cycle{};
  const uint64_t before = test::heap_calls();
  const SendResult sent = a->send(cycle);
  const bool received = wait_for(*b, cycle, 5) == 5;
  const uint64_t made = test::heap_calls() - before;
  CHECK(made == 0);
  CHECK(sent == SendResult::kSent);
  CHECK(received);
}
#endif

}  // namespace tendril::hal::socketcan_test