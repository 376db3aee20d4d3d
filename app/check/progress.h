// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

namespace tendril::app {

/// How much of a long wait is over, on stderr where that is a terminal; the line goes with the object.
/// Real-time: no.
class Progress {
 public:
  /// @param what  is done meanwhile
  explicit Progress(std::string what);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Nothing in the first two seconds.
  /// @param share  0 to 1
  void show(double share);

 private:
  std::string what_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  bool shown_ = false;
};

}  // namespace tendril::app
