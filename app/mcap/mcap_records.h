// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace tendril::app {

/// How the messages of some topics are made up. The number of a schema is its place in a list, from 1 on.
struct McapSchema {
  std::string name;
  std::string encoding;  ///< "jsonschema"
  std::string data;
};

/// A topic and how its messages are written. The number of a channel is its place in a list, from 0 on.
struct McapChannel {
  std::string topic;
  std::string encoding;  ///< "json"
  uint16_t schema = 0;   ///< its number; 0: none
};

/// A named table of texts beside the messages.
struct McapMetadata {
  std::string name;
  std::map<std::string, std::string> values;
};

/// What every file of a log begins with.
struct McapContent {
  std::string library;  ///< the program that writes
  std::vector<McapSchema> schemas;
  std::vector<McapChannel> channels;
  std::vector<McapMetadata> metadata;
};

/// What a record is, its first byte.
enum class McapOpcode : uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// The bytes at both ends of a file.
inline constexpr std::string_view kMcapMagic{"\x89MCAP0\r\n", 8};

/// Records one after the other, as bytes: numbers little-endian, texts and tables with their length before
/// them. Real-time: no, for all of it (allocates).
class McapRecords {
 public:
  /// Begins a record, whose fields are put() next. @return  for end()
  std::size_t begin(McapOpcode opcode);
  /// All fields are there: tells their length.
  /// @param record  of begin()
  void end(std::size_t record);

  void put8(uint8_t value) { put_number(value, 1); }
  void put16(uint16_t value) { put_number(value, 2); }
  void put32(uint32_t value) { put_number(value, 4); }
  void put64(uint64_t value) { put_number(value, 8); }
  void put(std::string_view text);  ///< its length, 32 bits, and its bytes
  void put_raw(std::string_view bytes) { bytes_.append(bytes); }

  void put_schema(uint16_t number, const McapSchema& schema);
  void put_channel(uint16_t number, const McapChannel& channel);

  std::size_t size() const { return bytes_.size(); }
  const std::string& bytes() const { return bytes_; }
  void clear() { bytes_.clear(); }

 private:
  void put_number(uint64_t value, int size);

  std::string bytes_;
};

}  // namespace tendril::app
