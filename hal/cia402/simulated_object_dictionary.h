// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "hal/canopen/sdo.h"
#include "hal/cia402/cia402.h"
#include "hal/cia402/simulated_object_table.h"

namespace tendril::hal {

/// Where the settings of a PDO are in the object dictionary.
struct PdoEntries {
  SimulatedEntry id, type, count, map;  // map: the first of eight
};
inline constexpr PdoEntries kSimulatedRpdo = {SimulatedEntry::kRpdoId, SimulatedEntry::kRpdoType,
                                              SimulatedEntry::kRpdoMapCount, SimulatedEntry::kRpdoMap};
inline constexpr PdoEntries kSimulatedTpdo = {SimulatedEntry::kTpdoId, SimulatedEntry::kTpdoType,
                                              SimulatedEntry::kTpdoMapCount, SimulatedEntry::kTpdoMap};

/// The object dictionary of a simulated CiA 402 drive: values, and which reads and writes are allowed.
/// Real-time: every function (bounded, no allocation).
class SimulatedObjectDictionary {
 public:
  /// The result of a check: what a write would set, or the abort code that refuses it.
  struct WriteCheck {
    SimulatedEntry entry = SimulatedEntry::kNone;
    uint32_t value = 0;
    uint32_t abort = 0;  // 0: allowed
  };

  /// @param node  1..127, for the default COB-IDs
  /// @param pdo   1..4: which RPDO and TPDO there are, objects 1400 + pdo - 1 and so on
  /// @param rpdo_id, tpdo_id  at power-on they have these COB-IDs, hold 6040 and `target`, 6041 and 6064, and
  ///                          are on; 0: it is empty and off
  /// @param target            as it is mapped
  SimulatedObjectDictionary(int node, int pdo, uint32_t rpdo_id = 0, uint32_t tpdo_id = 0,
                            uint32_t target = kMapTargetPosition) noexcept;

  /// Gives all entries their values at power-on.
  void restore_all() noexcept;

  /// Gives the entries below 2000 (the communication profile), except the errors, their values at power-on.
  void restore_communication() noexcept;

  /// A value, zero-extended from its size.
  uint32_t operator[](SimulatedEntry entry) const noexcept { return values_[static_cast<size_t>(entry)]; }

  /// A value of a signed entry.
  int32_t signed_value(SimulatedEntry entry) const noexcept;

  /// Sets a value without any check.
  void set(SimulatedEntry entry, uint32_t value) noexcept;

  /// Sets a value that a master has written, with what follows from it in other entries: the mode display
  /// (6061) shows the mode, and a write to 1003:0 empties the error history.
  void write(SimulatedEntry entry, uint32_t value) noexcept;

  /// Answers a read of all but texts.
  SdoAnswer read(ObjectAddress object) const noexcept;

  /// The text that an object holds; empty where it holds none.
  static std::string_view text(ObjectAddress object) noexcept;

  /// Checks a write against existence, access right and size, and changes nothing.
  WriteCheck check_write(const SdoRequest& request) const noexcept;

  /// Checks a value against the range of an entry, and a mode or homing method against those that the drive
  /// has. @return the abort code that refuses it; 0: none
  static uint32_t check_value(SimulatedEntry entry, uint32_t value) noexcept;

  /// The entry that a PDO maps, given as index, subindex and bits.
  /// @param received  by an RPDO, so that it must be writable
  /// @return          kNone where there is none, or not of that length
  SimulatedEntry mapped(uint32_t mapping, bool received) const noexcept;

  /// Puts an error code at the head of the history, 1003.
  void remember_error(uint16_t code) noexcept;

 private:
  uint32_t& value_of(SimulatedEntry entry) noexcept { return values_[static_cast<size_t>(entry)]; }
  void restore_pdo(const PdoEntries& pdo, uint32_t cob_id, uint32_t first, uint32_t second) noexcept;
  SimulatedEntry find(ObjectAddress object) const noexcept;
  uint32_t abort_code_of_missing(ObjectAddress object) const noexcept;
  uint16_t index_of(const EntryDescription& about) const noexcept;

  int node_, pdo_;
  uint32_t rpdo_id_, tpdo_id_, target_;
  std::array<uint32_t, kSimulatedEntries> values_{};
};

}  // namespace tendril::hal
