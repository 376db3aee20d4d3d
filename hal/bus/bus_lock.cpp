// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/bus_lock.h"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <functional>

#include "hal/bus/bus.h"
#include "hal/bus/unix_address.h"

namespace tendril::hal {
namespace {

/// The path of a local bus may be longer than such a name: a hash stands for it.
UnixAddress name_of(const std::string& bus) {
  static const std::string kLocal = "local:";
  std::string text = bus;
  if (bus.starts_with(kLocal)) {
    std::error_code none;
    const auto path = std::filesystem::weakly_canonical(bus.substr(kLocal.size()), none);
    text = kLocal + std::to_string(std::hash<std::string>{}(path.string()));
  }
  return abstract_unix_address("tendril/bus/" + text.substr(0, 80));
}

/// The process that listens there; 0 where it cannot be told.
pid_t holder(const UnixAddress& name) {
  const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  ucred credentials{};
  socklen_t size = sizeof credentials;
  if (::connect(probe, name.get(), name.size) == 0)
    ::getsockopt(probe, SOL_SOCKET, SO_PEERCRED, &credentials, &size);
  ::close(probe);
  return credentials.pid;
}

}  // namespace

BusLock::BusLock(const std::string& bus)
    : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  const UnixAddress name = name_of(bus);
  if (::bind(socket_, name.get(), name.size) == 0 && ::listen(socket_, 1) == 0) return;
  const int error = errno;
  const pid_t other = error == EADDRINUSE ? holder(name) : 0;
  ::close(socket_);
  if (error != EADDRINUSE) throw BusError(bus + ": cannot be locked: " + std::strerror(error));
  throw BusError(bus + ": another tendrild or tendrilctl" +
                 (other ? " (process " + std::to_string(other) + ")" : "") +
                 " controls its drives; stop that one first");
}

BusLock::~BusLock() { ::close(socket_); }

}  // namespace tendril::hal
