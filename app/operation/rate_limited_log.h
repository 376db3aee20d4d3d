// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>

namespace tendril::app {

/// Keeps a client that changes something again and again from filling the log: a line a second at most, the
/// latest, with the count of those that it stands for. Real-time: no (allocates).
class RateLimitedLog {
 public:
  /// A line that takes the place of one that has not been told yet.
  void say(std::string line) {
    waiting_ = std::move(line);
    ++lines_;
  }

  /// @return  what is to be told now; empty: nothing
  std::string due(int64_t now_ns) {
    if (lines_ == 0 || now_ns < due_ns_) return {};
    due_ns_ = now_ns + kInterval_ns;
    return take();
  }

  /// @return  what has not been told yet, at the end; empty: nothing
  std::string take() {
    std::string line = std::exchange(waiting_, {});
    if (lines_ > 1) line += " (the last of " + std::to_string(lines_) + " changes)";
    lines_ = 0;
    return line;
  }

 private:
  static constexpr int64_t kInterval_ns = 1'000'000'000;

  std::string waiting_;
  int lines_ = 0;  // said since the last one that was told
  int64_t due_ns_ = 0;
};

}  // namespace tendril::app
