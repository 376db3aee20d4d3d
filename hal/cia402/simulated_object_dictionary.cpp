#include "hal/cia402/simulated_object_dictionary.h"

#include <algorithm>
#include <cstdio>
#include <vector>

#include "hal/canopen/canopen.h"

namespace tendril::hal {
namespace {

enum class Right : uint8_t { kRead, kWrite };

enum class Trait : uint8_t {
  kNone,
  kAddsNode,  // its initial value is a COB-ID of the predefined connection set
  kMappable   // into a TPDO, and an RPDO where it can be written
};

struct Entry {
  ObjectAddress object;
  const char* name;
  int8_t size;  // bytes; negative for signed values
  Right right;
  uint32_t initial;
  int64_t min, max;
  Trait trait = Trait::kNone;
};

constexpr int64_t kAnyU8 = 0xFF, kAnyU16 = 0xFFFF, kAnyU32 = 0xFFFF'FFFF;

constexpr uint32_t kModes =
    1u << (kModeHoming - 1) | 1u << (kModeCyclicPosition - 1) | 1u << (kModeCyclicTorque - 1);

// In the order of SimulatedObjectDictionary::Slot. 1000 reads: profile 402 (0x192), servo drive (bit 17); of
// 6502, bit n - 1 stands for mode n.
constexpr std::array<Entry, SimulatedObjectDictionary::kSlots> kEntries = {{
    {{0x1000, 0}, "Device type", 4, Right::kRead, 0x0002'0192, 0, kAnyU32},
    {{0x1001, 0}, "Error register", 1, Right::kRead, 0, 0, kAnyU8, Trait::kMappable},
    {{0x1003, 0}, "Error history", 1, Right::kWrite, 0, 0, 0},
    {{0x1003, 1}, "Error 1", 4, Right::kRead, 0, 0, kAnyU32},
    {{0x1003, 2}, "Error 2", 4, Right::kRead, 0, 0, kAnyU32},
    {{0x1003, 3}, "Error 3", 4, Right::kRead, 0, 0, kAnyU32},
    {{0x1003, 4}, "Error 4", 4, Right::kRead, 0, 0, kAnyU32},
    {{0x1005, 0}, "SYNC COB-ID", 4, Right::kWrite, kSyncId, kSyncId, kSyncId},
    {{0x1014, 0}, "EMCY COB-ID", 4, Right::kRead, kEmergencyBase, 0, kAnyU32, Trait::kAddsNode},
    {{0x1016, 0}, "Consumer heartbeats", 1, Right::kRead, 1, 0, kAnyU8},
    {{0x1016, 1}, "Consumer heartbeat 1", 4, Right::kWrite, 0, 0, 0x007F'FFFF},
    {{0x1017, 0}, "Producer heartbeat time", 2, Right::kWrite, 0, 0, kAnyU16},
    {{0x1018, 0}, "Identity", 1, Right::kRead, 4, 0, kAnyU8},
    {{0x1018, 1}, "Vendor", 4, Right::kRead, 0, 0, kAnyU32},
    {{0x1018, 2}, "Product code", 4, Right::kRead, 0x402, 0, kAnyU32},
    {{0x1018, 3}, "Revision", 4, Right::kRead, 1, 0, kAnyU32},
    {{0x1018, 4}, "Serial number", 4, Right::kRead, 0, 0, kAnyU32},
    {{0x1400, 0}, "RPDO 1 parameters", 1, Right::kRead, 2, 0, kAnyU8},
    {{0x1400, 1}, "RPDO 1 COB-ID", 4, Right::kWrite, kPdoInvalid | kRpdo1Base, 0, kAnyU32, Trait::kAddsNode},
    {{0x1400, 2}, "RPDO 1 transmission type", 1, Right::kWrite, 255, 0, kAnyU8},
    {{0x1600, 0}, "RPDO 1 mapping", 1, Right::kWrite, 0, 0, 8},
    {{0x1600, 1}, "RPDO 1 mapped object 1", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1600, 2}, "RPDO 1 mapped object 2", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1600, 3}, "RPDO 1 mapped object 3", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1600, 4}, "RPDO 1 mapped object 4", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1600, 5}, "RPDO 1 mapped object 5", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1600, 6}, "RPDO 1 mapped object 6", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1600, 7}, "RPDO 1 mapped object 7", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1600, 8}, "RPDO 1 mapped object 8", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1800, 0}, "TPDO 1 parameters", 1, Right::kRead, 5, 0, kAnyU8},
    {{0x1800, 1}, "TPDO 1 COB-ID", 4, Right::kWrite, kPdoInvalid | kTpdo1Base, 0, kAnyU32, Trait::kAddsNode},
    {{0x1800, 2}, "TPDO 1 transmission type", 1, Right::kWrite, 1, 0, kAnyU8},
    {{0x1800, 3}, "TPDO 1 inhibit time", 2, Right::kWrite, 10, 0, kAnyU16},
    {{0x1800, 5}, "TPDO 1 event timer", 2, Right::kWrite, 0, 0, kAnyU16},
    {{0x1A00, 0}, "TPDO 1 mapping", 1, Right::kWrite, 0, 0, 8},
    {{0x1A00, 1}, "TPDO 1 mapped object 1", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1A00, 2}, "TPDO 1 mapped object 2", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1A00, 3}, "TPDO 1 mapped object 3", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1A00, 4}, "TPDO 1 mapped object 4", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1A00, 5}, "TPDO 1 mapped object 5", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1A00, 6}, "TPDO 1 mapped object 6", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1A00, 7}, "TPDO 1 mapped object 7", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x1A00, 8}, "TPDO 1 mapped object 8", 4, Right::kWrite, 0, 0, kAnyU32},
    {{0x6007, 0}, "Abort connection option", -2, Right::kWrite, 1, 1, 1},
    {{0x603F, 0}, "Error code", 2, Right::kRead, 0, 0, kAnyU16, Trait::kMappable},
    {{0x6040, 0}, "Controlword", 2, Right::kWrite, 0, 0, kAnyU16, Trait::kMappable},
    {{0x6041, 0}, "Statusword", 2, Right::kRead, 0, 0, kAnyU16, Trait::kMappable},
    {{0x605A, 0}, "Quick stop option", -2, Right::kWrite, 6, 6, 6},
    {{0x605D, 0}, "Halt option", -2, Right::kWrite, 1, 1, 1},
    {{0x6060, 0}, "Mode of operation", -1, Right::kWrite, 0, INT8_MIN, INT8_MAX, Trait::kMappable},
    {{0x6061, 0}, "Mode of operation display", -1, Right::kRead, 0, INT8_MIN, INT8_MAX, Trait::kMappable},
    {{0x6064, 0}, "Actual position", -4, Right::kRead, 0, INT32_MIN, INT32_MAX, Trait::kMappable},
    {{0x6065, 0}, "Following error window", 4, Right::kWrite, 0xFFFF'FFFF, 0, kAnyU32},
    {{0x6066, 0}, "Following error time out", 2, Right::kWrite, 0, 0, kAnyU16},
    {{0x6071, 0}, "Target torque", -2, Right::kWrite, 0, INT16_MIN, INT16_MAX, Trait::kMappable},
    {{0x6076, 0}, "Motor rated torque", 4, Right::kRead, 0, 0, kAnyU32},
    {{0x6077, 0}, "Torque actual value", -2, Right::kRead, 0, INT16_MIN, INT16_MAX, Trait::kMappable},
    {{0x607A, 0}, "Target position", -4, Right::kWrite, 0, INT32_MIN, INT32_MAX, Trait::kMappable},
    {{0x607D, 0}, "Software position limits", 1, Right::kRead, 2, 0, kAnyU8},
    {{0x607D, 1}, "Least position", -4, Right::kWrite, 0, INT32_MIN, INT32_MAX},
    {{0x607D, 2}, "Greatest position", -4, Right::kWrite, 0, INT32_MIN, INT32_MAX},
    {{0x6098, 0}, "Homing method", -1, Right::kWrite, 0, INT8_MIN, INT8_MAX},
    {{0x6099, 0}, "Homing speeds", 1, Right::kRead, 2, 0, kAnyU8},
    {{0x6099, 1}, "Homing speed for the switch", 4, Right::kWrite, 20'000, 1, kAnyU32},
    {{0x6099, 2}, "Homing speed for the zero", 4, Right::kWrite, 2'000, 1, kAnyU32},
    {{0x609A, 0}, "Homing acceleration", 4, Right::kWrite, 200'000, 1, kAnyU32},
    {{0x60C2, 0}, "Interpolation period", 1, Right::kRead, 2, 0, kAnyU8},
    {{0x60C2, 1}, "Interpolation period value", 1, Right::kWrite, 1, 1, 255},
    {{0x60C2, 2}, "Interpolation period exponent", -1, Right::kWrite, 0xFD, -6, 0},
    {{0x6502, 0}, "Supported drive modes", 4, Right::kRead, kModes, 0, kAnyU32},
}};

struct TextEntry {
  uint16_t index;
  const char* name;
  std::string_view text;
};

constexpr std::array<TextEntry, 3> kTexts = {{{0x1008, "Device name", "tendril-plant"},
                                              {0x1009, "Hardware version", "simulated"},
                                              {0x100A, "Software version", "1.0"}}};

constexpr int bytes_of(const Entry& entry) noexcept { return entry.size < 0 ? -entry.size : entry.size; }

/// Whether an object is of PDO parameters or mappings.
constexpr bool is_pdo(uint16_t index) noexcept { return index >= 0x1400 && index < 0x2000; }

int32_t sign_extend(uint32_t value, int bytes) noexcept {
  const int shift = 32 - 8 * bytes;
  return static_cast<int32_t>(value << shift) >> shift;
}

std::string text_of(const char* format, auto... values) {
  char text[160];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

/// DataType of CiA 301: INTEGER8, 16, 32 or UNSIGNED8, 16, 32.
int data_type(const Entry& entry) {
  if (entry.size < 0) return entry.size == -1 ? 0x02 : entry.size == -2 ? 0x03 : 0x04;
  return entry.size == 1 ? 0x05 : entry.size == 2 ? 0x06 : 0x07;
}

std::string eds_entry(const Entry& entry) {
  const bool is_writable = entry.right == Right::kWrite;
  const bool adds_node = entry.trait == Trait::kAddsNode;
  std::string text = text_of("ParameterName=%s\nObjectType=0x7\nDataType=0x%04X\nAccessType=%s\n", entry.name,
                             data_type(entry), is_writable ? "rw" : "ro");
  if (entry.size < 0)
    text += text_of("DefaultValue=%d\n", sign_extend(entry.initial, bytes_of(entry)));
  else
    text += text_of(adds_node ? "DefaultValue=$NODEID+0x%X\n" : "DefaultValue=0x%X\n", entry.initial);
  if (is_writable)
    text += text_of("LowLimit=%lld\nHighLimit=%lld\n", static_cast<long long>(entry.min),
                    static_cast<long long>(entry.max));
  return text + text_of("PDOMapping=%d\n\n", entry.trait == Trait::kMappable ? 1 : 0);
}

// All bit rates of CiA 301: which one is in force is the bus's affair.
constexpr std::string_view kEdsHead = R"([FileInfo]
FileName=tendril-drive.eds
FileVersion=1
FileRevision=1
EDSVersion=4.0
Description=The simulated CiA 402 drive of tendril-plant
CreatedBy=Tendril

[DeviceInfo]
VendorName=Tendril
VendorNumber=0x0
ProductName=tendril-plant
ProductNumber=0x402
RevisionNumber=0x1
OrderCode=none
BaudRate_10=1
BaudRate_20=1
BaudRate_50=1
BaudRate_125=1
BaudRate_250=1
BaudRate_500=1
BaudRate_800=1
BaudRate_1000=1
SimpleBootUpMaster=0
SimpleBootUpSlave=1
Granularity=8
DynamicChannelsSupported=0
GroupMessaging=0
NrOfRXPDO=1
NrOfTXPDO=1
LSS_Supported=0

[DummyUsage]
Dummy0001=0
Dummy0002=0
Dummy0003=0
Dummy0004=0
Dummy0005=0
Dummy0006=0
Dummy0007=0

)";

/// The section that lists the objects of a kind.
std::string eds_list(const char* section, const std::vector<int>& indices) {
  std::string text = text_of("[%s]\nSupportedObjects=%zu\n", section, indices.size());
  for (size_t i = 0; i < indices.size(); ++i) text += text_of("%zu=0x%04X\n", i + 1, indices[i]);
  return text + "\n";
}

}  // namespace

std::string simulated_drive_eds() {
  std::vector<int> mandatory, optional;
  std::string objects;
  for (size_t i = 0; i < kEntries.size(); ++i) {
    const ObjectAddress object = kEntries[i].object;
    const auto index = static_cast<unsigned>(object.index);
    if (object.sub != 0) {
      objects += text_of("[%04Xsub%X]\n", index, static_cast<unsigned>(object.sub)) + eds_entry(kEntries[i]);
      continue;
    }
    const bool is_array = index == 0x1003 || index == 0x1016 || index == 0x607D || index == 0x6099;
    const bool is_mandatory = index == 0x1000 || index == 0x1001 || index == 0x1018;
    (is_mandatory ? mandatory : optional).push_back(object.index);
    unsigned entries = 1;
    while (i + entries < kEntries.size() && kEntries[i + entries].object.index == object.index) ++entries;
    objects += text_of("[%04X]\n", index);
    if (entries == 1) {
      objects += eds_entry(kEntries[i]);
    } else {
      objects += text_of("ParameterName=%s\nObjectType=0x%d\nSubNumber=%u\n\n", kEntries[i].name,
                         is_array ? 8 : 9, entries);
      objects += text_of("[%04Xsub0]\n", index) + eds_entry(kEntries[i]);
    }
  }
  for (const TextEntry& entry : kTexts) {
    optional.push_back(entry.index);
    objects += text_of("[%04X]\nParameterName=%s\nObjectType=0x7\nDataType=0x0009\nAccessType=const\n",
                       static_cast<unsigned>(entry.index), entry.name) +
               text_of("DefaultValue=%s\nPDOMapping=0\n\n", entry.text.data());
  }
  std::sort(optional.begin(), optional.end());
  return std::string(kEdsHead) + eds_list("MandatoryObjects", mandatory) +
         eds_list("OptionalObjects", optional) + eds_list("ManufacturerObjects", {}) + objects;
}

SimulatedObjectDictionary::SimulatedObjectDictionary(int node, int pdo, uint32_t rpdo_id, uint32_t tpdo_id,
                                                     uint32_t target) noexcept
    : node_(node), pdo_(pdo), rpdo_id_(rpdo_id), tpdo_id_(tpdo_id), target_(target) {
  restore_all();
}

void SimulatedObjectDictionary::restore_all() noexcept {
  for (int i = 0; i < kSlots; ++i) values_[i] = kEntries[i].initial;
  restore_communication();
}

void SimulatedObjectDictionary::restore_communication() noexcept {
  for (int i = 0; i < kSlots; ++i) {
    const Entry& entry = kEntries[i];
    if (entry.object.index >= 0x2000 || (i >= kErrorRegister && i <= kErrorHistoryLast)) continue;
    const int pdo_offset = is_pdo(entry.object.index) ? 0x100 * (pdo_ - 1) : 0;
    const int node_offset = entry.trait == Trait::kAddsNode ? pdo_offset + node_ : 0;
    values_[i] = entry.initial + static_cast<uint32_t>(node_offset);
  }
  const auto restore_pdo = [this](const Pdo& pdo, uint32_t cob_id, uint32_t first, uint32_t second) {
    if (cob_id == 0) return;
    values_[pdo.id] = cob_id;
    values_[pdo.type] = 1;
    values_[pdo.count] = 2;
    values_[pdo.map] = first;
    values_[pdo.map + 1] = second;
  };
  restore_pdo(kRpdo, rpdo_id_, kMapControlword, target_);
  restore_pdo(kTpdo, tpdo_id_, kMapStatusword, kMapActualPosition);
}

int32_t SimulatedObjectDictionary::signed_value(Slot slot) const noexcept {
  return sign_extend(values_[slot], bytes_of(kEntries[slot]));
}

void SimulatedObjectDictionary::set(Slot slot, uint32_t value) noexcept {
  const int bytes = bytes_of(kEntries[slot]);
  values_[slot] = bytes == 4 ? value : value & ((1u << (8 * bytes)) - 1);
}

int SimulatedObjectDictionary::bytes(Slot slot) noexcept { return bytes_of(kEntries[slot]); }

SimulatedObjectDictionary::Slot SimulatedObjectDictionary::mapped(uint32_t mapping,
                                                                  bool received) const noexcept {
  const Slot slot = find({static_cast<uint16_t>(mapping >> 16), static_cast<uint8_t>(mapping >> 8)});
  if (slot == kSlots) return slot;
  const Entry& entry = kEntries[slot];
  const bool fits = entry.trait == Trait::kMappable && (mapping & 0xFF) == 8u * bytes(slot) &&
                    (!received || entry.right == Right::kWrite);
  return fits ? slot : kSlots;
}

void SimulatedObjectDictionary::remember_error(uint16_t code) noexcept {
  constexpr int kErrors = kErrorHistoryLast - kErrorHistory + 1;
  for (int i = kErrorHistoryLast; i > kErrorHistory; --i) values_[i] = values_[i - 1];
  values_[kErrorHistory] = code;
  values_[kErrorCount] = std::min(values_[kErrorCount] + 1, uint32_t{kErrors});
}

/// The entries of PDOs are listed as those of the first.
uint16_t SimulatedObjectDictionary::index_of(Slot slot) const noexcept {
  const uint16_t index = kEntries[slot].object.index;
  return static_cast<uint16_t>(is_pdo(index) ? index + pdo_ - 1 : index);
}

SimulatedObjectDictionary::Slot SimulatedObjectDictionary::find(ObjectAddress object) const noexcept {
  for (int i = 0; i < kSlots; ++i)
    if (const auto slot = static_cast<Slot>(i);
        index_of(slot) == object.index && kEntries[i].object.sub == object.sub)
      return slot;
  return kSlots;
}

std::string_view SimulatedObjectDictionary::text(ObjectAddress object) noexcept {
  for (const TextEntry& entry : kTexts)
    if (entry.index == object.index && object.sub == 0) return entry.text;
  return {};
}

uint32_t SimulatedObjectDictionary::missing(ObjectAddress object) const noexcept {
  for (const TextEntry& entry : kTexts)
    if (entry.index == object.index) return code(SdoAbort::kNoSubindex);
  for (int i = 0; i < kSlots; ++i)
    if (index_of(static_cast<Slot>(i)) == object.index) return code(SdoAbort::kNoSubindex);
  return code(SdoAbort::kNoObject);
}

SdoAnswer SimulatedObjectDictionary::read(ObjectAddress object) const noexcept {
  const Slot slot = find(object);
  if (slot == kSlots) return {SdoAnswer::Kind::kAbort, object, 0, missing(object)};
  return {SdoAnswer::Kind::kValue, object, bytes_of(kEntries[slot]), values_[slot]};
}

SimulatedObjectDictionary::Access SimulatedObjectDictionary::check_write(
    const SdoRequest& request) const noexcept {
  const Slot slot = find(request.object);
  if (!text(request.object).empty()) return {slot, 0, code(SdoAbort::kReadOnly)};
  if (slot == kSlots) return {slot, 0, missing(request.object)};
  const int size = bytes(slot);
  if (kEntries[slot].right == Right::kRead) return {slot, 0, code(SdoAbort::kReadOnly)};
  if (request.size > size) return {slot, 0, code(SdoAbort::kTooLong)};
  if (request.size != 0 && request.size < size) return {slot, 0, code(SdoAbort::kTooShort)};
  return {slot, size == 4 ? request.value : request.value & ((1u << (8 * size)) - 1), 0};
}

uint32_t SimulatedObjectDictionary::check_range(Slot slot, uint32_t value) noexcept {
  const Entry& entry = kEntries[slot];
  const int64_t number = entry.size < 0 ? int64_t{sign_extend(value, bytes(slot))} : int64_t{value};
  if (number >= entry.min && number <= entry.max) return 0;
  if (entry.min == entry.max) return code(SdoAbort::kBadValue);
  return code(number > entry.max ? SdoAbort::kValueTooHigh : SdoAbort::kValueTooLow);
}

}  // namespace tendril::hal
