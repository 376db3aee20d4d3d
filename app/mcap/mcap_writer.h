// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "app/mcap/mcap_chunk.h"
#include "app/mcap/mcap_records.h"

namespace tendril::app {

/// Where the bytes of a log go.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// Appends all of the bytes or none.
  /// @return  whether they are written
  /// Real-time: no (may block).
  virtual bool append(std::string_view bytes) = 0;
};

/// One MCAP file, https://mcap.dev/spec: header, metadata, schemas and channels, then chunks, each with the
/// index of its messages, then the summary by which a reader finds everything. Chunks are compressed with
/// Zstandard. A file without its end is read chunk by chunk. Real-time: no, for all of it (allocates, may
/// block).
class McapWriter {
 public:
  /// Keeps references.
  McapWriter(ByteSink& sink, const McapContent& content);

  /// Writes what comes before the messages. @return  false where it could not be written: begin anew
  bool begin();
  /// Writes messages, at least one.
  /// @return  false where they could not be written; the file is then as it was before
  bool write(const McapChunk& chunk);
  /// Writes the summary. @return  false where it could not be written
  bool end();

  uint64_t size() const { return size_; }  ///< bytes written

 private:
  struct ChunkIndex {
    uint64_t first_ns, last_ns, offset, size, records_size, compressed_size, index_size;
    std::map<uint16_t, uint64_t> indexes;  // offset of the message index of each channel
  };
  struct MetadataIndex {
    uint64_t offset, size;
  };
  /// The records of one kind in the summary.
  struct Group {
    McapOpcode opcode;
    uint64_t offset, size;
  };

  bool append(std::string_view bytes);
  std::string_view compressed(std::string_view records);
  void put_chunk(const McapChunk& chunk, ChunkIndex& index);
  void put_message_indexes(const McapChunk& chunk, ChunkIndex& index);
  void put_summary();
  void put_summary_offsets();
  void put_schemas();
  void put_channels();
  void put_statistics();
  void put_chunk_index(const ChunkIndex& chunk);

  ByteSink& sink_;
  const McapContent& content_;
  McapRecords out_;
  std::string compressed_;
  uint64_t size_ = 0;
  uint32_t crc_ = 0;  // of all bytes so far
  std::vector<MetadataIndex> metadata_;
  std::vector<ChunkIndex> chunks_;
  std::vector<Group> groups_;
  std::map<uint16_t, uint64_t> counts_;  // messages of each channel
};

}  // namespace tendril::app
