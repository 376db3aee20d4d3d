// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/text_cursor.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <type_traits>

#include "fem/mesh/mesh.h"

namespace tendril::fem {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";
constexpr size_t kShown = 24;  // characters of what was found

}  // namespace

template <typename T>
bool parse_number(std::string_view word, T& value) {
  std::string copy(word);
  if (copy.starts_with('+') && !copy.starts_with("+-")) copy.erase(0, 1);
  if constexpr (std::is_floating_point_v<T>)
    if (const size_t exponent = copy.find_first_of("dD"); exponent != copy.npos) copy[exponent] = 'e';
  const char* end = copy.data() + copy.size();
  const auto [stop, error] = std::from_chars(copy.data(), end, value);
  if (stop != end) return false;
  if constexpr (std::is_floating_point_v<T>)
    if (error == std::errc::result_out_of_range) {
      value = std::strtod(copy.c_str(), nullptr);
      return std::abs(value) < 1;  // too small for a double, not too large
    }
  return error == std::errc{};
}

template bool parse_number(std::string_view, int&);
template bool parse_number(std::string_view, long&);
template bool parse_number(std::string_view, size_t&);
template bool parse_number(std::string_view, double&);

TextCursor TextCursor::part(size_t begin, size_t end) const {
  TextCursor result = *this;
  result.position_ = result.last_ = begin;
  result.end_ = end;
  return result;
}

void TextCursor::skip_blanks() {
  position_ = std::min(text_.find_first_not_of(kBlanks, position_), end_);
  last_ = position_;
}

bool TextCursor::at_end() {
  skip_blanks();
  return position_ == end_;
}

std::string_view TextCursor::word() {
  skip_blanks();
  position_ = std::min(text_.find_first_of(kBlanks, position_), end_);
  return text_.substr(last_, position_ - last_);
}

void TextCursor::skip_words(size_t count, const char* what) {
  for (; count > 0; --count)
    if (word().empty()) fail(what);
}

std::string_view TextCursor::line() {
  last_ = position_;
  const size_t end = std::min(text_.find('\n', position_), end_);
  position_ = std::min(end + 1, end_);
  std::string_view line = text_.substr(last_, end - last_);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::string_view TextCursor::bytes(size_t count, std::string_view what) {
  last_ = position_;
  if (count > end_ - position_)
    fail_with(fmt::format("found {} bytes, expected {} bytes of {}", end_ - position_, count, what));
  position_ += count;
  return text_.substr(last_, count);
}

size_t TextCursor::count(const char* what) {
  const auto value = number<size_t>(what);
  if (value > end_ - position_)
    fail_with(fmt::format("found {} for {}, but only {} bytes are left", value, what, end_ - position_));
  return value;
}

void TextCursor::fail(std::string_view expected) const {
  if (last_ >= end_) fail_with(fmt::format("found the end of what is there, expected {}", expected));
  std::string found;
  for (const char c : text_.substr(last_, std::clamp<size_t>(position_ - last_, 1, kShown)))
    found += c >= ' ' && c <= '~' ? c : '?';
  fail_with(fmt::format("found '{}', expected {}", found, expected));
}

void TextCursor::fail_with(const std::string& sentence) const {
  throw MeshError(fmt::format("{}: {}", location(), sentence));
}

std::string TextCursor::location() const {
  if (!by_line_) return fmt::format("{}: byte {}", file_, last_);
  const auto before = text_.substr(0, last_);
  return fmt::format("{}:{}", file_, 1 + std::count(before.begin(), before.end(), '\n'));
}

}  // namespace tendril::fem
