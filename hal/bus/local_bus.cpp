// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <thread>

#include "hal/bus/bus_backends.h"
#include "hal/bus/can_wire.h"
#include "hal/bus/unix_address.h"

// A bus on a UNIX socket of packets, each with the frames of one call of `send`: the peer is woken once for
// all of them. The host, which is the robot, hands every packet of a joiner to all others, so that everyone
// hears everyone as on a wire.

namespace tendril::hal {
namespace {

constexpr int kMaxJoiners = 32;
// Packets that may wait for a host that does not read, where that is limited, and what each takes from
// SO_SNDBUF: up to 14 frames in each. Longer ones take more.
constexpr int kWaitingPackets = 16, kWaitingPacketBytes = 768;
constexpr auto kRetry = std::chrono::milliseconds(20);

/// Frames that travel together, one after the other: each the start of a canfd_frame, with its data filled up
/// to whole units of 8 bytes, at least one. Those of up to 8 bytes thus look like a can_frame.
struct Packet {
  static constexpr size_t kBytes = 16 * 128;  // a FrameBatch of classic frames fits

  int64_t stamp_ns;  // when they were sent, which on this bus is when they arrive; CLOCK_MONOTONIC
  std::array<std::byte, kBytes> frames;

  static size_t size_of(size_t bytes) noexcept { return offsetof(Packet, frames) + bytes; }
};

constexpr size_t kHeadBytes = offsetof(canfd_frame, data);

/// Bytes of a frame in a packet.
size_t size_in_packet(uint8_t length) noexcept {
  return kHeadBytes + std::max<size_t>(8, (length + size_t{7}) / 8 * 8);
}

/// Bytes of the frame at the front of some; 0 where they do not begin with a whole frame, of data or remote.
size_t size_of_frame(std::span<const std::byte> bytes) noexcept {
  if (bytes.size() < kHeadBytes) return 0;
  canfd_frame head{};
  std::memcpy(&head, bytes.data(), kHeadBytes);
  if (head.len > kMaxFrameBytes || (head.can_id & CAN_ERR_FLAG) != 0) return 0;
  const size_t size = size_in_packet(head.len);
  return size <= bytes.size() ? size : 0;
}

/// A packet and how much of it is used.
struct Load {
  Packet packet;
  size_t bytes = 0;  // of frames
  int count = 0;     // frames

  /// @return  false where there is no room
  bool push(const Frame& frame) noexcept {
    const auto wire = to_wire<canfd_frame>(frame);
    const size_t size = size_in_packet(wire.len);
    if (bytes + size > Packet::kBytes) return false;
    std::memcpy(packet.frames.data() + bytes, &wire, size);
    bytes += size;
    ++count;
    return true;
  }
};

enum class Moved { kYes, kNotNow, kGone };

Moved write_packet(int fd, const Load& load) noexcept {
  const size_t size = Packet::size_of(load.bytes);
  if (::send(fd, &load.packet, size, MSG_DONTWAIT | MSG_NOSIGNAL) == static_cast<ssize_t>(size))
    return Moved::kYes;
  return errno == EAGAIN || errno == ENOBUFS || errno == EINTR ? Moved::kNotNow : Moved::kGone;
}

/// A packet that is not made of whole frames, or holds an error frame, is from no peer of ours.
Moved read_packet(int fd, Load& load) noexcept {
  const ssize_t size = ::recv(fd, &load.packet, sizeof load.packet, MSG_DONTWAIT | MSG_TRUNC);
  if (size < 0) return errno == EAGAIN || errno == EINTR ? Moved::kNotNow : Moved::kGone;
  if (size <= static_cast<ssize_t>(Packet::size_of(0)) || size > static_cast<ssize_t>(sizeof load.packet))
    return Moved::kGone;
  load.bytes = static_cast<size_t>(size) - Packet::size_of(0);
  load.count = 0;
  std::span<const std::byte> left(load.packet.frames.data(), load.bytes);
  for (; !left.empty(); ++load.count) {
    const size_t size_of_next = size_of_frame(left);
    if (size_of_next == 0) return Moved::kGone;
    left = left.subspan(size_of_next);
  }
  return Moved::kYes;
}

/// Splits frames into packets and moves each with `move` until one cannot be moved.
/// @return how many frames were moved
template <typename Move>
int move_in_packets(std::span<const Frame> frames, Move move) noexcept {
  int moved = 0;
  Load load;
  load.packet.stamp_ns = read_clock_ns(CLOCK_MONOTONIC);
  while (!frames.empty()) {
    load.bytes = 0;
    load.count = 0;
    while (load.count < static_cast<int>(frames.size()) && load.push(frames[load.count])) {
    }
    if (!move(load)) break;
    moved += load.count;
    frames = frames.subspan(load.count);
  }
  return moved;
}

/// The packet that is being taken apart.
class Inbox {
 public:
  bool empty() const noexcept { return next_ == load_.bytes; }
  Frame take() noexcept {
    canfd_frame wire{};
    const auto left = std::span(load_.packet.frames).first(load_.bytes).subspan(next_);
    const size_t size = size_of_frame(left);  // read_packet has found it whole
    std::memcpy(&wire, left.data(), size);
    next_ += size;
    return from_wire(wire, load_.packet.stamp_ns);
  }
  /// The next packet of a peer takes the place of this one, which is empty.
  Moved fill(int fd) noexcept {
    const Moved moved = read_packet(fd, load_);
    if (moved != Moved::kYes) load_.bytes = 0;
    // A peer may claim any instant. Nothing arrives after it is read, and no age may overflow.
    int64_t& stamp_ns = load_.packet.stamp_ns;
    if (moved == Moved::kYes) stamp_ns = std::clamp<int64_t>(stamp_ns, 0, read_clock_ns(CLOCK_MONOTONIC));
    next_ = 0;
    return moved;
  }
  const Load& load() const noexcept { return load_; }

 private:
  Load load_;
  size_t next_ = 0;
};

class LocalJoiner final : public Bus {
 public:
  LocalJoiner(Descriptor socket, std::string path) : socket_(std::move(socket)), path_(std::move(path)) {}

  SendResult send(std::span<const Frame> frames) noexcept override {
    if (gone_) return SendResult::kDown;
    Moved last = Moved::kYes;
    const int sent = move_in_packets(frames, [&](const Load& load) {
      last = write_packet(socket_.get(), load);
      return last == Moved::kYes;
    });
    stalled_ = last == Moved::kNotNow;
    if (last == Moved::kYes) return SendResult::kSent;
    gone_ = last == Moved::kGone;
    if (gone_) return SendResult::kDown;
    dropped_ += frames.size() - sent;
    return SendResult::kQueueFull;
  }

  int receive(std::span<Frame> frames) noexcept override {
    int taken = 0;
    for (Frame& frame : frames) {
      if (inbox_.empty()) {
        const Moved moved = inbox_.fill(socket_.get());
        gone_ = gone_ || moved == Moved::kGone;
        if (moved != Moved::kYes) break;
      }
      frame = inbox_.take();
      ++taken;
    }
    return taken;
  }

  BusHealth health() const noexcept override {
    if (gone_) return BusHealth::kDown;
    return stalled_ ? BusHealth::kStalled : BusHealth::kActive;
  }
  uint64_t dropped() const noexcept override { return dropped_; }
  int descriptor() const noexcept override { return socket_.get(); }
  std::string describe() const override { return "local bus at " + path_; }
  /// The host is a program, which others may keep from the CPU for some milliseconds: more cycles may wait
  /// for it than for a bus. One waits as a packet.
  void limit_waiting(int /*frames*/) override {
    constexpr int kBytes = kWaitingPackets * kWaitingPacketBytes / 2;  // the kernel doubles it
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_SNDBUF, &kBytes, sizeof kBytes);
  }

 private:
  Descriptor socket_;
  std::string path_;
  Inbox inbox_;
  bool gone_ = false;     // the host does not come back under this socket
  bool stalled_ = false;  // the last `send` found no room
  uint64_t dropped_ = 0;
};

class LocalHost final : public Bus {
 public:
  LocalHost(Descriptor listener, Descriptor poller, std::string path)
      : listener_(std::move(listener)), poller_(std::move(poller)), path_(std::move(path)) {}

  ~LocalHost() override {
    ::unlink(path_.c_str());
    while (joiners_ > 0) remove(0);
  }

  SendResult send(std::span<const Frame> frames) noexcept override {
    move_in_packets(frames, [this](const Load& load) {
      broadcast(load, -1);
      return true;
    });
    return SendResult::kSent;  // as on a wire: the sender does not learn who had no room
  }

  int receive(std::span<Frame> frames) noexcept override {
    int taken = 0;
    for (Frame& frame : frames) {
      if (inbox_.empty() && !fill_inbox()) break;
      frame = inbox_.take();
      ++taken;
    }
    return taken;
  }

  BusHealth health() const noexcept override { return BusHealth::kActive; }
  uint64_t dropped() const noexcept override { return dropped_; }
  int descriptor() const noexcept override { return poller_.get(); }
  std::string describe() const override { return "local bus at " + path_ + ", host"; }

 private:
  void accept_one() noexcept {
    const int fd = ::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0 && (errno == EMFILE || errno == ENFILE)) return refuse_one();
    if (fd < 0) return;
    epoll_event event{};
    event.events = EPOLLIN;
    if (joiners_ == kMaxJoiners || ::epoll_ctl(poller_.get(), EPOLL_CTL_ADD, fd, &event) != 0)
      ::close(fd);
    else
      fds_[joiners_++] = fd;
  }

  /// Without a free descriptor: one who waits at the door would keep the bus readable for ever.
  void refuse_one() noexcept {
    spare_ = Descriptor(-1);
    if (const int fd = ::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC); fd >= 0) ::close(fd);
    spare_ = Descriptor(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  }

  /// Fetches the packet of the joiner whose turn it is and relays it. @return false where nobody has any
  bool fill_inbox() noexcept {
    accept_one();
    for (int tried = 0; tried < joiners_;) {
      next_ = next_ < joiners_ ? next_ : 0;
      switch (inbox_.fill(fds_[next_])) {
        case Moved::kYes:
          broadcast(inbox_.load(), fds_[next_]);
          ++next_;  // the others are heard before this one is heard again
          return true;
        case Moved::kNotNow:
          ++next_, ++tried;
          break;
        case Moved::kGone:
          remove(next_);
          break;
      }
    }
    return false;
  }

  /// Who turns out to be gone is removed when it is next read.
  void broadcast(const Load& load, int except) noexcept {
    for (int i = 0; i < joiners_; ++i)
      if (fds_[i] != except && write_packet(fds_[i], load) == Moved::kNotNow) dropped_ += load.count;
  }

  void remove(int i) noexcept {
    ::close(fds_[i]);
    fds_[i] = fds_[--joiners_];
  }

  Descriptor listener_, poller_;
  Descriptor spare_{::open("/dev/null", O_RDONLY | O_CLOEXEC)};  // given up for a moment in refuse_one
  std::string path_;
  std::array<int, kMaxJoiners> fds_{};
  Inbox inbox_;
  int joiners_ = 0;
  int next_ = 0;  // whose turn it is
  uint64_t dropped_ = 0;
};

[[noreturn]] void refuse_local(const std::string& what) { throw BusError(what); }

std::string reason(int error) { return std::strerror(error); }

Descriptor open_socket() {
  Descriptor socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (socket.get() < 0) refuse_local("cannot open a local socket: " + reason(errno));
  return socket;
}

/// errno of a try to connect, 0 for success.
int try_connect(const Descriptor& socket, const UnixAddress& address) noexcept {
  return ::connect(socket.get(), address.get(), address.size) == 0 ? 0 : errno;
}

/// Removes what a host that died left at the path; anything else there stays and is an error.
void clear_stale(const std::string& path, const UnixAddress& address) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) return;
  if (!S_ISSOCK(status.st_mode)) refuse_local("'" + path + "' exists and is no socket; choose another path");
  const int error = try_connect(open_socket(), address);
  if (error != ECONNREFUSED)
    refuse_local("a local bus at '" + path +
                 "' has a host already; stop that program or choose another path");
  ::unlink(path.c_str());
}

}  // namespace

std::unique_ptr<Bus> host_local_bus(const std::string& path) {
  const UnixAddress address = unix_address(path);
  clear_stale(path, address);
  Descriptor listener = open_socket();
  if (::bind(listener.get(), address.get(), address.size) != 0 || ::listen(listener.get(), kMaxJoiners) != 0)
    refuse_local("cannot listen at '" + path + "': " + reason(errno) +
                 "; the folder must exist and be writable");
  Descriptor poller(::epoll_create1(EPOLL_CLOEXEC));
  epoll_event event{};
  event.events = EPOLLIN;
  if (poller.get() < 0 || ::epoll_ctl(poller.get(), EPOLL_CTL_ADD, listener.get(), &event) != 0)
    refuse_local("cannot watch the local bus at '" + path + "': " + reason(errno));
  return std::make_unique<LocalHost>(std::move(listener), std::move(poller), path);
}

std::unique_ptr<Bus> join_local_bus(const std::string& path, int64_t wait_ns) {
  const UnixAddress address = unix_address(path);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::nanoseconds(wait_ns);
  while (true) {
    Descriptor socket = open_socket();
    const int error = try_connect(socket, address);
    if (error == 0) return std::make_unique<LocalJoiner>(std::move(socket), path);
    const bool may_come = error == ENOENT || error == ECONNREFUSED || error == EAGAIN;
    if (!may_come) refuse_local("cannot join the local bus at '" + path + "': " + reason(error));
    if (std::chrono::steady_clock::now() >= deadline) break;
    std::this_thread::sleep_for(kRetry);
  }
  refuse_local("nobody has hosted a local bus at '" + path + "' for " + std::to_string(wait_ns / 1'000'000) +
               " ms; start the plant first (tendril-plant), or check the path");
}

}  // namespace tendril::hal
