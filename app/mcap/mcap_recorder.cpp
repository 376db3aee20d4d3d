// SPDX-License-Identifier: Apache-2.0
#include "app/mcap/mcap_recorder.h"

#include <pthread.h>

#include <condition_variable>
#include <mutex>
#include <optional>
#include <utility>

#include "app/mcap/mcap_chunk.h"

namespace tendril::app {
namespace {

/// Writes chunks into one file after the other.
class ChunkedFiles {
 public:
  ChunkedFiles(LogTarget& target, const McapContent& content, uint64_t file_bytes)
      : target_(target), content_(content), room_(file_bytes / 10 * 9) {}  // what is left holds the index

  bool write(const McapChunk& chunk) {
    if (writer_ && writer_->size() + chunk.size() > room_) end();
    return (writer_ || begin()) && writer_->write(chunk);
  }
  bool end() {
    const bool complete = !writer_ || writer_->end();
    if (writer_) bytes_before_ += writer_->size();
    writer_.reset();
    target_is_new_ = false;
    return complete;
  }
  uint64_t bytes() const { return bytes_before_ + (writer_ ? writer_->size() : 0); }

 private:
  bool begin() {
    if (!std::exchange(target_is_new_, false) && !target_.next()) return false;
    writer_.emplace(target_, content_);
    if (writer_->begin()) return true;
    writer_.reset();
    return false;
  }

  LogTarget& target_;
  const McapContent& content_;
  uint64_t room_, bytes_before_ = 0;
  bool target_is_new_ = true;
  std::optional<McapWriter> writer_;
};

}  // namespace

struct McapRecorder::Shared {
  std::unique_ptr<LogTarget> target;
  McapContent content;
  Limits limits;
  std::mutex mutex;
  std::condition_variable changed;
  // Under the mutex:
  McapChunk pending;
  std::vector<uint32_t> sequences;
  Counts counts;
  bool closing = false, done = false, complete = false;
};

McapRecorder::McapRecorder(std::unique_ptr<LogTarget> target, McapContent content, const Limits& limits)
    : shared_(std::make_shared<Shared>()) {
  shared_->target = std::move(target);
  shared_->sequences.resize(content.channels.size());
  shared_->content = std::move(content);
  shared_->limits = limits;
  thread_ = std::thread([shared = shared_] { run(*shared); });
  pthread_setname_np(thread_.native_handle(), "log");
}

McapRecorder::~McapRecorder() { close(); }

bool McapRecorder::record(uint16_t channel, int64_t log_time_ns, int64_t publish_time_ns,
                          std::string_view data) {
  const std::lock_guard lock(shared_->mutex);
  const uint32_t sequence = shared_->sequences[channel]++;
  if (shared_->closing || shared_->pending.size() + data.size() > shared_->limits.queue_bytes) {
    ++shared_->counts.dropped;
    return false;
  }
  const bool was_small = shared_->pending.size() < shared_->limits.chunk_bytes;
  shared_->pending.add({channel, sequence, log_time_ns, publish_time_ns, data});
  if (was_small && shared_->pending.size() >= shared_->limits.chunk_bytes) shared_->changed.notify_all();
  return true;
}

McapRecorder::Counts McapRecorder::counts() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->counts;
}

bool McapRecorder::close(std::chrono::milliseconds patience) {
  if (thread_.joinable()) {
    std::unique_lock lock(shared_->mutex);
    shared_->closing = true;
    shared_->changed.notify_all();
    const bool done = shared_->changed.wait_for(lock, patience, [this] { return shared_->done; });
    lock.unlock();
    if (done)
      thread_.join();
    else
      thread_.detach();
  }
  const std::lock_guard lock(shared_->mutex);
  return shared_->complete;
}

void McapRecorder::run(Shared& shared) {
  ChunkedFiles files(*shared.target, shared.content, shared.limits.file_bytes);
  McapChunk chunk;
  std::unique_lock lock(shared.mutex);
  for (bool last = false; !last;) {
    shared.changed.wait_for(lock, shared.limits.interval, [&shared] {
      return shared.closing || shared.pending.size() >= shared.limits.chunk_bytes;
    });
    last = shared.closing;
    std::swap(chunk, shared.pending);
    if (chunk.empty()) continue;
    lock.unlock();
    const bool written = files.write(chunk);
    lock.lock();
    (written ? shared.counts.written : shared.counts.dropped) += chunk.entries().size();
    shared.counts.error = written ? "" : shared.target->error();
    shared.counts.bytes = files.bytes();
    chunk.clear();
  }
  lock.unlock();
  const bool complete = files.end();
  lock.lock();
  shared.complete = complete && shared.counts.dropped == 0;
  shared.counts.bytes = files.bytes();
  shared.done = true;
  shared.changed.notify_all();
}

}  // namespace tendril::app
