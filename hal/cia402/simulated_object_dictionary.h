#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "hal/canopen/sdo.h"
#include "hal/cia402/cia402.h"

namespace tendril::hal {

/// The object dictionary of a simulated servo drive: types, access rights, ranges and values, and the part of
/// the SDO server that follows from them. It knows nothing of what the values do.
class SimulatedObjectDictionary {
 public:
  /// One name for each entry, in the order of the table in the source.
  enum Slot : int {
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
    kActualPosition,
    kErrorWindow,   // 6065, counts; 0xFFFFFFFF: not watched
    kErrorTime,     // 6066, ms
    kTargetTorque,  // 6071, thousandths of 6076
    kRatedTorque,   // 6076, mNm
    kActualTorque,  // 6077, thousandths of 6076
    kTargetPosition,
    kLimitCount,
    kLimitMin,  // 607D, counts; not watched unless min < max
    kLimitMax,
    kHomingMethod,
    kHomingSpeedCount,
    kSearchSpeed,  // counts/s
    kZeroSpeed,
    kHomingAcceleration,  // counts/s²
    kPeriodCount,
    kPeriodValue,
    kPeriodExponent,
    kSupportedModes,
    kSlots
  };

  /// Where the settings of a PDO are.
  struct Pdo {
    Slot id, type, count, map;  // map: the first of eight
  };
  static constexpr Pdo kRpdo = {kRpdoId, kRpdoType, kRpdoMapCount, kRpdoMap};
  static constexpr Pdo kTpdo = {kTpdoId, kTpdoType, kTpdoMapCount, kTpdoMap};

  /// What a write would do: the slot and the value, or the abort code that refuses it.
  struct Access {
    Slot slot = kSlots;
    uint32_t value = 0;
    uint32_t abort = 0;  // 0: allowed
  };

  /// @param node  1..127, for the default COB-IDs
  /// @param pdo   1..4: which RPDO and TPDO there are, objects 1400 + pdo - 1 and so on
  /// @param rpdo_id, tpdo_id  at power-on they have these COB-IDs, hold 6040 and `target`, 6041 and 6064, and
  ///                          are on; 0: it is empty and off
  /// @param target            as it is mapped
  /// Real-time: yes.
  SimulatedObjectDictionary(int node, int pdo, uint32_t rpdo_id = 0, uint32_t tpdo_id = 0,
                            uint32_t target = kMapTargetPosition) noexcept;

  /// Gives all entries, or those below 2000 (the communication profile) except the errors, their power-on
  /// values. Real-time: yes.
  void restore_all() noexcept;
  void restore_communication() noexcept;

  /// A value, zero-extended from its size. Real-time: yes.
  uint32_t operator[](Slot slot) const noexcept { return values_[slot]; }

  /// A value of a signed entry. Real-time: yes.
  int32_t signed_value(Slot slot) const noexcept;

  /// Sets a value without any check. Real-time: yes.
  void set(Slot slot, uint32_t value) noexcept;

  /// Answers a read of all but texts. Real-time: yes.
  SdoAnswer read(ObjectAddress object) const noexcept;

  /// The text that an object holds; empty where it holds none. Real-time: yes.
  static std::string_view text(ObjectAddress object) noexcept;

  /// Checks a write against existence, access right and size, and changes nothing. Real-time: yes.
  Access check_write(const SdoRequest& request) const noexcept;

  /// Checks a value against the range of an entry. @return the abort code that refuses it; 0: none.
  /// Real-time: yes.
  static uint32_t check_range(Slot slot, uint32_t value) noexcept;

  /// The entry that a PDO maps so, as index, subindex and bits. Real-time: yes.
  /// @param received  by an RPDO, so that it must be writable
  /// @return          kSlots where there is none, or not of that length
  Slot mapped(uint32_t mapping, bool received) const noexcept;

  /// Bytes of an entry. Real-time: yes.
  static int bytes(Slot slot) noexcept;

  /// Puts an error code at the head of the history, 1003. Real-time: yes.
  void remember_error(uint16_t code) noexcept;

 private:
  Slot find(ObjectAddress object) const noexcept;
  uint32_t missing(ObjectAddress object) const noexcept;
  uint16_t index_of(Slot slot) const noexcept;

  int node_, pdo_;
  uint32_t rpdo_id_, tpdo_id_, target_;
  std::array<uint32_t, kSlots> values_{};
};

/// The object dictionary as an electronic data sheet (EDS) for configuration tools. [CiA 306]
/// Real-time: no (allocates).
std::string simulated_drive_eds();

}  // namespace tendril::hal
