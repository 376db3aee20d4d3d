// SPDX-License-Identifier: Apache-2.0
#include "app/mcap/mcap_writer.h"

#include <zlib.h>

#include <catch2/catch.hpp>
#include <utility>

#include "tests/app/mcap/mcap_bytes.h"

// The layout is that of https://mcap.dev/spec, read here byte by byte.

namespace tendril::app::mcap_writer_test {

/// Keeps all bytes, until it is full.
struct Memory : ByteSink {
  bool append(std::string_view more) override {
    if (bytes.size() + more.size() > room) return false;
    bytes += more;
    return true;
  }
  std::string bytes;
  std::size_t room = 1'000'000;
};

uint32_t crc(std::string_view bytes) {
  return static_cast<uint32_t>(::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

const McapContent kContent{"a program",
                           {{"Pose", "jsonschema", R"({"type":"object"})"}},
                           {{"/pose", "json", 1}, {"/raw", "", 0}},
                           {{"run", {{"robot", "finger"}, {"rate", "600"}}}}};

McapChunk chunk_of(const std::vector<McapMessage>& messages) {
  McapChunk chunk;
  for (const McapMessage& message : messages) chunk.add(message);
  return chunk;
}

struct Log {
  Log() {
    REQUIRE(writer.begin());
    REQUIRE(writer.write(chunk_of({{0, 0, 300, 290, "{}"}, {1, 0, 100, 100, "abc"}, {0, 1, 200, 200, ""}})));
    REQUIRE(writer.write(chunk_of({{0, 2, 400, 400, "{}"}})));
    REQUIRE(writer.end());
    records = records_of(std::string_view(memory.bytes).substr(8, memory.bytes.size() - 16));
    for (Record& record : records) record.offset += 8;
  }
  const Record& first(uint8_t opcode) const {
    for (const Record& record : records)
      if (record.opcode == opcode) return record;
    throw std::out_of_range("no such record");
  }
  Memory memory;
  McapWriter writer{memory, kContent};
  std::vector<Record> records;
};

TEST_CASE("The checksum is that of CRC-32 as MCAP has it", "[unit]") {
  CHECK(crc("123456789") == 0xCBF43926);
  CHECK(crc("") == 0);
}

TEST_CASE("A file begins and ends with the magic bytes, and its records come in their order", "[unit]") {
  const Log log;
  CHECK(log.memory.bytes.starts_with(kMcapMagic));
  CHECK(log.memory.bytes.ends_with(kMcapMagic));
  CHECK(log.writer.size() == log.memory.bytes.size());
  std::vector<int> opcodes;
  for (const Record& record : log.records) opcodes.push_back(record.opcode);
  CHECK(opcodes == std::vector<int>{0x01, 0x0C, 0x03, 0x04, 0x04,              // head
                                    0x06, 0x07, 0x07, 0x06, 0x07, 0x0F,        // data
                                    0x03, 0x04, 0x04, 0x0B, 0x08, 0x08, 0x0D,  // summary
                                    0x0E, 0x0E, 0x0E, 0x0E, 0x0E, 0x02});      // its offsets, the footer
}

TEST_CASE("Header, schema, channel and metadata have their fields", "[unit]") {
  const Log log;
  Cursor header{log.first(0x01).body};
  CHECK(header.text().empty());
  CHECK(header.text() == "a program");
  Cursor schema{log.first(0x03).body};
  CHECK(schema.number(2) == 1);
  CHECK(schema.text() == "Pose");
  CHECK(schema.text() == "jsonschema");
  CHECK(schema.text() == R"({"type":"object"})");
  Cursor channel{log.first(0x04).body};
  CHECK(channel.number(2) == 0);
  CHECK(channel.number(2) == 1);
  CHECK(channel.text() == "/pose");
  CHECK(channel.text() == "json");
  CHECK(channel.number(4) == 0);
  CHECK(channel.at == channel.bytes.size());
  Cursor metadata{log.first(0x0C).body};
  CHECK(metadata.text() == "run");
  const uint64_t table = metadata.number(4);
  CHECK(table == metadata.bytes.size() - metadata.at);
  CHECK(metadata.text() == "rate");
}

TEST_CASE("A chunk tells its times, size and checksum, and holds its messages", "[unit]") {
  const Log log;
  Cursor chunk{log.first(0x06).body};
  CHECK(chunk.number(8) == 100);  // least and greatest time, in whatever order they come
  CHECK(chunk.number(8) == 300);
  const uint64_t size = chunk.number(8);
  const uint64_t checksum = chunk.number(4);
  CHECK(chunk.text() == "zstd");
  const uint64_t compressed_size = chunk.number(8);
  CHECK(compressed_size == chunk.bytes.size() - chunk.at);
  const std::string inside = decompressed(chunk.bytes.substr(chunk.at), size);
  CHECK(crc(inside) == checksum);
  const std::vector<Record> messages = records_of(inside);
  REQUIRE(messages.size() == 3);
  Cursor message{messages[0].body};
  CHECK(messages[0].opcode == 0x05);
  CHECK(message.number(2) == 0);
  CHECK(message.number(4) == 0);
  CHECK(message.number(8) == 300);
  CHECK(message.number(8) == 290);
  CHECK(message.bytes.substr(message.at) == "{}");

  Cursor index{log.first(0x07).body};  // of channel 0
  CHECK(index.number(2) == 0);
  CHECK(index.number(4) == 32);
  CHECK(index.number(8) == 300);
  CHECK(index.number(8) == messages[0].offset);
  CHECK(index.number(8) == 200);
  CHECK(index.number(8) == messages[2].offset);
}

TEST_CASE("The summary leads to every chunk and counts the messages", "[unit]") {
  const Log log;
  Cursor statistics{log.first(0x0B).body};
  CHECK(statistics.number(8) == 4);  // messages
  CHECK(statistics.number(2) == 1);  // schemas
  CHECK(statistics.number(4) == 2);  // channels
  CHECK(statistics.number(4) == 0);  // attachments
  CHECK(statistics.number(4) == 1);  // metadata
  CHECK(statistics.number(4) == 2);  // chunks
  CHECK(statistics.number(8) == 100);
  CHECK(statistics.number(8) == 400);
  CHECK(statistics.number(4) == 20);
  CHECK(statistics.number(2) == 0);
  CHECK(statistics.number(8) == 3);

  std::vector<Record> chunks, indexes;
  for (const Record& record : log.records) {
    if (record.opcode == 0x06) chunks.push_back(record);
    if (record.opcode == 0x08) indexes.push_back(record);
  }
  REQUIRE(indexes.size() == chunks.size());
  for (std::size_t k = 0; k < chunks.size(); ++k) {
    Cursor index{indexes[k].body, 16};
    CHECK(index.number(8) == chunks[k].offset);
    CHECK(index.number(8) == chunks[k].body.size() + 9);
    const uint64_t table_end = index.number(4) + index.at;
    while (index.at < table_end) {
      const uint64_t channel = index.number(2);
      const uint64_t offset = index.number(8);
      CHECK(log.memory.bytes.at(offset) == 0x07);
      CHECK(Cursor{log.memory.bytes, offset + 9}.number(2) == channel);
    }
  }
}

TEST_CASE("The checksums of data and summary cover what MCAP says", "[unit]") {
  const Log log;
  const std::string_view bytes = log.memory.bytes;
  const Record& data_end = log.first(0x0F);
  CHECK(Cursor{data_end.body}.number(4) == crc(bytes.substr(0, data_end.offset)));
  const Record& last = log.first(0x02);
  Cursor footer{last.body};
  const uint64_t summary = footer.number(8);
  const uint64_t offsets = footer.number(8);
  CHECK(bytes.at(summary) == 0x03);
  CHECK(bytes.at(offsets) == 0x0E);
  CHECK(footer.number(4) == crc(bytes.substr(summary, last.offset + 9 + 16 - summary)));
}

TEST_CASE("A chunk that could not be written leaves a whole file without it", "[unit]") {
  Memory memory;
  McapWriter writer(memory, kContent);
  REQUIRE(writer.begin());
  REQUIRE(writer.write(chunk_of({{0, 0, 100, 100, "{}"}})));
  const std::size_t before = memory.bytes.size();
  memory.room = before;
  CHECK_FALSE(writer.write(chunk_of({{0, 1, 200, 200, "lost"}})));
  CHECK(memory.bytes.size() == before);
  memory.room = 1'000'000;
  REQUIRE(writer.write(chunk_of({{0, 2, 300, 300, "{}"}})));
  REQUIRE(writer.end());
  const std::vector<Record> records =
      records_of(std::string_view(memory.bytes).substr(8, memory.bytes.size() - 16));
  for (const Record& record : records)
    if (record.opcode == 0x0B) CHECK(Cursor{record.body}.number(8) == 2);
  CHECK(text_of_messages(memory.bytes).find("lost") == std::string::npos);
}

}  // namespace tendril::app::mcap_writer_test
