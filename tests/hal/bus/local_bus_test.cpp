#include <poll.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>
#include <catch2/catch.hpp>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "hal/bus/open_bus.h"
#include "tests/hal/heap_count.h"
#include "tests/own_folder.h"
#include "tests/patience.h"

namespace tendril::hal::local_bus_test {
using tendril::testing::kPatience_s;

/// A path for a socket in a fresh folder that goes away with it.
struct SocketPath {
  std::string path() const { return (folder / "bus").string(); }
  std::string name() const { return "local:" + path(); }
  tendril::testing::OwnFolder folder;
};

/// Receives within a generous time.
bool wait_for(Bus& bus, Frame& frame) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::duration<double>(kPatience_s);
  while (!bus.receive(frame)) {
    if (Clock::now() > deadline) return false;
    pollfd descriptor{bus.descriptor(), POLLIN, 0};
    ::poll(&descriptor, 1, 10);
  }
  return true;
}

/// What joins a local bus without speaking its language; closed with the object.
struct RawJoiner {
  explicit RawJoiner(const SocketPath& at) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    at.path().copy(address.sun_path, sizeof address.sun_path - 1);
    REQUIRE(::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  ~RawJoiner() { ::close(fd); }
  int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0);
};

int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

constexpr int64_t kShort_ns = 50'000'000;
const int64_t kLong_ns = std::llround(1e9 * kPatience_s);

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

TEST_CASE("What speaks another language on a local bus is cut off, and the others go on", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  const auto joiner = open_bus(at.name(), BusRole::kJoin);
  const std::vector<char> packet(GENERATE(1, 100'000), 'x');
  const RawJoiner raw(at);
  Frame frame;
  CHECK_FALSE(host->receive(frame));
  REQUIRE(::send(raw.fd, packet.data(), packet.size(), MSG_NOSIGNAL) > 0);
  CHECK_FALSE(host->receive(frame));
  CHECK_FALSE(host->receive(frame));
  CHECK(::send(raw.fd, packet.data(), packet.size(), MSG_NOSIGNAL) < 0);
  REQUIRE(joiner->send({.id = 3}) == SendResult::kSent);
  CHECK(host->receive(frame));
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

TEST_CASE("A frame on a local bus arrives before it is read, whatever its sender says", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost), joiner = open_bus(at.name(), BusRole::kJoin);
  const RawJoiner raw(at);
  const int64_t stamp_ns = GENERATE(INT64_MIN, -1, INT64_MAX);
  std::array<char, 8 + 16> packet{};  // a stamp and a frame without data
  std::memcpy(packet.data(), &stamp_ns, sizeof stamp_ns);
  Frame frame;
  CHECK_FALSE(host->receive(frame));
  REQUIRE(::send(raw.fd, packet.data(), packet.size(), MSG_NOSIGNAL) > 0);
  for (Bus* bus : {host.get(), joiner.get()}) {
    REQUIRE(wait_for(*bus, frame));
    CHECK(frame.stamp_ns >= 0);
    CHECK(frame.stamp_ns <= now_ns());
  }
}

TEST_CASE("A packet on a local bus whose last frame is cut short is from no peer", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  const int cut = GENERATE(1, 8, 15);
  const RawJoiner raw(at);
  Frame frame;
  CHECK_FALSE(host->receive(frame));
  std::array<char, 8 + 2 * 16> packet{};  // a stamp and two frames without data
  REQUIRE(::send(raw.fd, packet.data(), packet.size() - cut, MSG_NOSIGNAL) > 0);
  CHECK_FALSE(host->receive(frame));
  CHECK(::send(raw.fd, packet.data(), packet.size(), MSG_NOSIGNAL) < 0);
}

TEST_CASE("A remote frame on a local bus is one", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost), joiner = open_bus(at.name(), BusRole::kJoin);
  REQUIRE(joiner->send(*parse_frame("049#R")) == SendResult::kSent);
  Frame frame;
  REQUIRE(wait_for(*host, frame));
  CHECK(to_text(frame) == "049#R");
}

TEST_CASE("Everyone on a local bus hears everyone else", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  const auto a = open_bus(at.name(), BusRole::kJoin), b = open_bus(at.name(), BusRole::kJoin);
  Frame frame;
  const Frame from_a = *parse_frame("202#0F0010270000"), from_host = *parse_frame("1FFFFFF0#01");
  REQUIRE(a->send(from_a) == SendResult::kSent);
  REQUIRE(wait_for(*host, frame));
  CHECK(frame == from_a);
  // b had connected before but is only known to the host once it has looked for it.
  REQUIRE_FALSE(host->receive(frame));
  REQUIRE(a->send(from_a) == SendResult::kSent);
  REQUIRE(wait_for(*host, frame));
  REQUIRE(wait_for(*b, frame));
  CHECK(frame == from_a);
  CHECK_FALSE(a->receive(frame));  // not its own
  REQUIRE(host->send(from_host) == SendResult::kSent);
  REQUIRE(wait_for(*a, frame));
  CHECK(frame == from_host);
  REQUIRE(wait_for(*b, frame));
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

TEST_CASE("A joiner learns that its host is gone", "[unit]") {
  const SocketPath at;
  auto host = open_bus(at.name(), BusRole::kHost);
  const auto joiner = open_bus(at.name(), BusRole::kJoin);
  Frame frame;
  host->receive(frame);
  CHECK(joiner->health() == BusHealth::kActive);
  host.reset();
  CHECK_FALSE(joiner->receive(frame));
  CHECK(joiner->health() == BusHealth::kDown);
  CHECK(joiner->send({.id = 1}) == SendResult::kDown);
  CHECK_FALSE(std::filesystem::exists(at.path()));
}

TEST_CASE("More joiners than a local bus holds are turned away, and the others go on", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  std::vector<std::unique_ptr<Bus>> joiners;
  Frame frame;
  for (int i = 0; i < 40; ++i) {
    joiners.push_back(open_bus(at.name(), BusRole::kJoin));
    host->receive(frame);
  }
  for (int i = 0; i < 40; ++i) {
    CAPTURE(i);
    joiners[i]->receive(frame);
    CHECK(joiners[i]->health() == (i < 32 ? BusHealth::kActive : BusHealth::kDown));
  }
  REQUIRE(joiners[31]->send({.id = 7}) == SendResult::kSent);
  CHECK(wait_for(*host, frame));
  CHECK(wait_for(*joiners[0], frame));
  CHECK(frame.id == 7);
}

#ifndef TENDRIL_SANITIZED  // they take descriptors to look at an object
TEST_CASE("A host without a free descriptor turns joiners away instead of being woken for ever", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  const RawJoiner first(at), second(at);
  rlimit before{};
  REQUIRE(::getrlimit(RLIMIT_NOFILE, &before) == 0);
  const rlimit none_free{static_cast<rlim_t>(::dup(0)), before.rlim_max};
  ::close(static_cast<int>(none_free.rlim_cur));
  REQUIRE(::setrlimit(RLIMIT_NOFILE, &none_free) == 0);
  Frame frame;
  for (int i = 0; i < 3; ++i) host->receive(frame);
  pollfd descriptor{host->descriptor(), POLLIN, 0};
  const int readable = ::poll(&descriptor, 1, 0);
  REQUIRE(::setrlimit(RLIMIT_NOFILE, &before) == 0);
  CHECK(readable == 0);
  const auto later = open_bus(at.name(), BusRole::kJoin);
  REQUIRE(later->send({.id = 9}) == SendResult::kSent);
  CHECK(wait_for(*host, frame));
}
#endif

TEST_CASE("A host goes on when a joiner has gone, and takes its frames to the last", "[unit]") {
  const SocketPath at;
  const auto host = open_bus(at.name(), BusRole::kHost);
  auto a = open_bus(at.name(), BusRole::kJoin);
  const auto b = open_bus(at.name(), BusRole::kJoin);
  Frame frame;
  while (host->receive(frame)) {
  }
  host->receive(frame);
  a->send({.id = 7});
  a.reset();
  REQUIRE(wait_for(*host, frame));
  CHECK(frame.id == 7);
  CHECK_FALSE(host->receive(frame));
  CHECK(host->send({.id = 8}) == SendResult::kSent);
  REQUIRE(wait_for(*b, frame));
  CHECK(frame.id == 7);
  REQUIRE(wait_for(*b, frame));
  CHECK(frame.id == 8);
  CHECK(host->health() == BusHealth::kActive);
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
  REQUIRE(wait_for(*host, frame));
  CHECK(frame.data[0] == sent);
}

TEST_CASE("A stale socket is replaced, a live one and a file are not", "[unit]") {
  const SocketPath at;
  {
    const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    at.path().copy(address.sun_path, sizeof address.sun_path - 1);
    REQUIRE(::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    ::close(fd);  // as a host that was killed leaves it
  }
  REQUIRE(std::filesystem::exists(at.path()));
  const auto host = open_bus(at.name(), BusRole::kHost);
  CHECK_THROWS_WITH(open_bus(at.name(), BusRole::kHost), Catch::Contains("has a host already"));
  const auto joiner = open_bus(at.name(), BusRole::kJoin);
  CHECK(joiner->send({.id = 1}) == SendResult::kSent);
  Frame frame;
  CHECK(wait_for(*host, frame));

  const std::string file = at.path() + ".txt";
  std::ofstream(file) << "precious";
  CHECK_THROWS_WITH(open_bus("local:" + file, BusRole::kHost), Catch::Contains("is no socket"));
  CHECK(std::filesystem::exists(file));
}

TEST_CASE("A joiner without a host says what to start", "[unit]") {
  const SocketPath at;
  CHECK_THROWS_WITH(
      open_bus(at.name(), BusRole::kJoin, {}, kShort_ns),
      Catch::Contains(at.path()) && Catch::Contains("50 ms") && Catch::Contains("start the plant"));
  CHECK_THROWS_WITH(open_bus("local:", BusRole::kJoin, {}, kShort_ns), Catch::Contains("1 to 107 bytes"));
  CHECK_THROWS_WITH(open_bus("local:" + std::string(200, 'x'), BusRole::kHost),
                    Catch::Contains("1 to 107 bytes") && Catch::Contains("has 200"));
  CHECK_THROWS_WITH(open_bus("local:" + (at.folder / "absent/bus").string(), BusRole::kHost),
                    Catch::Contains("folder must exist"));
}

TEST_CASE("A joiner waits for a host that comes later", "[unit]") {
  const SocketPath at;
  std::unique_ptr<Bus> joiner;
  std::thread thread([&] { joiner = open_bus(at.name(), BusRole::kJoin, {}, kLong_ns); });
  // So that it waits already. Where it comes to that later, the host is there before it, and this shows less.
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const auto host = open_bus(at.name(), BusRole::kHost);
  thread.join();
  REQUIRE(joiner);
  CHECK(joiner->send({.id = 5}) == SendResult::kSent);
  Frame frame;
  CHECK(wait_for(*host, frame));
}

TEST_CASE("Two processes talk over a local bus, and the death of one is seen", "[unit]") {
  const SocketPath at;
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {  // a host that doubles the first byte until it is killed; no Catch2 in here
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // it does not outlive a test that fails
    try {
      const auto host = open_bus(at.name(), BusRole::kHost);
      Frame frame;
      while (true)
        if (wait_for(*host, frame)) {
          frame.data[0] = static_cast<uint8_t>(2 * frame.data[0]);
          host->send(frame);
        }
    } catch (...) {
    }
    ::_exit(1);
  }
  const auto joiner = open_bus(at.name(), BusRole::kJoin, {}, kLong_ns);
  Frame frame;
  for (int i = 1; i <= 100; ++i) {
    REQUIRE(joiner->send({.id = 1, .length = 1, .data = {static_cast<uint8_t>(i)}}) == SendResult::kSent);
    REQUIRE(wait_for(*joiner, frame));
    CHECK(frame.data[0] == 2 * i);
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  CHECK_FALSE(joiner->receive(frame));
  CHECK(joiner->health() == BusHealth::kDown);
  CHECK_NOTHROW(open_bus(at.name(), BusRole::kHost));  // the killed host's socket is no obstacle
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
  while (next < kFrames && wait_for(*host, frame) && frame.id == (next & 0x7FF)) ++next;
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
  moved = wait_for(*host, frame) && moved;
  host->send({.id = 2});
  moved = wait_for(*joiner, frame) && moved;
  const uint64_t made = test::heap_calls() - before;
  CHECK(made == 0);
  CHECK(moved);
}
#endif

}  // namespace tendril::hal::local_bus_test
