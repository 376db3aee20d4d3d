// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace tendril::app {

/// A text from outside, such as a path, whose bytes may be anything, as UTF-8: what is none becomes U+FFFD.
/// Real-time: no (allocates).
std::string valid_utf8(std::string_view text);

/// JSON as text, for any texts in it: bytes that are no UTF-8 become U+FFFD, on which `dump` alone would
/// throw.
/// @param indent  of each level; -1: all in one line
/// Real-time: no (allocates).
std::string to_text(const nlohmann::json& value, int indent = -1);
std::string to_text(const nlohmann::ordered_json& value, int indent = -1);

}  // namespace tendril::app
