// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "app/mcap/mcap_records.h"

namespace tendril::app {

/// A message on its way into a log.
struct McapMessage {
  uint16_t channel = 0;         ///< its number
  uint32_t sequence = 0;        ///< counts the messages of the channel; a gap tells of lost ones
  int64_t log_time_ns = 0;      ///< when it was recorded; since 1970, so that viewers show a date
  int64_t publish_time_ns = 0;  ///< of what it tells
  std::string_view data;
};

/// Messages that are written in one piece, with what an index of them needs. Real-time: no (allocates).
class McapChunk {
 public:
  /// Where a message stands.
  struct Entry {
    uint16_t channel;
    int64_t log_time_ns;
    uint64_t offset;  ///< of its record, from the first
  };

  void add(const McapMessage& message);
  void clear();

  bool empty() const { return entries_.empty(); }
  std::size_t size() const { return records_.size(); }  ///< bytes
  const std::string& records() const { return records_.bytes(); }
  const std::vector<Entry>& entries() const { return entries_; }  ///< in the order of add()

 private:
  McapRecords records_;
  std::vector<Entry> entries_;
};

}  // namespace tendril::app
