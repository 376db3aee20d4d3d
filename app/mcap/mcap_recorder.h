// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "app/mcap/log_target.h"
#include "app/mcap/mcap_records.h"

namespace tendril::app {

/// A log that is written by a thread of its own. Whoever records never waits for the disk: what it cannot
/// take in time is dropped and counted. Each chunk is on the disk within about half a second.
class McapRecorder {
 public:
  struct Limits {
    uint64_t file_bytes = 0;                  ///< of one file, then follows the next
    std::size_t queue_bytes = 16'000'000;     ///< that wait for the disk; at most half a file
    std::size_t chunk_bytes = 1'000'000;      ///< so much is written at once, or what has come in
    std::chrono::milliseconds interval{500};  ///< so much time
  };

  struct Counts {
    uint64_t written = 0;  ///< messages
    uint64_t dropped = 0;  ///< messages: the queue was full, or the disk
    uint64_t bytes = 0;    ///< of all files of this run
    std::string error;     ///< of the disk, since when nothing is written; empty: all is well
  };

  /// Starts the thread.
  McapRecorder(std::unique_ptr<LogTarget> target, McapContent content, const Limits& limits);
  /// Closes the log.
  ~McapRecorder();
  McapRecorder(const McapRecorder&) = delete;
  McapRecorder& operator=(const McapRecorder&) = delete;

  /// Records a message. Any thread.
  /// @param channel          its number
  /// @param log_time_ns      since 1970
  /// @param publish_time_ns  likewise
  /// @return  false where it was dropped
  /// Real-time: no (a lock that the thread holds only to swap two buffers; allocates).
  bool record(uint16_t channel, int64_t log_time_ns, int64_t publish_time_ns, std::string_view data);

  /// Real-time: no (takes the lock).
  Counts counts() const;

  /// Writes what has been recorded, and the end of the file. A disk that has not taken it after `patience` is
  /// left alone: the file then lacks its end.
  /// @return  whether the file is complete
  bool close(std::chrono::milliseconds patience = std::chrono::seconds(5));

  pthread_t thread() { return thread_.native_handle(); }

 private:
  struct Shared;
  static void run(Shared& shared);

  std::shared_ptr<Shared> shared_;  // with the thread, which may outlive us at a disk that hangs
  std::thread thread_;
};

}  // namespace tendril::app
