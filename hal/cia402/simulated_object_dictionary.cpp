// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/simulated_object_dictionary.h"

#include <algorithm>

namespace tendril::hal {
namespace {

using Entry = SimulatedEntry;

/// Whether a mode or homing method is one that this drive has; all values of other entries are.
bool is_supported(Entry entry, int8_t value) noexcept {
  if (entry == Entry::kMode)
    return value == 0 || value == kModeHoming || value == kModeCyclicPosition || value == kModeCyclicTorque;
  if (entry != Entry::kHomingMethod) return true;
  return value == 0 || value == kHomingToNegativeSwitch || value == kHomingToPositiveSwitch ||
         homes_in_place(value);
}

}  // namespace

SimulatedObjectDictionary::SimulatedObjectDictionary(int node, int pdo, uint32_t rpdo_id, uint32_t tpdo_id,
                                                     uint32_t target) noexcept
    : node_(node), pdo_(pdo), rpdo_id_(rpdo_id), tpdo_id_(tpdo_id), target_(target) {
  restore_all();
}

void SimulatedObjectDictionary::restore_all() noexcept {
  for (size_t i = 0; i < values_.size(); ++i) values_[i] = entry_descriptions()[i].initial;
  restore_communication();
}

void SimulatedObjectDictionary::restore_communication() noexcept {
  for (auto entry = Entry{}; entry != Entry::kNone; entry = entry + 1) {
    const EntryDescription& about = description(entry);
    const bool is_error = entry >= Entry::kErrorRegister && entry <= Entry::kErrorHistoryLast;
    if (about.object.index >= 0x2000 || is_error) continue;
    const int pdo_offset = about.of_pdo() ? 0x100 * (pdo_ - 1) : 0;
    const int node_offset = about.trait == EntryDescription::Trait::kAddsNode ? pdo_offset + node_ : 0;
    value_of(entry) = about.initial + static_cast<uint32_t>(node_offset);
  }
  restore_pdo(kSimulatedRpdo, rpdo_id_, kMapControlword, target_);
  restore_pdo(kSimulatedTpdo, tpdo_id_, kMapStatusword, kMapActualPosition);
}

void SimulatedObjectDictionary::restore_pdo(const PdoEntries& pdo, uint32_t cob_id, uint32_t first,
                                            uint32_t second) noexcept {
  if (cob_id == 0) return;
  value_of(pdo.id) = cob_id;
  value_of(pdo.type) = 1;
  value_of(pdo.count) = 2;
  value_of(pdo.map) = first;
  value_of(pdo.map + 1) = second;
}

int32_t SimulatedObjectDictionary::signed_value(Entry entry) const noexcept {
  return static_cast<int32_t>(description(entry).number((*this)[entry]));
}

void SimulatedObjectDictionary::set(Entry entry, uint32_t value) noexcept {
  value_of(entry) = description(entry).truncate(value);
}

void SimulatedObjectDictionary::write(Entry entry, uint32_t value) noexcept {
  set(entry, value);
  if (entry == Entry::kMode) set(Entry::kModeDisplay, value);
  if (entry == Entry::kErrorCount)
    for (Entry error = Entry::kErrorHistory; error <= Entry::kErrorHistoryLast; error = error + 1)
      set(error, 0);
}

SimulatedEntry SimulatedObjectDictionary::mapped(uint32_t mapping, bool received) const noexcept {
  const Entry entry = find({static_cast<uint16_t>(mapping >> 16), static_cast<uint8_t>(mapping >> 8)});
  if (entry == Entry::kNone) return entry;
  const EntryDescription& about = description(entry);
  const uint32_t bits = mapping & 0xFF;
  const bool fits = about.trait == EntryDescription::Trait::kMappable && bits == 8u * about.bytes() &&
                    (!received || about.writable());
  return fits ? entry : Entry::kNone;
}

void SimulatedObjectDictionary::remember_error(uint16_t code) noexcept {
  constexpr auto kFirst = static_cast<size_t>(Entry::kErrorHistory),
                 kLast = static_cast<size_t>(Entry::kErrorHistoryLast);
  for (size_t i = kLast; i > kFirst; --i) values_[i] = values_[i - 1];
  values_[kFirst] = code;
  value_of(Entry::kErrorCount) =
      std::min(value_of(Entry::kErrorCount) + 1, static_cast<uint32_t>(kLast - kFirst + 1));
}

/// The entries of PDOs are listed as those of the first.
uint16_t SimulatedObjectDictionary::index_of(const EntryDescription& about) const noexcept {
  return static_cast<uint16_t>(about.of_pdo() ? about.object.index + pdo_ - 1 : about.object.index);
}

SimulatedEntry SimulatedObjectDictionary::find(ObjectAddress object) const noexcept {
  const std::span<const EntryDescription> entries = entry_descriptions();
  for (size_t i = 0; i < entries.size(); ++i)
    if (index_of(entries[i]) == object.index && entries[i].object.sub == object.sub)
      return static_cast<Entry>(i);
  return Entry::kNone;
}

std::string_view SimulatedObjectDictionary::text(ObjectAddress object) noexcept {
  for (const TextObject& entry : text_objects())
    if (entry.index == object.index && object.sub == 0) return entry.text;
  return {};
}

uint32_t SimulatedObjectDictionary::abort_code_of_missing(ObjectAddress object) const noexcept {
  for (const TextObject& entry : text_objects())
    if (entry.index == object.index) return code(SdoAbort::kNoSubindex);
  for (const EntryDescription& about : entry_descriptions())
    if (index_of(about) == object.index) return code(SdoAbort::kNoSubindex);
  return code(SdoAbort::kNoObject);
}

SdoAnswer SimulatedObjectDictionary::read(ObjectAddress object) const noexcept {
  const Entry entry = find(object);
  if (entry == Entry::kNone) return {SdoAnswer::Kind::kAbort, object, 0, abort_code_of_missing(object)};
  return {SdoAnswer::Kind::kValue, object, description(entry).bytes(), (*this)[entry]};
}

SimulatedObjectDictionary::WriteCheck SimulatedObjectDictionary::check_write(
    const SdoRequest& request) const noexcept {
  const Entry entry = find(request.object);
  if (!text(request.object).empty()) return {entry, 0, code(SdoAbort::kReadOnly)};
  if (entry == Entry::kNone) return {entry, 0, abort_code_of_missing(request.object)};
  const EntryDescription& about = description(entry);
  if (!about.writable()) return {entry, 0, code(SdoAbort::kReadOnly)};
  if (request.size > about.bytes()) return {entry, 0, code(SdoAbort::kTooLong)};
  if (request.size != 0 && request.size < about.bytes()) return {entry, 0, code(SdoAbort::kTooShort)};
  return {entry, about.truncate(request.value), 0};
}

uint32_t SimulatedObjectDictionary::check_value(Entry entry, uint32_t value) noexcept {
  const EntryDescription& about = description(entry);
  const int64_t number = about.number(value);
  if (number < about.min || number > about.max) {
    if (about.min == about.max) return code(SdoAbort::kBadValue);
    return code(number > about.max ? SdoAbort::kValueTooHigh : SdoAbort::kValueTooLow);
  }
  return is_supported(entry, static_cast<int8_t>(value)) ? 0 : code(SdoAbort::kBadValue);
}

}  // namespace tendril::hal
