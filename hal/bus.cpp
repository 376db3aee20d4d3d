#include "hal/bus.h"

#include "hal/bus_backends.h"

namespace tendril::hal {

const char* to_text(BusHealth health) noexcept {
  switch (health) {
    case BusHealth::kActive:
      return "error-active";
    case BusHealth::kPassive:
      return "error-passive";
    case BusHealth::kOff:
      return "bus-off";
    case BusHealth::kDown:
      break;
  }
  return "down";
}

std::unique_ptr<Bus> open_bus(const std::string& name, BusRole role, std::span<const uint32_t> wanted,
                              int64_t wait_ns) {
  constexpr std::string_view kLocal = "local:";
  if (!name.starts_with(kLocal)) return open_socketcan(name, wanted);
  const std::string path = name.substr(kLocal.size());
  return role == BusRole::kHost ? host_local_bus(path) : join_local_bus(path, wait_ns);
}

}  // namespace tendril::hal
