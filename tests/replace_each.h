// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace tendril::testing {

/// Puts `instead` where a text has pieces that begin and end like that. For robot files that are to be
/// otherwise; std::regex does not compile without warnings under the sanitizers of g++ 12.
inline void replace_each(std::string& text, const std::string& begin, const std::string& end,
                         const std::string& instead) {
  for (std::size_t at = 0; (at = text.find(begin, at)) != std::string::npos; at += instead.size())
    text.replace(at, text.find(end, at + begin.size()) + end.size() - at, instead);
}

}  // namespace tendril::testing
