// SPDX-License-Identifier: Apache-2.0
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <memory>

#include "hal/bus/open_bus.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/inputs.h"
#include "tests/fuzz/scratch.h"

namespace tendril::fuzz {
namespace {

int64_t monotonic_ns() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

/// A process that speaks no language of ours.
class Stranger {
 public:
  Stranger() = default;
  ~Stranger() { leave(); }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;

  void join(const std::string& path) {
    leave();
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    socket_ = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    must(::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
             errno == EAGAIN,
         "a bus can be joined");
  }
  void leave() {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
  }
  void send(std::string_view packet) const {
    if (socket_ >= 0) static_cast<void>(::send(socket_, packet.data(), packet.size(), MSG_NOSIGNAL));
  }

 private:
  int socket_ = -1;
};

void check_frame(const hal::Frame& frame) {
  must(frame.length <= hal::kMaxFrameBytes, "a frame is no longer than the longest");
  must(!frame.remote || frame.length == 0, "a remote frame has no data");
  must(frame.id <= (frame.extended ? 0x1FFF'FFFFu : 0x7FFu), "an identifier fits its format");
  must(frame.stamp_ns >= 0 && frame.stamp_ns <= monotonic_ns(), "a frame arrives before it is read");
}

void drain(hal::Bus& bus) {
  std::array<hal::Frame, 64> frames;
  for (int count = 1; count > 0;) {
    count = bus.receive(frames);
    for (int k = 0; k < count; ++k) check_frame(frames[k]);
  }
}

}  // namespace

bool feed_local_bus(const std::string& bytes) {
  const std::string path = scratch_path("bus"), name = "local:" + path;
  const auto host = hal::open_bus(name, hal::BusRole::kHost);
  const auto peer = hal::open_bus(name, hal::BusRole::kJoin);
  std::array<Stranger, 3> strangers;
  for (Bytes left(bytes); !left.empty();) {
    const uint8_t step = left.byte();
    Stranger& stranger = strangers[(step >> 4) % strangers.size()];
    switch (step & 7) {
      case 0:
      case 1:
        stranger.join(path);
        break;
      case 2:
        stranger.leave();
        break;
      case 3:
      case 4:
        stranger.send(left.take(left.byte()));
        break;
      case 5:
        stranger.send(std::string(left.byte() * 16, static_cast<char>(left.byte())));
        break;
      default:
        drain(*host);
        drain(*peer);
        break;
    }
  }
  drain(*host);
  drain(*peer);
  must(peer->send(hal::Frame{.id = 0x123, .length = 1}) == hal::SendResult::kSent, "a peer can send");
  hal::Frame frame;
  bool heard = false;
  for (int k = 0; k < 64 && !heard; ++k) heard = host->receive(frame) && frame.id == 0x123;
  must(heard, "strangers keep no peer from the host");
  must(host->send(hal::Frame{.id = 0x321}) == hal::SendResult::kSent, "the host can send");
  heard = false;
  for (int k = 0; k < 64 && !heard; ++k) heard = peer->receive(frame) && frame.id == 0x321;
  must(heard, "strangers keep the host from no peer");
  must(peer->health() == hal::BusHealth::kActive, "strangers end no bus");
  return true;
}

}  // namespace tendril::fuzz
