// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/simulated_object_table.h"

#include <array>

#include "hal/canopen/canopen.h"
#include "hal/cia402/cia402.h"

namespace tendril::hal {
namespace {

using Access = EntryDescription::Access;
using Trait = EntryDescription::Trait;

constexpr int64_t kAnyU8 = 0xFF, kAnyU16 = 0xFFFF, kAnyU32 = 0xFFFF'FFFF;

constexpr uint32_t kModes =
    1u << (kModeHoming - 1) | 1u << (kModeCyclicPosition - 1) | 1u << (kModeCyclicTorque - 1);

// In the order of SimulatedEntry. 1000 reads: profile 402 (0x192), servo drive (bit 17); of 6502,
// bit n - 1 stands for mode n.
constexpr std::array<EntryDescription, kSimulatedEntries> kEntries = {{
    {{0x1000, 0}, "Device type", 4, Access::kReadOnly, 0x0002'0192, 0, kAnyU32},
    {{0x1001, 0}, "Error register", 1, Access::kReadOnly, 0, 0, kAnyU8, Trait::kMappable},
    {{0x1003, 0}, "Error history", 1, Access::kReadWrite, 0, 0, 0},
    {{0x1003, 1}, "Error 1", 4, Access::kReadOnly, 0, 0, kAnyU32},
    {{0x1003, 2}, "Error 2", 4, Access::kReadOnly, 0, 0, kAnyU32},
    {{0x1003, 3}, "Error 3", 4, Access::kReadOnly, 0, 0, kAnyU32},
    {{0x1003, 4}, "Error 4", 4, Access::kReadOnly, 0, 0, kAnyU32},
    {{0x1005, 0}, "SYNC COB-ID", 4, Access::kReadWrite, kSyncId, kSyncId, kSyncId},
    {{0x1014, 0}, "EMCY COB-ID", 4, Access::kReadOnly, kEmergencyBase, 0, kAnyU32, Trait::kAddsNode},
    {{0x1016, 0}, "Consumer heartbeats", 1, Access::kReadOnly, 1, 0, kAnyU8},
    {{0x1016, 1}, "Consumer heartbeat 1", 4, Access::kReadWrite, 0, 0, 0x007F'FFFF},
    {{0x1017, 0}, "Producer heartbeat time", 2, Access::kReadWrite, 0, 0, kAnyU16},
    {{0x1018, 0}, "Identity", 1, Access::kReadOnly, 4, 0, kAnyU8},
    {{0x1018, 1}, "Vendor", 4, Access::kReadOnly, 0, 0, kAnyU32},
    {{0x1018, 2}, "Product code", 4, Access::kReadOnly, 0x402, 0, kAnyU32},
    {{0x1018, 3}, "Revision", 4, Access::kReadOnly, 1, 0, kAnyU32},
    {{0x1018, 4}, "Serial number", 4, Access::kReadOnly, 0, 0, kAnyU32},
    {{0x1019, 0}, "SYNC counter overflow", 1, Access::kReadWrite, 0, 0, 0},
    {{0x1400, 0}, "RPDO 1 parameters", 1, Access::kReadOnly, 2, 0, kAnyU8},
    {{0x1400, 1},
     "RPDO 1 COB-ID",
     4,
     Access::kReadWrite,
     kPdoInvalid | kRpdo1Base,
     0,
     kAnyU32,
     Trait::kAddsNode},
    {{0x1400, 2}, "RPDO 1 transmission type", 1, Access::kReadWrite, 255, 0, kAnyU8},
    {{0x1600, 0}, "RPDO 1 mapping", 1, Access::kReadWrite, 0, 0, 8},
    {{0x1600, 1}, "RPDO 1 mapped object 1", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1600, 2}, "RPDO 1 mapped object 2", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1600, 3}, "RPDO 1 mapped object 3", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1600, 4}, "RPDO 1 mapped object 4", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1600, 5}, "RPDO 1 mapped object 5", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1600, 6}, "RPDO 1 mapped object 6", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1600, 7}, "RPDO 1 mapped object 7", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1600, 8}, "RPDO 1 mapped object 8", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1800, 0}, "TPDO 1 parameters", 1, Access::kReadOnly, 5, 0, kAnyU8},
    {{0x1800, 1},
     "TPDO 1 COB-ID",
     4,
     Access::kReadWrite,
     kPdoInvalid | kTpdo1Base,
     0,
     kAnyU32,
     Trait::kAddsNode},
    {{0x1800, 2}, "TPDO 1 transmission type", 1, Access::kReadWrite, 1, 0, kAnyU8},
    {{0x1800, 3}, "TPDO 1 inhibit time", 2, Access::kReadWrite, 10, 0, kAnyU16},
    {{0x1800, 5}, "TPDO 1 event timer", 2, Access::kReadWrite, 0, 0, kAnyU16},
    {{0x1A00, 0}, "TPDO 1 mapping", 1, Access::kReadWrite, 0, 0, 8},
    {{0x1A00, 1}, "TPDO 1 mapped object 1", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1A00, 2}, "TPDO 1 mapped object 2", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1A00, 3}, "TPDO 1 mapped object 3", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1A00, 4}, "TPDO 1 mapped object 4", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1A00, 5}, "TPDO 1 mapped object 5", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1A00, 6}, "TPDO 1 mapped object 6", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1A00, 7}, "TPDO 1 mapped object 7", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x1A00, 8}, "TPDO 1 mapped object 8", 4, Access::kReadWrite, 0, 0, kAnyU32},
    {{0x6007, 0}, "Abort connection option", -2, Access::kReadWrite, 1, 1, 1},
    {{0x603F, 0}, "Error code", 2, Access::kReadOnly, 0, 0, kAnyU16, Trait::kMappable},
    {{0x6040, 0}, "Controlword", 2, Access::kReadWrite, 0, 0, kAnyU16, Trait::kMappable},
    {{0x6041, 0}, "Statusword", 2, Access::kReadOnly, 0, 0, kAnyU16, Trait::kMappable},
    {{0x605A, 0}, "Quick stop option", -2, Access::kReadWrite, 6, 6, 6},
    {{0x605D, 0}, "Halt option", -2, Access::kReadWrite, 1, 1, 1},
    {{0x6060, 0}, "Mode of operation", -1, Access::kReadWrite, 0, INT8_MIN, INT8_MAX, Trait::kMappable},
    {{0x6061, 0},
     "Mode of operation display",
     -1,
     Access::kReadOnly,
     0,
     INT8_MIN,
     INT8_MAX,
     Trait::kMappable},
    {{0x6064, 0}, "Actual position", -4, Access::kReadOnly, 0, INT32_MIN, INT32_MAX, Trait::kMappable},
    {{0x6065, 0}, "Following error window", 4, Access::kReadWrite, 0xFFFF'FFFF, 0, kAnyU32},
    {{0x6066, 0}, "Following error time out", 2, Access::kReadWrite, 0, 0, kAnyU16},
    {{0x6071, 0}, "Target torque", -2, Access::kReadWrite, 0, INT16_MIN, INT16_MAX, Trait::kMappable},
    {{0x6076, 0}, "Motor rated torque", 4, Access::kReadOnly, 0, 0, kAnyU32},
    {{0x6077, 0}, "Torque actual value", -2, Access::kReadOnly, 0, INT16_MIN, INT16_MAX, Trait::kMappable},
    {{0x607A, 0}, "Target position", -4, Access::kReadWrite, 0, INT32_MIN, INT32_MAX, Trait::kMappable},
    {{0x607D, 0}, "Software position limits", 1, Access::kReadOnly, 2, 0, kAnyU8},
    {{0x607D, 1}, "Least position", -4, Access::kReadWrite, 0, INT32_MIN, INT32_MAX},
    {{0x607D, 2}, "Greatest position", -4, Access::kReadWrite, 0, INT32_MIN, INT32_MAX},
    {{0x6098, 0}, "Homing method", -1, Access::kReadWrite, 0, INT8_MIN, INT8_MAX},
    {{0x6099, 0}, "Homing speeds", 1, Access::kReadOnly, 2, 0, kAnyU8},
    {{0x6099, 1}, "Homing speed for the switch", 4, Access::kReadWrite, 20'000, 1, kAnyU32},
    {{0x6099, 2}, "Homing speed for the zero", 4, Access::kReadWrite, 2'000, 1, kAnyU32},
    {{0x609A, 0}, "Homing acceleration", 4, Access::kReadWrite, 200'000, 1, kAnyU32},
    {{0x60B0, 0}, "Position offset", -4, Access::kReadWrite, 0, INT32_MIN, INT32_MAX, Trait::kMappable},
    {{0x60B1, 0}, "Velocity offset", -4, Access::kReadWrite, 0, INT32_MIN, INT32_MAX, Trait::kMappable},
    {{0x60B2, 0}, "Torque offset", -2, Access::kReadWrite, 0, INT16_MIN, INT16_MAX, Trait::kMappable},
    {{0x60C2, 0}, "Interpolation period", 1, Access::kReadOnly, 2, 0, kAnyU8},
    {{0x60C2, 1}, "Interpolation period value", 1, Access::kReadWrite, 1, 1, 255},
    {{0x60C2, 2}, "Interpolation period exponent", -1, Access::kReadWrite, 0xFD, -6, 0},
    {{0x6502, 0}, "Supported drive modes", 4, Access::kReadOnly, kModes, 0, kAnyU32},
}};

constexpr std::array<TextObject, 3> kTexts = {{{0x1008, "Device name", "tendril-plant"},
                                               {0x1009, "Hardware version", "simulated"},
                                               {0x100A, "Software version", "1.0"}}};

}  // namespace

std::span<const EntryDescription> entry_descriptions() noexcept { return kEntries; }

std::span<const TextObject> text_objects() noexcept { return kTexts; }

}  // namespace tendril::hal
