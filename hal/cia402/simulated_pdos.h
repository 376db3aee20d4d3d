#pragma once

#include <array>
#include <cstdint>

#include "hal/cia402/simulated_object_dictionary.h"

/// The PDOs of a simulated drive: lists of objects, into which frames are unpacked and from which they are
/// packed. [CiA 301, objects 1400-1A00] Real-time: yes, all of it.
namespace tendril::hal {

/// Transmission types up to this wait for SYNC; those above that are served, 254 and 255, do not.
inline constexpr uint32_t kSynchronousTypes = 240;

/// Whether an entry is a setting of a PDO.
bool is_pdo_setting(SimulatedObjectDictionary::Slot slot) noexcept;

/// Checks a write to a setting of a PDO against the order in which one is set up: switch off, empty the map,
/// fill it, count, switch on.
/// @return the abort code that refuses it; 0: none
uint32_t refuse_pdo_setting(const SimulatedObjectDictionary& objects, SimulatedObjectDictionary::Slot slot,
                            uint32_t value) noexcept;

/// Whether a PDO is switched on.
bool is_on(const SimulatedObjectDictionary& objects, const SimulatedObjectDictionary::Pdo& pdo) noexcept;

/// A value that an RPDO brings.
struct MappedValue {
  SimulatedObjectDictionary::Slot slot = SimulatedObjectDictionary::kSlots;
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

/// Bytes of a PDO as it is mapped.
int pdo_length(const SimulatedObjectDictionary& objects, const SimulatedObjectDictionary::Pdo& pdo) noexcept;

/// Unpacks the RPDO. @param frame  no shorter than pdo_length
MappedValues unpack_rpdo(const SimulatedObjectDictionary& objects, const Frame& frame) noexcept;

/// Packs the TPDO from the values as they are.
Frame pack_tpdo(const SimulatedObjectDictionary& objects) noexcept;

}  // namespace tendril::hal
