// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <time.h>
#include <unistd.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "hal/bus/bus.h"

/// What open_bus chooses from. Private to hal.
namespace tendril::hal {

/// Opens a CAN interface that is up, for data frames of these identifiers, or for all frames. @throws
/// BusError. Real-time: no.
std::unique_ptr<Bus> open_socketcan(const std::string& interface, std::span<const uint32_t> wanted);

/// Listens at a path of the file system. @throws BusError. Real-time: no.
std::unique_ptr<Bus> host_local_bus(const std::string& path);

/// Connects to the host that listens at a path, for up to `wait_ns`. @throws BusError. Real-time: no.
std::unique_ptr<Bus> join_local_bus(const std::string& path, int64_t wait_ns);

/// Real-time: yes.
inline int64_t to_ns(const timespec& time) noexcept {
  return 1'000'000'000 * static_cast<int64_t>(time.tv_sec) + time.tv_nsec;
}

/// What a clock shows, ns. Real-time: yes.
inline int64_t read_clock_ns(clockid_t clock) noexcept {
  timespec now{};
  ::clock_gettime(clock, &now);
  return to_ns(now);
}

/// A file descriptor with an owner.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) noexcept : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const noexcept { return fd_; }

 private:
  int fd_;
};

}  // namespace tendril::hal
