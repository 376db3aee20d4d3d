// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/frame.h"

#include <charconv>
#include <cstdio>

namespace tendril::hal {
namespace {

/// All of `text` as one hexadecimal number.
std::optional<uint32_t> parse_hex(std::string_view text) noexcept {
  uint32_t value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value, 16);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

}  // namespace

std::string to_text(const Frame& frame) {
  char text[16 + 2 * kMaxFrameBytes];
  int at = std::snprintf(text, sizeof text, frame.extended ? "%08X#" : "%03X#", frame.id);
  if (frame.remote) return std::string(text, at) + "R";
  if (frame.length > 8) at += std::snprintf(text + at, sizeof text - at, "#0");
  for (int i = 0; i < std::min<int>(frame.length, kMaxFrameBytes); ++i)
    at += std::snprintf(text + at, sizeof text - at, "%02X", frame.data[i]);
  return text;
}

std::optional<Frame> parse_frame(std::string_view text) noexcept {
  const size_t hash = text.find('#');
  if (hash != 3 && hash != 8) return std::nullopt;
  const std::string_view after = text.substr(hash + 1);
  const bool remote = after == "R";
  const std::string_view bytes = remote ? "" : after;
  const auto id = parse_hex(text.substr(0, hash));
  const bool extended = hash == 8;
  if (!id || *id > (extended ? 0x1FFFFFFFu : 0x7FFu) || bytes.size() % 2 != 0 || bytes.size() > 16)
    return std::nullopt;
  Frame frame{
      .id = *id, .extended = extended, .remote = remote, .length = static_cast<uint8_t>(bytes.size() / 2)};
  for (int i = 0; i < frame.length; ++i) {
    const auto byte = parse_hex(bytes.substr(2 * i, 2));
    if (!byte) return std::nullopt;
    frame.data[i] = static_cast<uint8_t>(*byte);
  }
  return frame;
}

}  // namespace tendril::hal
