// SPDX-License-Identifier: Apache-2.0
#include "app/mcap/mcap_chunk.h"

namespace tendril::app {

void McapChunk::add(const McapMessage& message) {
  entries_.push_back({message.channel, message.log_time_ns, records_.size()});
  const std::size_t record = records_.begin(McapOpcode::kMessage);
  records_.put16(message.channel);
  records_.put32(message.sequence);
  records_.put64(static_cast<uint64_t>(message.log_time_ns));
  records_.put64(static_cast<uint64_t>(message.publish_time_ns));
  records_.put_raw(message.data);
  records_.end(record);
}

void McapChunk::clear() {
  records_.clear();
  entries_.clear();
}

}  // namespace tendril::app
