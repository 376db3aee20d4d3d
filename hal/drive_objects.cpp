#include "hal/drive_objects.h"

#include "hal/cia402.h"

namespace tendril::hal {
namespace {

enum class Right : uint8_t { kRead, kWrite };

struct Entry {
  ObjectAddress object;
  int8_t size;  // bytes; negative for signed values
  Right right;
  uint32_t initial;
  int64_t min, max;
  bool add_node = false;  // the initial value is a COB-ID of the predefined connection set
};

constexpr int64_t kAnyU8 = 0xFF, kAnyU16 = 0xFFFF, kAnyU32 = 0xFFFF'FFFF;

// In the order of DriveObjects::Slot. 1000 reads: profile 402 (0x192), servo drive (bit 17).
constexpr std::array<Entry, DriveObjects::kSlots> kEntries = {{
    {{0x1000, 0}, 4, Right::kRead, 0x0002'0192, 0, kAnyU32},
    {{0x1001, 0}, 1, Right::kRead, 0, 0, kAnyU8},
    {{0x1016, 0}, 1, Right::kRead, 1, 0, kAnyU8},
    {{0x1016, 1}, 4, Right::kWrite, 0, 0, 0x007F'FFFF},
    {{0x1017, 0}, 2, Right::kWrite, 0, 0, kAnyU16},
    {{0x1018, 0}, 1, Right::kRead, 4, 0, kAnyU8},
    {{0x1018, 1}, 4, Right::kRead, 0, 0, kAnyU32},
    {{0x1018, 2}, 4, Right::kRead, 0x402, 0, kAnyU32},
    {{0x1018, 3}, 4, Right::kRead, 1, 0, kAnyU32},
    {{0x1018, 4}, 4, Right::kRead, 0, 0, kAnyU32},
    {{0x1400, 0}, 1, Right::kRead, 2, 0, kAnyU8},
    {{0x1400, 1}, 4, Right::kWrite, kPdoInvalid | kRpdo1Base, 0, kAnyU32, true},
    {{0x1400, 2}, 1, Right::kWrite, 255, 0, kAnyU8},
    {{0x1600, 0}, 1, Right::kWrite, 0, 0, 2},
    {{0x1600, 1}, 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1600, 2}, 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1800, 0}, 1, Right::kRead, 2, 0, kAnyU8},
    {{0x1800, 1}, 4, Right::kWrite, kPdoInvalid | kTpdo1Base, 0, kAnyU32, true},
    {{0x1800, 2}, 1, Right::kWrite, 1, 1, 240},
    {{0x1A00, 0}, 1, Right::kWrite, 0, 0, 2},
    {{0x1A00, 1}, 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1A00, 2}, 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x6040, 0}, 2, Right::kWrite, 0, 0, kAnyU16},
    {{0x6041, 0}, 2, Right::kRead, 0, 0, kAnyU16},
    {{0x6060, 0}, -1, Right::kWrite, 0, INT8_MIN, INT8_MAX},
    {{0x6061, 0}, -1, Right::kRead, 0, INT8_MIN, INT8_MAX},
    {{0x6064, 0}, -4, Right::kRead, 0, INT32_MIN, INT32_MAX},
    {{0x6065, 0}, 4, Right::kWrite, 0xFFFF'FFFF, 0, kAnyU32},
    {{0x607A, 0}, -4, Right::kWrite, 0, INT32_MIN, INT32_MAX},
    {{0x607D, 0}, 1, Right::kRead, 2, 0, kAnyU8},
    {{0x607D, 1}, -4, Right::kWrite, 0, INT32_MIN, INT32_MAX},
    {{0x607D, 2}, -4, Right::kWrite, 0, INT32_MIN, INT32_MAX},
    {{0x60C2, 0}, 1, Right::kRead, 2, 0, kAnyU8},
    {{0x60C2, 1}, 1, Right::kWrite, 1, 1, 255},
    {{0x60C2, 2}, -1, Right::kWrite, 0xFD, -6, 0},
}};

constexpr int bytes_of(const Entry& entry) noexcept { return entry.size < 0 ? -entry.size : entry.size; }

int32_t sign_extend(uint32_t value, int bytes) noexcept {
  const int shift = 32 - 8 * bytes;
  return static_cast<int32_t>(value << shift) >> shift;
}

constexpr uint32_t code(SdoAbort abort) noexcept { return static_cast<uint32_t>(abort); }

}  // namespace

DriveObjects::DriveObjects(int node) noexcept : node_(node) { restore_all(); }

void DriveObjects::restore_all() noexcept {
  restore_communication();
  for (int i = 0; i < kSlots; ++i)
    if (kEntries[i].object.index >= 0x2000) values_[i] = kEntries[i].initial;
}

void DriveObjects::restore_communication() noexcept {
  for (int i = 0; i < kSlots; ++i)
    if (kEntries[i].object.index < 0x2000)
      values_[i] = kEntries[i].initial + (kEntries[i].add_node ? static_cast<uint32_t>(node_) : 0);
}

int32_t DriveObjects::signed_value(Slot slot) const noexcept {
  return sign_extend(values_[slot], bytes_of(kEntries[slot]));
}

void DriveObjects::set(Slot slot, uint32_t value) noexcept {
  const int bytes = bytes_of(kEntries[slot]);
  values_[slot] = bytes == 4 ? value : value & ((1u << (8 * bytes)) - 1);
}

DriveObjects::Slot DriveObjects::find(ObjectAddress object) const noexcept {
  for (int i = 0; i < kSlots; ++i)
    if (kEntries[i].object == object) return static_cast<Slot>(i);
  return kSlots;
}

uint32_t DriveObjects::missing(ObjectAddress object) const noexcept {
  for (const Entry& entry : kEntries)
    if (entry.object.index == object.index) return code(SdoAbort::kNoSubindex);
  return code(SdoAbort::kNoObject);
}

SdoAnswer DriveObjects::read(ObjectAddress object) const noexcept {
  const Slot slot = find(object);
  if (slot == kSlots) return {SdoAnswer::Kind::kAbort, object, 0, missing(object)};
  return {SdoAnswer::Kind::kValue, object, bytes_of(kEntries[slot]), values_[slot]};
}

DriveObjects::Access DriveObjects::check_write(const SdoRequest& request) const noexcept {
  const Slot slot = find(request.object);
  if (slot == kSlots) return {slot, missing(request.object)};
  const Entry& entry = kEntries[slot];
  const int bytes = bytes_of(entry);
  if (entry.right == Right::kRead) return {slot, code(SdoAbort::kReadOnly)};
  if (request.size > bytes) return {slot, code(SdoAbort::kTooLong)};
  if (request.size != 0 && request.size < bytes) return {slot, code(SdoAbort::kTooShort)};
  const uint32_t low = bytes == 4 ? request.value : request.value & ((1u << (8 * bytes)) - 1);
  const int64_t value = entry.size < 0 ? int64_t{sign_extend(low, bytes)} : int64_t{low};
  if (value > entry.max) return {slot, code(SdoAbort::kValueTooHigh)};
  if (value < entry.min) return {slot, code(SdoAbort::kValueTooLow)};
  return {slot, 0};
}

}  // namespace tendril::hal
