// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "hal/bus/frame_batch.h"
#include "hal/cia402/simulated_object_dictionary.h"

namespace tendril::hal {

/// Whether an entry is a setting of a PDO. Real-time: yes.
bool is_pdo_setting(SimulatedEntry entry) noexcept;

/// Checks a write to a setting of a PDO against the order in which one is set up: switch off, empty the map,
/// fill it, count, switch on. [CiA 301, objects 1400-1A00]
/// @return the abort code that refuses it; 0: none
/// Real-time: yes.
uint32_t check_pdo_setting(const SimulatedObjectDictionary& objects, SimulatedEntry entry,
                           uint32_t value) noexcept;

/// A value that an RPDO brings.
struct MappedValue {
  SimulatedEntry entry = SimulatedEntry::kNone;
  uint32_t value = 0;
};

/// The values of an RPDO in the order of its map.
class MappedValues {
 public:
  const MappedValue* begin() const noexcept { return values_.data(); }
  const MappedValue* end() const noexcept { return values_.data() + count_; }
  void push(MappedValue value) noexcept { values_[count_++] = value; }

 private:
  std::array<MappedValue, 8> values_{};
  int count_ = 0;
};

/// The two PDOs of a simulated drive: they are mapped and sent as its object dictionary says, with
/// transmission types 0 to 240, 254 and 255. [CiA 301] Real-time: every function (bounded, no allocation).
class SimulatedPdos {
 public:
  /// Drops the RPDO that waits for SYNC. The next TPDO counts as the first.
  void restart() noexcept;

  /// Processes a frame of NMT operational: an RPDO is kept until it is taken. One that is too short is
  /// dropped.
  /// @return whether `rpdo_too_short` has changed
  bool receive(const SimulatedObjectDictionary& objects, const Frame& frame) noexcept;

  /// Whether the last RPDO was shorter than its map. [CiA 301, EMCY 8210]
  bool rpdo_too_short() const noexcept { return rpdo_too_short_; }

  /// Whether an RPDO has been received that does not wait for SYNC.
  bool rpdo_due(const SimulatedObjectDictionary& objects) const noexcept;

  /// Takes the values of the RPDO that was received last; nothing where they have been taken.
  std::optional<MappedValues> take_rpdo(const SimulatedObjectDictionary& objects) noexcept;

  /// Appends the TPDO that goes with this SYNC, if any, with the values that `objects` has.
  void on_sync(const SimulatedObjectDictionary& objects, int64_t now_ns, FrameBatch& out) noexcept;

  /// Appends the TPDO that does not wait for SYNC when what it holds has changed, but not before its inhibit
  /// time is over, and when its event timer has run down.
  void advance(const SimulatedObjectDictionary& objects, int64_t now_ns, FrameBatch& out) noexcept;

 private:
  static constexpr int64_t kLongAgo_ns = INT64_MIN / 2;

  void send(const SimulatedObjectDictionary& objects, bool only_if_changed, int64_t now_ns,
            FrameBatch& out) noexcept;

  Frame rpdo_;
  bool has_rpdo_ = false;  // not taken yet
  bool rpdo_too_short_ = false;
  int syncs_since_tpdo_ = 0;
  Frame last_tpdo_;
  int64_t tpdo_ns_ = kLongAgo_ns;  // when it was sent
};

}  // namespace tendril::hal
