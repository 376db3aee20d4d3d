// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <zstd.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tendril::app {

/// Takes numbers and texts out of bytes.
struct Cursor {
  uint64_t number(int size) {
    uint64_t value = 0;
    for (int k = 0; k < size; ++k)
      value |= static_cast<uint64_t>(static_cast<uint8_t>(bytes.at(at++))) << (8 * k);
    return value;
  }
  std::string text() {
    const uint64_t size = number(4);
    at += size;
    return std::string(bytes.substr(at - size, size));
  }
  std::string_view bytes;
  std::size_t at = 0;
};

struct Record {
  uint8_t opcode;
  std::size_t offset;
  std::string_view body;
};

inline std::vector<Record> records_of(std::string_view bytes) {
  std::vector<Record> records;
  for (Cursor cursor{bytes}; cursor.at < bytes.size();) {
    const std::size_t offset = cursor.at;
    const auto opcode = static_cast<uint8_t>(cursor.number(1));
    const uint64_t size = cursor.number(8);
    records.push_back({opcode, offset, bytes.substr(cursor.at, size)});
    cursor.at += size;
  }
  return records;
}

inline std::string decompressed(std::string_view bytes, std::size_t size) {
  std::string result(size, '\0');
  if (::ZSTD_decompress(result.data(), size, bytes.data(), bytes.size()) != size)
    throw std::runtime_error("not compressed as it says");
  return result;
}

/// All messages of a file, which may lack its end, one after the other.
inline std::string text_of_messages(std::string_view file) {
  if (file.ends_with("\x89MCAP0\r\n")) file.remove_suffix(8);
  std::string text;
  if (file.empty()) return text;
  for (const Record& record : records_of(file.substr(8))) {
    if (record.opcode != 0x06) continue;
    Cursor chunk{record.body, 16};
    const uint64_t size = chunk.number(8);
    chunk.at += 4;
    chunk.text();
    chunk.number(8);
    text += decompressed(record.body.substr(chunk.at), size);
  }
  return text;
}

}  // namespace tendril::app
