#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "hal/bus_backends.h"
#include "hal/can_wire.h"

namespace tendril::hal {
namespace {

// Error and remote frames that one call of `receive` skips before it lets the caller go on.
constexpr int kSkipLimit = 32;

class SocketCan final : public Bus {
 public:
  SocketCan(Descriptor socket, std::string interface)
      : socket_(std::move(socket)), interface_(std::move(interface)) {}

  SendResult send(const Frame& frame) noexcept override {
    const can_frame wire = to_wire(frame);
    if (::send(socket_.get(), &wire, sizeof wire, MSG_DONTWAIT) == sizeof wire) {
      if (health_ == BusHealth::kDown) health_ = BusHealth::kActive;
      return SendResult::kSent;
    }
    // ENOBUFS: the interface's transmit queue, txqueuelen, is full; EAGAIN: the socket's.
    if (errno == ENOBUFS || errno == EAGAIN) {
      ++send_dropped_;
      return SendResult::kQueueFull;
    }
    health_ = BusHealth::kDown;  // ENETDOWN; ENXIO and ENODEV where the interface is gone
    return SendResult::kDown;
  }

  bool receive(Frame& frame) noexcept override {
    for (int skipped = 0; skipped < kSkipLimit; ++skipped) {
      can_frame wire;
      if (!read(wire)) return false;
      if (health_ == BusHealth::kDown) health_ = BusHealth::kActive;
      if (wire.can_id & CAN_ERR_FLAG) {
        judge(wire);
      } else if (!(wire.can_id & CAN_RTR_FLAG)) {
        frame = from_wire(wire);
        return true;
      }
    }
    return false;
  }

  BusHealth health() const noexcept override { return health_; }
  uint64_t dropped() const noexcept override { return send_dropped_ + receive_dropped_; }
  int descriptor() const noexcept override { return socket_.get(); }
  std::string describe() const override { return "CAN interface " + interface_; }

 private:
  /// One raw frame, with the kernel's count of those the socket's queue had no room for.
  bool read(can_frame& wire) noexcept {
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(uint32_t))];
    iovec part{&wire, sizeof wire};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof control;
    const ssize_t size = ::recvmsg(socket_.get(), &message, MSG_DONTWAIT);
    if (size < 0 && errno != EAGAIN && errno != EINTR) health_ = BusHealth::kDown;
    if (size != sizeof wire) return false;
    const cmsghdr* header = CMSG_FIRSTHDR(&message);
    if (header != nullptr && header->cmsg_type == SO_RXQ_OVFL)
      std::memcpy(&receive_dropped_, CMSG_DATA(header), sizeof receive_dropped_);
    return true;
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
    }
    if (error.can_id & CAN_ERR_BUSOFF) health_ = BusHealth::kOff;
  }

  Descriptor socket_;
  std::string interface_;
  BusHealth health_ = BusHealth::kActive;
  uint64_t send_dropped_ = 0;
  uint32_t receive_dropped_ = 0;
};

[[noreturn]] void refuse(const std::string& what) { throw BusError(what); }

std::string reason() { return std::strerror(errno); }

/// A raw socket that hears the error frames which concern fault confinement.
Descriptor open_socket(const std::string& interface) {
  Descriptor socket(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  if (socket.get() < 0) {
    if (errno == EAFNOSUPPORT || errno == EPROTONOSUPPORT)
      refuse("cannot open '" + interface +
             "': this kernel has no CAN support; load it with `modprobe can-raw`, or use local:PATH");
    refuse("cannot open a CAN socket for '" + interface + "': " + reason() +
           "; run as a user who may, or grant CAP_NET_RAW");
  }
  const can_err_mask_t errors = CAN_ERR_CRTL | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED;
  const int on = 1;
  if (::setsockopt(socket.get(), SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) != 0 ||
      ::setsockopt(socket.get(), SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on) != 0)
    refuse("cannot set up the CAN socket of '" + interface + "': " + reason());
  return socket;
}

void require_up(const Descriptor& socket, const std::string& interface) {
  ifreq request{};
  interface.copy(request.ifr_name, IFNAMSIZ - 1);
  if (::ioctl(socket.get(), SIOCGIFFLAGS, &request) != 0)
    refuse("cannot ask for the state of '" + interface + "': " + reason());
  if (!(request.ifr_flags & IFF_UP))
    refuse("CAN interface '" + interface + "' is down; bring it up, e.g. `ip link set " + interface +
           " up type can bitrate 1000000 restart-ms 100`");
}

}  // namespace

std::unique_ptr<Bus> open_socketcan(const std::string& interface) {
  const unsigned index = interface.size() < IFNAMSIZ ? ::if_nametoindex(interface.c_str()) : 0;
  if (index == 0)
    refuse("there is no CAN interface '" + interface +
           "'; `ip link` lists them; use local:PATH where the kernel has no CAN");
  Descriptor socket = open_socket(interface);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(index);
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    if (errno == ENODEV)
      refuse("'" + interface + "' is not a CAN interface; `ip -details link` shows which are");
    refuse("cannot bind to CAN interface '" + interface + "': " + reason());
  }
  require_up(socket, interface);
  return std::make_unique<SocketCan>(std::move(socket), interface);
}

}  // namespace tendril::hal
