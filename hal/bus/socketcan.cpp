// SPDX-License-Identifier: Apache-2.0
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <vector>

#include "hal/bus/arrival_clock.h"
#include "hal/bus/bus_backends.h"
#include "hal/bus/can_wire.h"

namespace tendril::hal {
namespace {

// Asked for with SO_RCVBUF. The kernel doubles it and takes 640 to 768 bytes from it for each frame (its size
// is that of a socket buffer), which makes 341 to 410 frames: fewer than kMaxWaiting.
constexpr int kQueueBytes = 128 * 1024;
// What a frame that waits takes from SO_SNDBUF at most: 640 to 896 bytes, the size of a socket buffer. It is
// given back when the controller has taken the frame.
constexpr int kWaitingFrameBytes = 896;
// Messages that one system call moves.
constexpr int kBatch = 64;

/// What recvmmsg and sendmmsg work on, its parts linked once.
struct Messages {
  struct alignas(cmsghdr) Control {
    char bytes[CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(uint32_t))];
  };

  Messages() noexcept {
    for (int i = 0; i < kBatch; ++i) {
      parts[i] = {&wires[i], sizeof(can_frame)};
      headers[i].msg_hdr.msg_iov = &parts[i];
      headers[i].msg_hdr.msg_iovlen = 1;
    }
  }
  Messages(const Messages&) = delete;
  Messages& operator=(const Messages&) = delete;

  std::array<can_frame, kBatch> wires{};
  std::array<iovec, kBatch> parts{};
  std::array<Control, kBatch> controls{};
  std::array<mmsghdr, kBatch> headers{};
};

class SocketCan final : public Bus {
 public:
  SocketCan(Descriptor socket, std::string interface)
      : socket_(std::move(socket)), interface_(std::move(interface)) {}

  SendResult send(std::span<const Frame> frames) noexcept override {
    const auto too_long = std::find_if(frames.begin(), frames.end(),
                                       [](const Frame& frame) { return frame.length > CAN_MAX_DLEN; });
    const size_t dropped = frames.end() - too_long;
    frames = frames.first(frames.size() - dropped);
    send_dropped_ += dropped;
    while (!frames.empty()) {
      const size_t count = std::min<size_t>(frames.size(), kBatch);
      std::transform(frames.begin(), frames.begin() + count, outgoing_.wires.begin(), to_wire<can_frame>);
      size_t sent = 0;
      while (sent < count) {
        // It returns at the first frame that fails; the reason is told when that one is tried again.
        const int moved = ::sendmmsg(socket_.get(), &outgoing_.headers[sent],
                                     static_cast<unsigned>(count - sent), MSG_DONTWAIT);
        if (moved <= 0) return refused(frames.size() - sent);
        sent += moved;
        if (health_ == BusHealth::kDown) health_ = BusHealth::kActive;
      }
      frames = frames.subspan(count);
    }
    stalled_ = false;
    return dropped == 0 ? SendResult::kSent : SendResult::kQueueFull;
  }

  int receive(std::span<Frame> frames) noexcept override {
    const int room = static_cast<int>(frames.size());
    int taken = 0;
    for (int skipped = 0; taken < room && skipped < kMaxWaiting;) {
      const int wanted = std::min(room - taken, kBatch);
      clock_.look(read_clock_ns(CLOCK_MONOTONIC), read_clock_ns(CLOCK_REALTIME));
      const int count = read(wanted);
      for (int i = 0; i < count; ++i) {
        const int64_t stamp_ns = take_control(incoming_.headers[i].msg_hdr);
        const can_frame& wire = incoming_.wires[i];
        if (take_in(wire))
          frames[taken++] = from_wire(wire, clock_.arrival_ns(stamp_ns));
        else
          ++skipped;
      }
      if (count < wanted) {
        clock_.found_empty();
        break;
      }
    }
    return taken;
  }

  BusHealth health() const noexcept override {
    return stalled_ && health_ == BusHealth::kActive ? BusHealth::kStalled : health_;
  }
  uint64_t dropped() const noexcept override {
    return send_dropped_ + receive_dropped_ + controller_dropped_;
  }
  int descriptor() const noexcept override { return socket_.get(); }
  void limit_waiting(int frames) override {
    const int bytes = frames * kWaitingFrameBytes / 2;  // the kernel doubles it
    if (::setsockopt(socket_.get(), SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes) != 0)
      throw BusError(describe() + ": its queue cannot be limited: " + std::strerror(errno));
  }
  int transmit_queue() const override {
    ifreq request{};
    interface_.copy(request.ifr_name, IFNAMSIZ - 1);
    return ::ioctl(socket_.get(), SIOCGIFTXQLEN, &request) == 0 ? request.ifr_qlen : 0;
  }
  std::string describe() const override { return "CAN interface " + interface_; }

 private:
  /// After sendmmsg has failed: why, and what that means for the frames that are left.
  SendResult refused(size_t left) noexcept {
    // ENOBUFS: the interface's transmit queue, txqueuelen, is full; EAGAIN: the socket's.
    if (errno == ENOBUFS || errno == EAGAIN) {
      stalled_ = true;
      send_dropped_ += left;
      return SendResult::kQueueFull;
    }
    health_ = BusHealth::kDown;  // ENETDOWN; ENXIO and ENODEV where the interface is gone
    return SendResult::kDown;
  }

  /// Raw frames into `incoming_`.
  /// @return how many; fewer than wanted where the queue is empty
  int read(int wanted) noexcept {
    for (int i = 0; i < wanted; ++i) {
      incoming_.headers[i].msg_hdr.msg_control = &incoming_.controls[i];
      incoming_.headers[i].msg_hdr.msg_controllen = sizeof incoming_.controls[i];
    }
    const int count = ::recvmmsg(socket_.get(), incoming_.headers.data(), static_cast<unsigned>(wanted),
                                 MSG_DONTWAIT, nullptr);
    if (count < 0 && errno != EAGAIN && errno != EINTR) health_ = BusHealth::kDown;
    if (count <= 0) return 0;
    if (health_ == BusHealth::kDown) health_ = BusHealth::kActive;
    return count;
  }

  /// Notes the kernel's count of frames that the socket's queue had no room for.
  /// @return the kernel's stamp, ns of CLOCK_REALTIME
  int64_t take_control(msghdr& message) noexcept {
    timespec stamp{};
    for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr;
         header = CMSG_NXTHDR(&message, header)) {
      if (header->cmsg_type == SO_RXQ_OVFL)
        std::memcpy(&receive_dropped_, CMSG_DATA(header), sizeof receive_dropped_);
      else if (header->cmsg_type == SCM_TIMESTAMPNS)
        std::memcpy(&stamp, CMSG_DATA(header), sizeof stamp);
    }
    return to_ns(stamp);
  }

  /// @return whether it is a frame that somebody has sent
  bool take_in(const can_frame& wire) noexcept {
    if (wire.can_id & CAN_ERR_FLAG) judge(wire);
    return !(wire.can_id & CAN_ERR_FLAG);
  }

  /// What an error frame says of the controller [linux/can/error.h].
  void judge(const can_frame& error) noexcept {
    if (error.can_id & CAN_ERR_RESTARTED) health_ = BusHealth::kActive;
    if (error.can_id & CAN_ERR_CRTL) {
      const uint8_t state = error.data[1];
      if (state & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE))
        health_ = BusHealth::kPassive;
      else if (state & (CAN_ERR_CRTL_ACTIVE | CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING))
        health_ = BusHealth::kActive;
      if (state & (CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW)) ++controller_dropped_;
    }
    if (error.can_id & CAN_ERR_BUSOFF) health_ = BusHealth::kOff;
  }

  Descriptor socket_;
  std::string interface_;
  Messages incoming_, outgoing_;
  ArrivalClock clock_{read_clock_ns(CLOCK_MONOTONIC)};
  BusHealth health_ = BusHealth::kActive;
  bool stalled_ = false;  // the last `send` found no room
  uint64_t send_dropped_ = 0;
  uint64_t controller_dropped_ = 0;  // overflows of its own buffers; each may have cost several frames
  uint32_t receive_dropped_ = 0;
};

[[noreturn]] void refuse_socketcan(const std::string& what) { throw BusError(what); }

std::string reason() { return std::strerror(errno); }

/// A raw socket that hears the error frames which concern fault confinement.
Descriptor open_socket(const std::string& interface) {
  Descriptor socket(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  if (socket.get() < 0) {
    if (errno == EAFNOSUPPORT || errno == EPROTONOSUPPORT)
      refuse_socketcan(
          "cannot open '" + interface +
          "': this kernel has no CAN support; load it with `modprobe can-raw`, or use local:PATH");
    refuse_socketcan("cannot open a CAN socket for '" + interface + "': " + reason() +
                     "; run as a user who may, or grant CAP_NET_RAW");
  }
  const can_err_mask_t errors = CAN_ERR_CRTL | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED;
  const int on = 1;
  if (::setsockopt(socket.get(), SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) != 0 ||
      ::setsockopt(socket.get(), SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on) != 0 ||
      ::setsockopt(socket.get(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) != 0 ||
      ::setsockopt(socket.get(), SOL_SOCKET, SO_RCVBUF, &kQueueBytes, sizeof kQueueBytes) != 0)
    refuse_socketcan("cannot set up the CAN socket of '" + interface + "': " + reason());
  return socket;
}

/// Lets the kernel pass data frames of these identifiers only, or of all where there are none.
void filter(const Descriptor& socket, const std::string& interface, std::span<const uint32_t> wanted) {
  if (wanted.empty()) return;
  std::vector<can_filter> filters;
  static_assert(kExtendedMark == CAN_EFF_FLAG);
  for (const uint32_t id : wanted) {
    const canid_t bits = id & CAN_EFF_FLAG ? CAN_EFF_MASK : CAN_SFF_MASK;
    filters.push_back({id, bits | CAN_EFF_FLAG | CAN_RTR_FLAG});
  }
  const auto size = static_cast<socklen_t>(filters.size() * sizeof(can_filter));
  if (::setsockopt(socket.get(), SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), size) != 0)
    refuse_socketcan("cannot listen to " + std::to_string(wanted.size()) + " identifiers on '" + interface +
                     "': " + reason() + "; the kernel takes up to " + std::to_string(CAN_RAW_FILTER_MAX));
}

void require_up(const Descriptor& socket, const std::string& interface) {
  ifreq request{};
  interface.copy(request.ifr_name, IFNAMSIZ - 1);
  if (::ioctl(socket.get(), SIOCGIFFLAGS, &request) != 0)
    refuse_socketcan("cannot ask for the state of '" + interface + "': " + reason());
  if (!(request.ifr_flags & IFF_UP))
    refuse_socketcan("CAN interface '" + interface + "' is down; bring it up, e.g. `ip link set " +
                     interface + " up type can bitrate 1000000 restart-ms 100`");
  bool carrier = true;  // where nobody says so, as without /sys, it is
  std::ifstream("/sys/class/net/" + interface + "/carrier") >> carrier;
  if (!carrier)
    refuse_socketcan(
        "CAN interface '" + interface +
        "' is up, but its controller is bus-off; check cable, termination and bit rate, then `ip link set " +
        interface + " type can restart`");
}

}  // namespace

std::unique_ptr<Bus> open_socketcan(const std::string& interface, std::span<const uint32_t> wanted) {
  const unsigned index = interface.size() < IFNAMSIZ ? ::if_nametoindex(interface.c_str()) : 0;
  if (index == 0)
    refuse_socketcan("there is no CAN interface '" + interface +
                     "'; `ip link` lists them; use local:PATH where the kernel has no CAN");
  Descriptor socket = open_socket(interface);
  filter(socket, interface, wanted);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(index);
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    if (errno == ENODEV)
      refuse_socketcan("'" + interface + "' is not a CAN interface; `ip -details link` shows which are");
    refuse_socketcan("cannot bind to CAN interface '" + interface + "': " + reason());
  }
  require_up(socket, interface);
  return std::make_unique<SocketCan>(std::move(socket), interface);
}

}  // namespace tendril::hal
