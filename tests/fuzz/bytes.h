// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

namespace tendril::fuzz {

/// Takes a sequence of steps off an input. Where that has ended, all is 0.
class Bytes {
 public:
  explicit Bytes(std::string_view left) : left_(left) {}

  bool empty() const { return left_.empty(); }

  uint8_t byte() {
    const std::string_view first = take(1);
    return first.empty() ? uint8_t{0} : static_cast<uint8_t>(first[0]);
  }

  /// Two bytes, the lower one first.
  uint16_t word() {
    const uint8_t low = byte();
    return static_cast<uint16_t>(low | byte() << 8);
  }

  /// @param most  fewer come where the input ends
  std::string_view take(size_t most) {
    const std::string_view taken = left_.substr(0, most);
    left_.remove_prefix(taken.size());
    return taken;
  }

 private:
  std::string_view left_;
};

}  // namespace tendril::fuzz
