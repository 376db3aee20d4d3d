// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>

namespace tendril::hal {

/// Text from a format of std::snprintf, cut to 255 characters. Real-time: no (allocates).
std::string formatted(const char* format, auto... values) {
  char text[256];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

}  // namespace tendril::hal
