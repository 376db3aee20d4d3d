// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace tendril::fem {

/// Reads a word as a number the way mesh programs write one: also with a '+' in front, with Fortran's
/// exponent D, and smaller than a double can be, which gives the nearest double.
/// @param value  int, long, size_t or double; undefined where the word is no such number
/// @return       whether the whole word is such a number
template <typename T>
bool parse_number(std::string_view word, T& value);

/// A place in the text of a mesh file, from which words and numbers are read in order. What does not read as
/// expected throws MeshError with the file, the line (in binary files: the byte), what is found and what is
/// expected. Refers to the text, which outlives it.
class TextCursor {
 public:
  TextCursor(std::string_view text, std::string file)
      : text_(text), end_(text.size()), file_(std::move(file)) {}

  /// A cursor on the part [begin, end) of the same text.
  TextCursor part(size_t begin, size_t end) const;
  /// Errors name the byte from here on, since the file has no lines.
  void count_bytes() { by_line_ = false; }

  std::string_view text() const { return text_; }
  const std::string& file() const { return file_; }
  size_t position() const { return position_; }

  /// Whether nothing but blanks and line ends is left; goes on past these.
  bool at_end();
  /// Whether nothing at all is left.
  bool at_text_end() const { return position_ == end_; }
  /// The next word, between blanks or line ends; empty at the end.
  std::string_view word();
  /// Goes on past `count` words.
  void skip_words(size_t count, const char* what);
  /// The rest of this line, without its end.
  std::string_view line();
  /// The next `count` bytes, whatever they hold.
  std::string_view bytes(size_t count, std::string_view what);

  /// The next word as a number.
  template <typename T>
  T number(const char* what) {
    T value{};
    if (!parse_number(word(), value)) fail(what);
    return value;
  }
  /// The next word as a number of things to come: what is left of the text must have a byte for each, so
  /// that a wrong count asks for no absurd amount of memory.
  size_t count(const char* what);

  /// Throws: the last word read is not what is expected.
  [[noreturn]] void fail(std::string_view expected) const;
  /// Throws with a sentence of one's own on the place of the last word read.
  [[noreturn]] void fail_with(const std::string& sentence) const;

 private:
  void skip_blanks();
  std::string location() const;

  std::string_view text_;
  size_t position_ = 0, end_, last_ = 0;  // last_: where the last thing read begins
  std::string file_;
  bool by_line_ = true;
};

}  // namespace tendril::fem
