// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/simulated_pdos.h"

#include "hal/canopen/canopen.h"

namespace tendril::hal {
namespace {

using Entry = SimulatedEntry;

constexpr int kMapEntries = 8, kMaxBytes = 8;
constexpr int64_t kInhibitUnit_ns = 100'000;  // of 1800:3
constexpr int64_t kTimerUnit_ns = 1'000'000;  // of 1800:5

// Transmission types up to this wait for SYNC; those above that are served, 254 and 255, do not.
constexpr uint32_t kSynchronousTypes = 240;

uint32_t mapping(const SimulatedObjectDictionary& objects, const PdoEntries& pdo, int entry) noexcept {
  return objects[pdo.map + entry];
}

constexpr int mapped_bytes(uint32_t mapping) noexcept { return static_cast<int>(mapping & 0xFF) / 8; }

bool is_on(const SimulatedObjectDictionary& objects, const PdoEntries& pdo) noexcept {
  return !(objects[pdo.id] & kPdoInvalid);
}

/// The bytes of a PDO as it is mapped.
int length(const SimulatedObjectDictionary& objects, const PdoEntries& pdo) noexcept {
  int bytes = 0;
  for (int i = 0; i < static_cast<int>(objects[pdo.count]); ++i)
    bytes += mapped_bytes(mapping(objects, pdo, i));
  return bytes;
}

/// A PDO that is on keeps its identifier. Identifiers of 29 bits are not supported.
uint32_t check_cob_id(const SimulatedObjectDictionary& objects, const PdoEntries& pdo,
                      uint32_t value) noexcept {
  const uint32_t id = value & 0x7FF;
  const bool shall_be_on = !(value & kPdoInvalid);
  const bool moves = is_on(objects, pdo) && shall_be_on && id != (objects[pdo.id] & 0x7FF);
  const bool is_fit = !is_restricted(id) && objects[pdo.count] != 0;
  return (value & 0x3FFF'F800) || moves || (shall_be_on && !is_fit) ? code(SdoAbort::kBadValue) : 0;
}

uint32_t check_count(const SimulatedObjectDictionary& objects, const PdoEntries& pdo,
                     uint32_t count) noexcept {
  if (count > kMapEntries) return code(SdoAbort::kPdoTooLong);
  int bytes = 0;
  for (int i = 0; i < static_cast<int>(count); ++i) {
    const uint32_t object = mapping(objects, pdo, i);
    if (object == 0) return code(SdoAbort::kNotMappable);
    bytes += mapped_bytes(object);
  }
  return bytes > kMaxBytes ? code(SdoAbort::kPdoTooLong) : 0;
}

MappedValues unpack_rpdo(const SimulatedObjectDictionary& objects, const Frame& frame) noexcept {
  MappedValues values;
  int at = 0;
  for (int i = 0; i < static_cast<int>(objects[kSimulatedRpdo.count]); ++i) {
    const uint32_t object = mapping(objects, kSimulatedRpdo, i);
    uint32_t value = 0;
    for (int k = 0; k < mapped_bytes(object); ++k) value |= uint32_t{frame.data[at + k]} << (8 * k);
    values.push({objects.mapped(object, true), value});
    at += mapped_bytes(object);
  }
  return values;
}

Frame pack_tpdo(const SimulatedObjectDictionary& objects) noexcept {
  Frame frame{.id = objects[kSimulatedTpdo.id] & 0x7FF};
  for (int i = 0; i < static_cast<int>(objects[kSimulatedTpdo.count]); ++i) {
    const uint32_t object = mapping(objects, kSimulatedTpdo, i);
    const uint32_t value = objects[objects.mapped(object, false)];
    for (int k = 0; k < mapped_bytes(object); ++k)
      frame.data[frame.length++] = static_cast<uint8_t>(value >> (8 * k));
  }
  return frame;
}

}  // namespace

bool is_pdo_setting(Entry entry) noexcept { return entry >= Entry::kRpdoId && entry <= Entry::kTpdoMapLast; }

uint32_t check_pdo_setting(const SimulatedObjectDictionary& objects, Entry entry, uint32_t value) noexcept {
  const bool received = entry < Entry::kTpdoCount;
  const PdoEntries& pdo = received ? kSimulatedRpdo : kSimulatedTpdo;
  if (entry == pdo.id) return check_cob_id(objects, pdo, value);
  if (entry == pdo.type) return value > kSynchronousTypes && value < 254 ? code(SdoAbort::kBadValue) : 0;
  if (entry == Entry::kTpdoTimer) return 0;
  if (is_on(objects, pdo)) return code(SdoAbort::kUnsupportedAccess);
  if (entry == Entry::kTpdoInhibit) return 0;
  if (entry == pdo.count) return check_count(objects, pdo, value);
  if (objects[pdo.count] != 0) return code(SdoAbort::kUnsupportedAccess);
  const bool is_good = value == 0 || objects.mapped(value, received) != Entry::kNone;
  return is_good ? 0 : code(SdoAbort::kNotMappable);
}

void SimulatedPdos::restart() noexcept {
  has_rpdo_ = false;
  syncs_since_tpdo_ = 0;
  last_tpdo_ = {};  // so that the first one after the start goes as a change
  tpdo_ns_ = kLongAgo_ns;
}

bool SimulatedPdos::receive(const SimulatedObjectDictionary& objects, const Frame& frame) noexcept {
  // Bit 30 means nothing in 1400:1. [CiA 301]
  if (!is_on(objects, kSimulatedRpdo) || frame.id != (objects[Entry::kRpdoId] & 0x7FF)) return false;
  const bool was_too_short = rpdo_too_short_;
  rpdo_too_short_ = frame.length < length(objects, kSimulatedRpdo);
  if (!rpdo_too_short_) {
    rpdo_ = frame;
    has_rpdo_ = true;
  }
  return rpdo_too_short_ != was_too_short;
}

bool SimulatedPdos::rpdo_due(const SimulatedObjectDictionary& objects) const noexcept {
  return has_rpdo_ && objects[Entry::kRpdoType] > kSynchronousTypes;
}

std::optional<MappedValues> SimulatedPdos::take_rpdo(const SimulatedObjectDictionary& objects) noexcept {
  if (!has_rpdo_) return std::nullopt;
  has_rpdo_ = false;
  return unpack_rpdo(objects, rpdo_);
}

void SimulatedPdos::on_sync(const SimulatedObjectDictionary& objects, int64_t now_ns,
                            FrameBatch& out) noexcept {
  const uint32_t type = objects[Entry::kTpdoType];
  if (type == 0)
    send(objects, true, now_ns, out);
  else if (type <= kSynchronousTypes && ++syncs_since_tpdo_ >= static_cast<int>(type))
    send(objects, false, now_ns, out);
}

void SimulatedPdos::advance(const SimulatedObjectDictionary& objects, int64_t now_ns,
                            FrameBatch& out) noexcept {
  if (objects[Entry::kTpdoType] <= kSynchronousTypes) return;
  const int64_t age_ns = now_ns - tpdo_ns_;
  const int64_t timer_ns = objects[Entry::kTpdoTimer] * kTimerUnit_ns;
  if (age_ns < objects[Entry::kTpdoInhibit] * kInhibitUnit_ns) return;
  send(objects, timer_ns == 0 || age_ns < timer_ns, now_ns, out);
}

void SimulatedPdos::send(const SimulatedObjectDictionary& objects, bool only_if_changed, int64_t now_ns,
                         FrameBatch& out) noexcept {
  if (!is_on(objects, kSimulatedTpdo)) return;
  const Frame frame = pack_tpdo(objects);
  if (only_if_changed && frame == last_tpdo_) return;
  last_tpdo_ = frame;
  tpdo_ns_ = now_ns;
  syncs_since_tpdo_ = 0;
  out.push(frame);
}

}  // namespace tendril::hal
