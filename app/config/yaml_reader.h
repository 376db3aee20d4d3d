// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <concepts>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "app/config/quantity.h"

namespace tendril::app {

using hal::kNotNegative;
using hal::kPositive;
using hal::Range;

/// The words a key may have for its value, and what each means.
template <class T>
using Words = std::vector<std::pair<std::string_view, T>>;

/// What all values of one file share.
struct Source {
  std::filesystem::path file;
  std::map<std::string, bool> keys = {};  // "actuators[].drive.node" to: is it required; all asked for so far
};

class Reader;

/// One value of a YAML file that knows its place: reads itself into a C++ object, or fails with a ConfigError
/// that says file, line, key, what was found and what is expected.
///
/// `read(out, how...)` is one overload for each kind of value; further kinds are functions of their own,
/// either `void leaf(const Value&, T&)` or, for a mapping, `void section(Reader&, T&)`. Real-time: no, for
/// all of it (allocates, throws).
class Value {
 public:
  /// @param path    keys from the top to here, "actuators[2].tension"; empty for the whole file
  /// @param source  outlives the value
  Value(const YAML::Node& node, std::string path, int line, Source& source);

  /// A number with a unit, or several on one line, in SI.
  void read(double& out, Dimension dimension, const Range& range = {}) const;
  /// Two numbers in ascending order, such as the two ends of a limit.
  void read(double& min, double& max, Dimension dimension, const Range& range = {}) const;
  void read(Eigen::Vector3d& out, Dimension dimension) const;
  /// Two opposite corners of a box, a list of two, the lower one first.
  void read(Eigen::Vector3d& min, Eigen::Vector3d& max, Dimension dimension) const;
  /// A whole number, decimal or hexadecimal (0x1F0).
  void read(int& out, const Range& range = {}) const;
  void read(bool& out) const;
  template <class T>
  void read(T& out, const Words<T>& words) const;
  template <class T, std::invocable<const Value&, T&> Leaf>
  void read(T& out, const Leaf& leaf) const {
    leaf(*this, out);
  }
  template <class T, std::invocable<Reader&, T&> Section>
  void read(T& out, const Section& section) const;
  /// A list with at least one entry, each read by the same `how`.
  template <class T, class... How>
  void read(std::vector<T>& out, const How&... how) const {
    for (const Value& item : items()) item.read(out.emplace_back(), how...);
  }
  template <class T, class... How>
  void read(std::optional<T>& out, const How&... how) const {
    read(out.emplace(), how...);
  }

  /// The text of a scalar, not empty.
  [[nodiscard]] std::string text(std::string_view expected) const;
  [[nodiscard]] bool is_mapping() const { return node_.IsMap(); }
  [[nodiscard]] bool is_list() const { return node_.IsSequence(); }
  /// The entries of a list, at least one.
  [[nodiscard]] std::vector<Value> items() const;
  /// An entry of a mapping; where there is no such key, an empty value on the mapping's line.
  [[nodiscard]] Value at(std::string_view key) const;
  /// An entry of a list that has so many.
  [[nodiscard]] Value at(std::size_t index) const;
  [[nodiscard]] int line() const { return line_; }
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::filesystem::path folder() const { return source_->file.parent_path(); }

  /// @throws ConfigError "FILE:LINE: PATH: found ..., expected EXPECTED"
  [[noreturn]] void fail(std::string_view expected) const;

 private:
  friend class Reader;
  void read_numbers(std::span<double> out, Dimension dimension) const;
  [[noreturn]] void fail_with(std::string_view sentence) const;
  [[nodiscard]] std::string found() const;
  [[nodiscard]] std::string path_of(std::string_view key) const;

  YAML::Node node_;
  std::string path_;
  int line_;
  Source* source_;
};

/// The keys of one mapping: hands each to its reader and remembers which were asked for.
///
/// A key that is missing leaves its default in place until finish(), so that a misspelt key is reported as
/// such and not as the absence of the right one.
class Reader {
 public:
  /// @throws ConfigError where the value is no mapping or has a key twice
  explicit Reader(const Value& section);

  /// Reads a key that the file must have; `how` as for Value::read.
  template <class... Args>
  void need(std::string_view key, Args&&... args) {
    if (ask(key, true)) section_.at(key).read(std::forward<Args>(args)...);
  }
  /// Reads a key that the file may have; without it the object keeps its default.
  template <class... Args>
  void may(std::string_view key, Args&&... args) {
    if (ask(key, false)) section_.at(key).read(std::forward<Args>(args)...);
  }
  /// Which of several keys it has, where a section must have exactly one of them; read that with may().
  std::string_view one_of(std::initializer_list<std::string_view> keys);
  /// @throws ConfigError on a key that nobody asked for, with the nearest one that somebody did; then on one
  /// missing
  void finish() const;

  [[nodiscard]] int line() const { return section_.line(); }
  [[nodiscard]] bool has(std::string_view key) const { return given_.contains(std::string(key)); }
  /// Whether somebody has asked for the key.
  [[nodiscard]] bool asked(std::string_view key) const { return asked_.contains(std::string(key)); }
  [[nodiscard]] Value at(std::string_view key) const { return section_.at(key); }

 private:
  bool ask(std::string_view key, bool required);
  [[nodiscard]] const std::string* nearest_asked(const std::string& key) const;
  [[noreturn]] void fail_unknown(const std::string& key, int line) const;

  Value section_;
  std::map<std::string, int> given_;        // key, line
  std::map<std::string, bool> asked_ = {};  // key, required
};

template <class T>
void Value::read(T& out, const Words<T>& words) const {
  std::string expected;
  for (const auto& [word, meaning] : words) {
    if (node_.IsScalar() && node_.Scalar() == word) {
      out = meaning;
      return;
    }
    expected += (expected.empty() ? "" : " or ") + std::string(word);
  }
  fail(expected);
}

template <class T, std::invocable<Reader&, T&> Section>
void Value::read(T& out, const Section& section) const {
  Reader reader(*this);
  section(reader, out);
  reader.finish();
}

/// Opens and parses one YAML document.
/// @param source  outlives the value
/// @throws        ConfigError where the file cannot be read, is empty, holds several documents or is not YAML
Value load_yaml(Source& source);

}  // namespace tendril::app
