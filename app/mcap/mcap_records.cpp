// SPDX-License-Identifier: Apache-2.0
#include "app/mcap/mcap_records.h"

namespace tendril::app {
namespace {

constexpr std::size_t kLengthSize = 8;  // bytes of the length of a record

char byte_of(uint64_t value, int place) { return static_cast<char>(value >> (8 * place) & 0xFF); }

}  // namespace

std::size_t McapRecords::begin(McapOpcode opcode) {
  put8(static_cast<uint8_t>(opcode));
  put64(0);
  return bytes_.size();
}

void McapRecords::end(std::size_t record) {
  const uint64_t length = bytes_.size() - record;
  for (std::size_t k = 0; k < kLengthSize; ++k)
    bytes_[record - kLengthSize + k] = byte_of(length, static_cast<int>(k));
}

void McapRecords::put_number(uint64_t value, int size) {
  for (int place = 0; place < size; ++place) bytes_.push_back(byte_of(value, place));
}

void McapRecords::put(std::string_view text) {
  put32(static_cast<uint32_t>(text.size()));
  put_raw(text);
}

void McapRecords::put_schema(uint16_t number, const McapSchema& schema) {
  const std::size_t record = begin(McapOpcode::kSchema);
  put16(number);
  put(schema.name);
  put(schema.encoding);
  put(schema.data);
  end(record);
}

void McapRecords::put_channel(uint16_t number, const McapChannel& channel) {
  const std::size_t record = begin(McapOpcode::kChannel);
  put16(number);
  put16(channel.schema);
  put(channel.topic);
  put(channel.encoding);
  put32(0);  // bytes of a table of texts that we do not use
  end(record);
}

}  // namespace tendril::app
