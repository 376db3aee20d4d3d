#include "hal/cia402/drive_pdos.h"

namespace tendril::hal {
namespace {

using Slot = DriveObjects::Slot;
using Pdo = DriveObjects::Pdo;

constexpr int kMapEntries = 8, kMaxBytes = 8;

constexpr bool is_received(const Pdo& pdo) noexcept { return pdo.id == DriveObjects::kRpdoId; }

uint32_t mapping(const DriveObjects& objects, const Pdo& pdo, int entry) noexcept {
  return objects[static_cast<Slot>(pdo.map + entry)];
}

constexpr int bytes_of(uint32_t mapping) noexcept { return static_cast<int>(mapping & 0xFF) / 8; }

/// A PDO that is on keeps its identifier; 29-bit identifiers are not spoken.
uint32_t refuse_cob_id(const DriveObjects& objects, const Pdo& pdo, uint32_t value) noexcept {
  const uint32_t id = value & 0x7FF;
  const bool shall_be_on = !(value & kPdoInvalid);
  const bool moves = is_on(objects, pdo) && shall_be_on && id != (objects[pdo.id] & 0x7FF);
  const bool is_fit = !is_restricted(id) && objects[pdo.count] != 0;
  return (value & 0x3FFF'F800) || moves || (shall_be_on && !is_fit) ? code(SdoAbort::kBadValue) : 0;
}

uint32_t refuse_count(const DriveObjects& objects, const Pdo& pdo, uint32_t count) noexcept {
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
  return slot >= DriveObjects::kRpdoId && slot <= DriveObjects::kTpdoMapLast;
}

bool is_on(const DriveObjects& objects, const Pdo& pdo) noexcept { return !(objects[pdo.id] & kPdoInvalid); }

uint32_t refuse_pdo_setting(const DriveObjects& objects, Slot slot, uint32_t value) noexcept {
  const Pdo& pdo = slot < DriveObjects::kTpdoCount ? DriveObjects::kRpdo : DriveObjects::kTpdo;
  if (slot == pdo.id) return refuse_cob_id(objects, pdo, value);
  if (slot == pdo.type) return value > kSynchronousTypes && value < 254 ? code(SdoAbort::kBadValue) : 0;
  if (slot == DriveObjects::kTpdoTimer) return 0;
  if (is_on(objects, pdo)) return code(SdoAbort::kUnsupportedAccess);
  if (slot == DriveObjects::kTpdoInhibit) return 0;
  if (slot == pdo.count) return refuse_count(objects, pdo, value);
  if (objects[pdo.count] != 0) return code(SdoAbort::kUnsupportedAccess);
  const bool is_good = value == 0 || objects.mapped(value, is_received(pdo)) != DriveObjects::kSlots;
  return is_good ? 0 : code(SdoAbort::kNotMappable);
}

int pdo_length(const DriveObjects& objects, const Pdo& pdo) noexcept {
  int bytes = 0;
  for (int i = 0; i < static_cast<int>(objects[pdo.count]); ++i) bytes += bytes_of(mapping(objects, pdo, i));
  return bytes;
}

MappedValues unpack_rpdo(const DriveObjects& objects, const Frame& frame) noexcept {
  MappedValues values;
  int at = 0;
  for (int i = 0; i < static_cast<int>(objects[DriveObjects::kRpdo.count]); ++i) {
    const uint32_t object = mapping(objects, DriveObjects::kRpdo, i);
    uint32_t value = 0;
    for (int k = 0; k < bytes_of(object); ++k) value |= uint32_t{frame.data[at + k]} << (8 * k);
    values.push({objects.mapped(object, true), value});
    at += bytes_of(object);
  }
  return values;
}

Frame pack_tpdo(const DriveObjects& objects) noexcept {
  Frame frame{.id = objects[DriveObjects::kTpdo.id] & 0x7FF};
  for (int i = 0; i < static_cast<int>(objects[DriveObjects::kTpdo.count]); ++i) {
    const uint32_t object = mapping(objects, DriveObjects::kTpdo, i);
    const uint32_t value = objects[objects.mapped(object, false)];
    for (int k = 0; k < bytes_of(object); ++k)
      frame.data[frame.length++] = static_cast<uint8_t>(value >> (8 * k));
  }
  return frame;
}

}  // namespace tendril::hal
