// SPDX-License-Identifier: Apache-2.0
#include "app/mcap/mcap_writer.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>

namespace tendril::app {
namespace {

constexpr std::string_view kCompression = "zstd";
constexpr int kLevel = 1;  // the fastest; higher ones gain nothing on texts of numbers

uint32_t crc_of(std::string_view bytes, uint32_t before = 0) {
  const auto* data = reinterpret_cast<const Bytef*>(bytes.data());
  return static_cast<uint32_t>(::crc32_z(before, data, bytes.size()));
}

}  // namespace

McapWriter::McapWriter(ByteSink& sink, const McapContent& content) : sink_(sink), content_(content) {}

bool McapWriter::append(std::string_view bytes) {
  if (!sink_.append(bytes)) return false;
  size_ += bytes.size();
  crc_ = crc_of(bytes, crc_);
  return true;
}

bool McapWriter::begin() {
  out_.clear();
  metadata_.clear();
  out_.put_raw(kMcapMagic);
  const std::size_t header = out_.begin(McapOpcode::kHeader);
  out_.put("");  // no profile: topics and schemas are of our own
  out_.put(content_.library);
  out_.end(header);
  for (const McapMetadata& metadata : content_.metadata) {
    const std::size_t offset = out_.size();
    const std::size_t record = out_.begin(McapOpcode::kMetadata);
    out_.put(metadata.name);
    McapRecords table;
    for (const auto& [key, value] : metadata.values) {
      table.put(key);
      table.put(value);
    }
    out_.put(table.bytes());
    out_.end(record);
    metadata_.push_back({offset, out_.size() - offset});
  }
  put_schemas();
  put_channels();
  return append(out_.bytes());
}

bool McapWriter::write(const McapChunk& chunk) {
  out_.clear();
  ChunkIndex index{};
  put_chunk(chunk, index);
  put_message_indexes(chunk, index);
  if (index.compressed_size == 0 || !append(out_.bytes())) return false;
  for (const McapChunk::Entry& entry : chunk.entries()) ++counts_[entry.channel];
  chunks_.push_back(std::move(index));
  return true;
}

/// @return  valid until the next call; empty where there is no memory for it
std::string_view McapWriter::compressed(std::string_view records) {
  compressed_.resize(::ZSTD_compressBound(records.size()));
  const std::size_t size =
      ::ZSTD_compress(compressed_.data(), compressed_.size(), records.data(), records.size(), kLevel);
  return ::ZSTD_isError(size) ? std::string_view() : std::string_view(compressed_).substr(0, size);
}

void McapWriter::put_chunk(const McapChunk& chunk, ChunkIndex& index) {
  const auto [first, last] = std::ranges::minmax(
      chunk.entries(), {}, [](const McapChunk::Entry& entry) { return entry.log_time_ns; });
  index.first_ns = static_cast<uint64_t>(first.log_time_ns);
  index.last_ns = static_cast<uint64_t>(last.log_time_ns);
  index.offset = size_;
  index.records_size = chunk.size();
  const std::size_t record = out_.begin(McapOpcode::kChunk);
  out_.put64(index.first_ns);
  out_.put64(index.last_ns);
  out_.put64(chunk.size());
  out_.put32(crc_of(chunk.records()));
  const std::string_view records = compressed(chunk.records());
  index.compressed_size = records.size();
  out_.put(kCompression);
  out_.put64(records.size());
  out_.put_raw(records);
  out_.end(record);
  index.size = out_.size();
}

void McapWriter::put_message_indexes(const McapChunk& chunk, ChunkIndex& index) {
  std::map<uint16_t, McapRecords> of_channel;
  for (const McapChunk::Entry& entry : chunk.entries()) {
    of_channel[entry.channel].put64(static_cast<uint64_t>(entry.log_time_ns));
    of_channel[entry.channel].put64(entry.offset);
  }
  for (const auto& [channel, entries] : of_channel) {
    index.indexes[channel] = size_ + out_.size();
    const std::size_t record = out_.begin(McapOpcode::kMessageIndex);
    out_.put16(channel);
    out_.put(entries.bytes());
    out_.end(record);
  }
  index.index_size = out_.size() - index.size;
}

bool McapWriter::end() {
  out_.clear();
  const std::size_t data_end = out_.begin(McapOpcode::kDataEnd);
  out_.put32(crc_);
  out_.end(data_end);
  if (!append(out_.bytes())) return false;

  out_.clear();
  put_summary();
  const uint64_t offsets_start = size_ + out_.size();
  put_summary_offsets();
  const std::size_t footer = out_.begin(McapOpcode::kFooter);
  out_.put64(size_);
  out_.put64(offsets_start);
  const std::size_t covered =
      out_.size();  // by the checksum: the footer too, up to here, its length included
  out_.put32(0);
  out_.end(footer);
  McapRecords summary;
  summary.put_raw(std::string_view(out_.bytes()).substr(0, covered));
  summary.put32(crc_of(summary.bytes()));
  summary.put_raw(kMcapMagic);
  return append(summary.bytes());
}

void McapWriter::put_summary() {
  groups_.clear();
  const auto group = [this](McapOpcode opcode, const auto& put_records) {
    const std::size_t start = out_.size();
    put_records();
    if (out_.size() > start) groups_.push_back({opcode, size_ + start, out_.size() - start});
  };
  group(McapOpcode::kSchema, [this] { put_schemas(); });
  group(McapOpcode::kChannel, [this] { put_channels(); });
  group(McapOpcode::kStatistics, [this] { put_statistics(); });
  group(McapOpcode::kChunkIndex, [this] {
    for (const ChunkIndex& chunk : chunks_) put_chunk_index(chunk);
  });
  group(McapOpcode::kMetadataIndex, [this] {
    for (std::size_t k = 0; k < metadata_.size(); ++k) {
      const std::size_t record = out_.begin(McapOpcode::kMetadataIndex);
      out_.put64(metadata_[k].offset);
      out_.put64(metadata_[k].size);
      out_.put(content_.metadata[k].name);
      out_.end(record);
    }
  });
}

void McapWriter::put_summary_offsets() {
  for (const Group& group : groups_) {
    const std::size_t record = out_.begin(McapOpcode::kSummaryOffset);
    out_.put8(static_cast<uint8_t>(group.opcode));
    out_.put64(group.offset);
    out_.put64(group.size);
    out_.end(record);
  }
}

void McapWriter::put_schemas() {
  for (std::size_t k = 0; k < content_.schemas.size(); ++k)
    out_.put_schema(static_cast<uint16_t>(k + 1), content_.schemas[k]);  // 0 would mean: none
}

void McapWriter::put_channels() {
  for (std::size_t k = 0; k < content_.channels.size(); ++k)
    out_.put_channel(static_cast<uint16_t>(k), content_.channels[k]);
}

void McapWriter::put_statistics() {
  uint64_t messages = 0, first_ns = 0, last_ns = 0;
  for (const auto& [channel, count] : counts_) messages += count;
  if (!chunks_.empty()) {
    first_ns = std::ranges::min(chunks_, {}, &ChunkIndex::first_ns).first_ns;
    last_ns = std::ranges::max(chunks_, {}, &ChunkIndex::last_ns).last_ns;
  }
  const std::size_t record = out_.begin(McapOpcode::kStatistics);
  out_.put64(messages);
  out_.put16(static_cast<uint16_t>(content_.schemas.size()));
  out_.put32(static_cast<uint32_t>(content_.channels.size()));
  out_.put32(0);  // attachments
  out_.put32(static_cast<uint32_t>(metadata_.size()));
  out_.put32(static_cast<uint32_t>(chunks_.size()));
  out_.put64(first_ns);
  out_.put64(last_ns);
  McapRecords table;
  for (const auto& [channel, count] : counts_) {
    table.put16(channel);
    table.put64(count);
  }
  out_.put(table.bytes());
  out_.end(record);
}

void McapWriter::put_chunk_index(const ChunkIndex& chunk) {
  const std::size_t record = out_.begin(McapOpcode::kChunkIndex);
  out_.put64(chunk.first_ns);
  out_.put64(chunk.last_ns);
  out_.put64(chunk.offset);
  out_.put64(chunk.size);
  McapRecords table;
  for (const auto& [channel, offset] : chunk.indexes) {
    table.put16(channel);
    table.put64(offset);
  }
  out_.put(table.bytes());
  out_.put64(chunk.index_size);
  out_.put(kCompression);
  out_.put64(chunk.compressed_size);
  out_.put64(chunk.records_size);
  out_.end(record);
}

}  // namespace tendril::app
