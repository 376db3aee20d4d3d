// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <string>

#include "hal/bus/open_bus.h"
#include "tests/own_folder.h"
#include "tests/patience.h"

namespace tendril::hal::testing {

/// A path for a socket in a fresh folder that goes away with it.
struct SocketPath {
  std::string path() const { return (folder / "bus").string(); }
  std::string name() const { return "local:" + path(); }
  tendril::testing::OwnFolder folder;
};

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

inline int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

/// Receives from a local bus within a generous time, also where its other side may have gone.
inline bool wait_for_local(Bus& bus, Frame& frame) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::duration<double>(tendril::testing::kPatience_s);
  while (!bus.receive(frame)) {
    if (Clock::now() > deadline) return false;
    pollfd descriptor{bus.descriptor(), POLLIN, 0};
    ::poll(&descriptor, 1, 10);
  }
  return true;
}

}  // namespace tendril::hal::testing
