// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/open_bus.h"

#include "hal/bus/bus_backends.h"

namespace tendril::hal {

std::unique_ptr<Bus> open_bus(const std::string& name, BusRole role, std::span<const uint32_t> wanted,
                              int64_t wait_ns) {
  constexpr std::string_view kLocal = "local:";
  if (!name.starts_with(kLocal)) return open_socketcan(name, wanted);
  const std::string path = name.substr(kLocal.size());
  return role == BusRole::kHost ? host_local_bus(path) : join_local_bus(path, wait_ns);
}

}  // namespace tendril::hal
