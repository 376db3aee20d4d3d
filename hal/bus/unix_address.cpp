// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/unix_address.h"

#include <cstddef>
#include <cstring>
#include <string>

#include "hal/bus/bus.h"

namespace tendril::hal {
namespace {

constexpr std::size_t kLongestPath = sizeof(sockaddr_un::sun_path) - 1;

/// @param begin  where the text stands in sun_path
UnixAddress address_with(std::string_view text, std::size_t begin) {
  if (text.empty() || text.size() > kLongestPath)
    throw BusError("the path of a socket has 1 to " + std::to_string(kLongestPath) + " bytes; '" +
                   std::string(text) + "' has " + std::to_string(text.size()) + ": choose another one");
  UnixAddress result;
  result.address.sun_family = AF_UNIX;
  std::memcpy(result.address.sun_path + begin, text.data(), text.size());
  result.size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + text.size() + 1);
  return result;
}

}  // namespace

UnixAddress unix_address(std::string_view path) { return address_with(path, 0); }

UnixAddress abstract_unix_address(std::string_view name) { return address_with(name, 1); }

}  // namespace tendril::hal
