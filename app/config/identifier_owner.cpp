#include "app/config/identifier_owner.h"

#include <fmt/format.h>

#include <algorithm>

namespace tendril::app {

std::string identifier_owner(hal::Protocol protocol, int identifier, const std::vector<int>& nodes) {
  if (protocol == hal::Protocol::kOdrive) {
    const int owner = identifier >> 5;
    return std::ranges::find(nodes, owner) == nodes.end()
               ? ""
               : fmt::format("message 0x{:02X} of node {}", identifier & 0x1F, owner);
  }
  if (identifier == 0x000) return "the NMT command";
  if (identifier == 0x080) return "SYNC";
  struct Function {
    int base;
    const char* name;
  };
  static constexpr Function kFunctions[] = {{0x080, "the emergency message"},
                                            {0x180, "TPDO 1"},
                                            {0x200, "RPDO 1"},
                                            {0x280, "TPDO 2"},
                                            {0x300, "RPDO 2"},
                                            {0x380, "TPDO 3"},
                                            {0x400, "RPDO 3"},
                                            {0x480, "TPDO 4"},
                                            {0x500, "RPDO 4"},
                                            {0x580, "the SDO answer"},
                                            {0x600, "the SDO request"},
                                            {0x700, "the heartbeat"}};
  const int node = identifier & 0x7F;
  if (std::ranges::find(nodes, node) == nodes.end()) return "";
  for (const auto& [base, name] : kFunctions) {
    if ((identifier & 0x780) == base) return fmt::format("{} of node {}", name, node);
  }
  return "";
}

}  // namespace tendril::app
