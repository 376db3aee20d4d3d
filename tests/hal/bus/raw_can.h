// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <string>

/// CAN interfaces as their driver, another program or their administrator would treat them.
namespace tendril::hal::testing {

/// Puts a frame, can_frame or canfd_frame, on an interface as it stands, also one that no `Bus` would send.
void put(const std::string& interface, const auto& frame) {
  const int fd = ::socket(PF_CAN, SOCK_RAW, CAN_RAW);
  const int on = 1;
  REQUIRE(::setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on) == 0);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
  REQUIRE(::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  REQUIRE(::write(fd, &frame, sizeof frame) == sizeof frame);
  ::close(fd);
}

/// Puts a controller's error frame on an interface, as its driver would.
inline void put_error(const std::string& interface, uint32_t error_class, uint8_t controller_state) {
  can_frame error{};
  error.can_id = CAN_ERR_FLAG | error_class;
  error.can_dlc = CAN_ERR_DLC;
  error.data[1] = controller_state;
  put(interface, error);
}

/// Runs a command of the shell, which also finds ip and tc where an ordinary user's path lacks them.
inline int shell(const std::string& command) {
  return std::system(("PATH=$PATH:/usr/sbin:/sbin; " + command).c_str());
}

/// A virtual CAN interface of the test's own, which it may take down; gone with the object. Its name has the
/// number of this process: other tests may run at the same time.
class OwnInterface {
 public:
  explicit OwnInterface(const std::string& state = "up", const std::string& type = "vcan") {
    remove();  // one that was killed had this number, too
    REQUIRE(ip("add dev", "type " + type) == 0);
    REQUIRE(set(state) == 0);
  }
  ~OwnInterface() { remove(); }
  OwnInterface(const OwnInterface&) = delete;
  OwnInterface& operator=(const OwnInterface&) = delete;

  /// Whether this machine lets us, which takes root and may take more.
  static bool may_be_made() {
    const std::string name = "trial" + std::to_string(::getpid());
    return ::geteuid() == 0 && shell("ip link add dev " + name + " type vcan 2>/dev/null") == 0 &&
           shell("ip link del " + name) == 0;
  }

  const std::string& name() const { return name_; }
  int set(const std::string& state) const { return ip("set", state); }
  int remove() const { return ip("del", "2>/dev/null"); }

 private:
  int ip(const std::string& verb, const std::string& rest) const {
    return shell("ip link " + verb + " " + name_ + " " + rest);
  }

  std::string name_ = "tendril" + std::to_string(::getpid());  // 14 of at most 15 letters
};

/// True where the test may not make interfaces, once it has said that it is skipped for that.
inline bool skipped_without_root() {
  if (::geteuid() == 0) return false;
  WARN("skipped: only root may make and remove interfaces");
  return true;
}

}  // namespace tendril::hal::testing
