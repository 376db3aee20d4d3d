// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "hal/canopen/sdo.h"

/// Which objects a simulated CiA 402 drive has: types, access rights, ranges and values at power-on. Constant
/// data. [CiA 301; CiA 402-2] Real-time: yes, all of it.
namespace tendril::hal {

/// The entries of the object dictionary that hold a number, in the order of the table in the source.
enum class SimulatedEntry : int {
  kDeviceType,
  kErrorRegister,
  kErrorCount,    // 1003:0
  kErrorHistory,  // 1003:1 and on, the newest first
  kErrorHistoryLast = kErrorHistory + 3,
  kSyncCobId,
  kEmergencyCobId,
  kConsumerCount,
  kConsumer,  // 1016:1, node << 16 | ms
  kProducer,  // 1017, ms
  kIdentityCount,
  kVendor,
  kProduct,
  kRevision,
  kSerial,
  kSyncCounter,  // 1019; 0: SYNC has none
  kRpdoCount,
  kRpdoId,
  kRpdoType,
  kRpdoMapCount,
  kRpdoMap,
  kRpdoMapLast = kRpdoMap + 7,
  kTpdoCount,
  kTpdoId,
  kTpdoType,
  kTpdoInhibit,  // 100 µs
  kTpdoTimer,    // ms; 0: none
  kTpdoMapCount,
  kTpdoMap,
  kTpdoMapLast = kTpdoMap + 7,
  kAbortOption,
  kErrorCode,  // 603F, as in the EMCY of the present fault
  kControlword,
  kStatusword,
  kQuickStopOption,
  kHaltOption,
  kMode,
  kModeDisplay,
  kActualPosition,  // counts
  kErrorWindow,     // 6065, counts; 0xFFFFFFFF: not monitored
  kErrorTime,       // 6066, ms
  kTargetTorque,    // 6071, thousandths of 6076
  kRatedTorque,     // 6076, mNm
  kActualTorque,    // 6077, thousandths of 6076
  kTargetPosition,  // counts
  kLimitCount,
  kLimitMin,  // 607D, counts; not monitored unless min < max
  kLimitMax,
  kHomingMethod,
  kHomingSpeedCount,
  kSearchSpeed,         // counts/s
  kZeroSpeed,           // counts/s
  kHomingAcceleration,  // counts/s²
  kPositionOffset,      // 60B0, counts, added to the target position
  kVelocityOffset,      // 60B1, without effect
  kTorqueOffset,        // 60B2, thousandths of 6076, added to the target torque
  kPeriodCount,
  kPeriodValue,
  kPeriodExponent,
  kSupportedModes,
  kNone  // no such entry
};

inline constexpr int kSimulatedEntries = static_cast<int>(SimulatedEntry::kNone);

/// The entry `offset` places after another one. @param offset  so that the result is an entry
constexpr SimulatedEntry operator+(SimulatedEntry entry, int offset) noexcept {
  return static_cast<SimulatedEntry>(static_cast<int>(entry) + offset);
}

/// The description of an entry, without its value.
struct EntryDescription {
  enum class Access : uint8_t { kReadOnly, kReadWrite };
  enum class Trait : uint8_t {
    kNone,
    kAddsNode,  // its initial value is a COB-ID of the predefined connection set without the node
    kMappable   // into a TPDO, and an RPDO where it can be written
  };

  ObjectAddress object;  // of PDO 1 where it belongs to a PDO
  const char* name;      // as in the EDS
  int8_t size;           // bytes; negative for signed values
  Access access;
  uint32_t initial;
  int64_t min, max;
  Trait trait = Trait::kNone;

  constexpr bool is_signed() const noexcept { return size < 0; }
  constexpr int bytes() const noexcept { return is_signed() ? -size : size; }
  constexpr bool writable() const noexcept { return access == Access::kReadWrite; }
  /// Whether it is a parameter or the mapping of a PDO.
  constexpr bool of_pdo() const noexcept { return object.index >= 0x1400 && object.index < 0x2000; }

  /// A value of the entry as a number, from its two's complement where it is signed.
  constexpr int64_t number(uint32_t value) const noexcept {
    if (!is_signed()) return value;
    const int shift = 32 - 8 * bytes();
    return static_cast<int32_t>(value << shift) >> shift;
  }
  /// The bytes of a value that the entry holds.
  constexpr uint32_t truncate(uint32_t value) const noexcept {
    return bytes() == 4 ? value : value & ((1u << (8 * bytes())) - 1);
  }
};

/// All entries, kSimulatedEntries of them in the order of SimulatedEntry, and one of them.
std::span<const EntryDescription> entry_descriptions() noexcept;
inline const EntryDescription& description(SimulatedEntry entry) noexcept {
  return entry_descriptions()[static_cast<size_t>(entry)];
}

/// An object that holds a text, with subindex 0.
struct TextObject {
  uint16_t index;
  const char* name;  // as in the EDS
  std::string_view text;
};

std::span<const TextObject> text_objects() noexcept;

}  // namespace tendril::hal
