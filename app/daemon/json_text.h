// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <concepts>
#include <iterator>
#include <string>
#include <string_view>

namespace tendril::app {

/// Builds a JSON object piece by piece in one buffer, several times as fast as from a tree of values: it is
/// written in every control cycle. Names are given in quotes, as JSON has them. Real-time: no (allocates).
class JsonText {
 public:
  void clear() { text_.clear(); }
  const std::string& text() const { return text_; }

  void open() { text_ += '{'; }
  void open(std::string_view name) {
    key(name);
    text_ += '{';
  }
  void close() { text_ += '}'; }

  /// Nine digits: more than any sensor has. What is no finite number becomes null.
  void put(std::string_view name, std::floating_point auto value) {
    key(name);
    if (std::isfinite(value))
      fmt::format_to(std::back_inserter(text_), "{:.9g}", value);
    else
      text_ += "null";
  }
  void put(std::string_view name, std::integral auto value) {
    key(name);
    fmt::format_to(std::back_inserter(text_), "{}", value);
  }
  /// @param value  as JSON has it: a text in quotes, a list, null
  void put_raw(std::string_view name, std::string_view value) {
    key(name);
    text_ += value;
  }

 private:
  void key(std::string_view name) {
    if (text_.back() != '{') text_ += ',';
    text_ += name;
    text_ += ':';
  }

  std::string text_;
};

}  // namespace tendril::app
