// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/simulated_drive_eds.h"

#include <algorithm>
#include <vector>

#include "hal/cia402/simulated_object_table.h"
#include "hal/drive/formatted.h"

namespace tendril::hal {
namespace {

/// DataType of CiA 301: INTEGER8, 16, 32 or UNSIGNED8, 16, 32.
int data_type(const EntryDescription& entry) {
  const int code = entry.bytes() == 1 ? 0 : entry.bytes() == 2 ? 1 : 2;
  return (entry.is_signed() ? 0x02 : 0x05) + code;
}

std::string eds_entry(const EntryDescription& entry) {
  const bool adds_node = entry.trait == EntryDescription::Trait::kAddsNode;
  std::string text = formatted("ParameterName=%s\nObjectType=0x7\nDataType=0x%04X\nAccessType=%s\n",
                               entry.name, data_type(entry), entry.writable() ? "rw" : "ro");
  if (entry.is_signed())
    text += formatted("DefaultValue=%d\n", static_cast<int>(entry.number(entry.initial)));
  else
    text += formatted(adds_node ? "DefaultValue=$NODEID+0x%X\n" : "DefaultValue=0x%X\n", entry.initial);
  if (entry.writable())
    text += formatted("LowLimit=%lld\nHighLimit=%lld\n", static_cast<long long>(entry.min),
                      static_cast<long long>(entry.max));
  const bool mappable = entry.trait == EntryDescription::Trait::kMappable;
  return text + formatted("PDOMapping=%d\n\n", mappable ? 1 : 0);
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
  std::string text = formatted("[%s]\nSupportedObjects=%zu\n", section, indices.size());
  for (size_t i = 0; i < indices.size(); ++i) text += formatted("%zu=0x%04X\n", i + 1, indices[i]);
  return text + "\n";
}

}  // namespace

std::string simulated_drive_eds() {
  std::vector<int> mandatory, optional;
  std::string objects;
  const std::span<const EntryDescription> entries = entry_descriptions();
  for (size_t i = 0; i < entries.size(); ++i) {
    const ObjectAddress object = entries[i].object;
    const auto index = static_cast<unsigned>(object.index);
    if (object.sub != 0) {
      objects += formatted("[%04Xsub%X]\n", index, static_cast<unsigned>(object.sub)) + eds_entry(entries[i]);
      continue;
    }
    const bool is_array = index == 0x1003 || index == 0x1016 || index == 0x607D || index == 0x6099;
    const bool is_mandatory = index == 0x1000 || index == 0x1001 || index == 0x1018;
    (is_mandatory ? mandatory : optional).push_back(object.index);
    unsigned count = 1;
    while (i + count < entries.size() && entries[i + count].object.index == object.index) ++count;
    objects += formatted("[%04X]\n", index);
    if (count == 1) {
      objects += eds_entry(entries[i]);
    } else {
      objects += formatted("ParameterName=%s\nObjectType=0x%d\nSubNumber=%u\n\n", entries[i].name,
                           is_array ? 8 : 9, count);
      objects += formatted("[%04Xsub0]\n", index) + eds_entry(entries[i]);
    }
  }
  for (const TextObject& object : text_objects()) {
    optional.push_back(object.index);
    objects += formatted("[%04X]\nParameterName=%s\nObjectType=0x7\nDataType=0x0009\nAccessType=const\n",
                         static_cast<unsigned>(object.index), object.name) +
               formatted("DefaultValue=%s\nPDOMapping=0\n\n", object.text.data());
  }
  std::sort(optional.begin(), optional.end());
  return std::string(kEdsHead) + eds_list("MandatoryObjects", mandatory) +
         eds_list("OptionalObjects", optional) + eds_list("ManufacturerObjects", {}) + objects;
}

}  // namespace tendril::hal
