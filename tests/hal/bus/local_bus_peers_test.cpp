// SPDX-License-Identifier: Apache-2.0
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>
#include <vector>

#include "hal/bus/open_bus.h"
#include "tests/hal/bus/local_bus.h"
#include "tests/patience.h"

// Who is on a local bus: hosts and joiners that come, go, die, or are no peers at all.

namespace tendril::hal::local_bus_peers_test {
using tendril::testing::kPatience_s;
using testing::now_ns, testing::RawJoiner, testing::SocketPath, testing::wait_for_local;

constexpr int64_t kShort_ns = 50'000'000;
const int64_t kLong_ns = std::llround(1e9 * kPatience_s);

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
    REQUIRE(wait_for_local(*bus, frame));
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
  CHECK(wait_for_local(*host, frame));
  CHECK(wait_for_local(*joiners[0], frame));
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
  CHECK(wait_for_local(*host, frame));
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
  REQUIRE(wait_for_local(*host, frame));
  CHECK(frame.id == 7);
  CHECK_FALSE(host->receive(frame));
  CHECK(host->send({.id = 8}) == SendResult::kSent);
  REQUIRE(wait_for_local(*b, frame));
  CHECK(frame.id == 7);
  REQUIRE(wait_for_local(*b, frame));
  CHECK(frame.id == 8);
  CHECK(host->health() == BusHealth::kActive);
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
  CHECK(wait_for_local(*host, frame));

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
  CHECK(wait_for_local(*host, frame));
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
        if (wait_for_local(*host, frame)) {
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
    REQUIRE(wait_for_local(*joiner, frame));
    CHECK(frame.data[0] == 2 * i);
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  CHECK_FALSE(joiner->receive(frame));
  CHECK(joiner->health() == BusHealth::kDown);
  CHECK_NOTHROW(open_bus(at.name(), BusRole::kHost));  // the killed host's socket is no obstacle
}

}  // namespace tendril::hal::local_bus_peers_test
