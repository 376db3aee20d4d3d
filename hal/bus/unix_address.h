// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <string_view>

namespace tendril::hal {

/// The address of a UNIX socket, as bind(2) and connect(2) want it.
struct UnixAddress {
  sockaddr_un address{};
  socklen_t size = 0;

  const sockaddr* get() const noexcept { return reinterpret_cast<const sockaddr*>(&address); }
};

/// Of a path of the file system. Real-time: no.
/// @throws BusError where it is empty, or longer than the kernel takes: 107 bytes
UnixAddress unix_address(std::string_view path);

/// Of a name that belongs to no file and goes with the process that has bound it. Real-time: no.
/// @throws BusError where it is longer than 107 bytes
UnixAddress abstract_unix_address(std::string_view name);

}  // namespace tendril::hal
