#include "hal/cia402/simulated_pdos.h"

#include "hal/canopen/canopen.h"

namespace tendril::hal {
namespace {

using Slot = SimulatedObjectDictionary::Slot;
using Pdo = SimulatedObjectDictionary::Pdo;

constexpr int kMapEntries = 8, kMaxBytes = 8;

constexpr bool is_received(const Pdo& pdo) noexcept { return pdo.id == SimulatedObjectDictionary::kRpdoId; }

uint32_t mapping(const SimulatedObjectDictionary& objects, const Pdo& pdo, int entry) noexcept {
  return objects[static_cast<Slot>(pdo.map + entry)];
}

constexpr int bytes_of(uint32_t mapping) noexcept { return static_cast<int>(mapping & 0xFF) / 8; }

/// A PDO that is on keeps its identifier; 29-bit identifiers are not spoken.
uint32_t refuse_cob_id(const SimulatedObjectDictionary& objects, const Pdo& pdo, uint32_t value) noexcept {
  const uint32_t id = value & 0x7FF;
  const bool shall_be_on = !(value & kPdoInvalid);
  const bool moves = is_on(objects, pdo) && shall_be_on && id != (objects[pdo.id] & 0x7FF);
  const bool is_fit = !is_restricted(id) && objects[pdo.count] != 0;
  return (value & 0x3FFF'F800) || moves || (shall_be_on && !is_fit) ? code(SdoAbort::kBadValue) : 0;
}

uint32_t refuse_count(const SimulatedObjectDictionary& objects, const Pdo& pdo, uint32_t count) noexcept {
  if (count > kMapEntries) return code(SdoAbort::kPdoTooLong);
  int bytes = 0;
  for (int i = 0; i < static_cast<int>(count); ++i) {
    const uint32_t object = mapping(objects, pdo, i);
    if (object == 0) return code(SdoAbort::kNotMappable);
    bytes += bytes_of(object);
  }
  return bytes > kMaxBytes ? code(SdoAbort::kPdoTooLong) : 0;
}

}  // namespace

bool is_pdo_setting(Slot slot) noexcept {
  return slot >= SimulatedObjectDictionary::kRpdoId && slot <= SimulatedObjectDictionary::kTpdoMapLast;
}

bool is_on(const SimulatedObjectDictionary& objects, const Pdo& pdo) noexcept {
  return !(objects[pdo.id] & kPdoInvalid);
}

uint32_t refuse_pdo_setting(const SimulatedObjectDictionary& objects, Slot slot, uint32_t value) noexcept {
  const Pdo& pdo = slot < SimulatedObjectDictionary::kTpdoCount ? SimulatedObjectDictionary::kRpdo
                                                                : SimulatedObjectDictionary::kTpdo;
  if (slot == pdo.id) return refuse_cob_id(objects, pdo, value);
  if (slot == pdo.type) return value > kSynchronousTypes && value < 254 ? code(SdoAbort::kBadValue) : 0;
  if (slot == SimulatedObjectDictionary::kTpdoTimer) return 0;
  if (is_on(objects, pdo)) return code(SdoAbort::kUnsupportedAccess);
  if (slot == SimulatedObjectDictionary::kTpdoInhibit) return 0;
  if (slot == pdo.count) return refuse_count(objects, pdo, value);
  if (objects[pdo.count] != 0) return code(SdoAbort::kUnsupportedAccess);
  const bool is_good =
      value == 0 || objects.mapped(value, is_received(pdo)) != SimulatedObjectDictionary::kSlots;
  return is_good ? 0 : code(SdoAbort::kNotMappable);
}

int pdo_length(const SimulatedObjectDictionary& objects, const Pdo& pdo) noexcept {
  int bytes = 0;
  for (int i = 0; i < static_cast<int>(objects[pdo.count]); ++i) bytes += bytes_of(mapping(objects, pdo, i));
  return bytes;
}

MappedValues unpack_rpdo(const SimulatedObjectDictionary& objects, const Frame& frame) noexcept {
  MappedValues values;
  int at = 0;
  for (int i = 0; i < static_cast<int>(objects[SimulatedObjectDictionary::kRpdo.count]); ++i) {
    const uint32_t object = mapping(objects, SimulatedObjectDictionary::kRpdo, i);
    uint32_t value = 0;
    for (int k = 0; k < bytes_of(object); ++k) value |= uint32_t{frame.data[at + k]} << (8 * k);
    values.push({objects.mapped(object, true), value});
    at += bytes_of(object);
  }
  return values;
}

Frame pack_tpdo(const SimulatedObjectDictionary& objects) noexcept {
  Frame frame{.id = objects[SimulatedObjectDictionary::kTpdo.id] & 0x7FF};
  for (int i = 0; i < static_cast<int>(objects[SimulatedObjectDictionary::kTpdo.count]); ++i) {
    const uint32_t object = mapping(objects, SimulatedObjectDictionary::kTpdo, i);
    const uint32_t value = objects[objects.mapped(object, false)];
    for (int k = 0; k < bytes_of(object); ++k)
      frame.data[frame.length++] = static_cast<uint8_t>(value >> (8 * k));
  }
  return frame;
}

}  // namespace tendril::hal
