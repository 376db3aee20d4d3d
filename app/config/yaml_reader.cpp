// SPDX-License-Identifier: Apache-2.0
#include "app/config/yaml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numeric>
#include <system_error>

#include "app/config/config_error.h"

namespace tendril::app {
namespace {

/// The text as it stands in a message: on one line, and no longer than one.
std::string quoted(std::string text) {
  constexpr std::size_t kLongest = 60;
  if (text.size() > kLongest) text = text.substr(0, kLongest - 3) + "...";
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < ' ' || c == 127; }, ' ');
  return "'" + text + "'";
}

/// Insertions, deletions and replacements that turn one word into the other (Levenshtein).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = std::exchange(row[j + 1], std::min({replaced, row[j] + 1, row[j + 1] + 1}));
    }
  }
  return row.back();
}

/// "actuators[2].drive" names the same key of the schema as "actuators[0].drive".
std::string without_indices(std::string_view path) {
  std::string schema;
  bool in_index = false;
  for (const char c : path) {
    in_index = in_index && c != ']';
    if (!in_index) schema += c;
    in_index = in_index || c == '[';
  }
  return schema;
}

bool contains(const Range& range, double value) {
  return value > range.above && value >= range.at_least && value <= range.at_most && value < range.below;
}

/// " above 0 Hz and no more than 20000 Hz", " from 1 to 127"; empty where nothing binds.
std::string describe(const Range& range, std::string_view unit) {
  const auto with_unit = [&](double bound) {
    return fmt::format("{}{}{}", bound, unit.empty() ? "" : " ", unit);
  };
  if (range.at_least > -Range::kInfinity && range.at_most < Range::kInfinity) {
    return " from " + with_unit(range.at_least) + " to " + with_unit(range.at_most);
  }
  std::string text;
  const auto add = [&](const char* words, double bound) {
    if (std::abs(bound) == Range::kInfinity) return;
    text += (text.empty() ? " " : " and ") + std::string(words) + with_unit(bound);
  };
  add("above ", range.above);
  add("no less than ", range.at_least);
  add("no more than ", range.at_most);
  add("below ", range.below);
  return text;
}

}  // namespace

Value::Value(const YAML::Node& node, std::string path, int line, Source& source)
    : node_(node), path_(std::move(path)), line_(line), source_(&source) {}

void Value::read(double& out, Dimension dimension, const Range& range) const {
  read_numbers({&out, 1}, dimension);
  const double least = magnitudes_of(dimension).least;
  if (out != 0 && std::abs(out) < least)
    fail("a magnitude of" + describe({.at_least = least}, si_unit(dimension)));
  if (!contains(range, out)) fail("a value" + describe(range, si_unit(dimension)));
}

void Value::read(double& min, double& max, Dimension dimension, const Range& range) const {
  std::array<double, 2> ends = {};
  read_numbers(ends, dimension);
  if (!std::ranges::all_of(ends, [&](double end) { return contains(range, end); })) {
    fail("two values" + describe(range, si_unit(dimension)));
  }
  if (ends[0] > ends[1]) fail("the lower limit first, then the upper one");
  min = ends[0];
  max = ends[1];
}

void Value::read(Eigen::Vector3d& out, Dimension dimension) const {
  read_numbers({out.data(), 3}, dimension);
}

void Value::read_numbers(std::span<double> out, Dimension dimension) const {
  if (!node_.IsScalar() || !parse_quantity(node_.Scalar(), dimension, out)) {
    fail(describe_quantity(out.size(), dimension));
  }
  const double greatest = magnitudes_of(dimension).greatest;
  for (const double number : out)
    if (std::abs(number) > greatest)
      fail("a magnitude of" + describe({.at_most = greatest}, si_unit(dimension)));
}

void Value::read(Eigen::Vector3d& min, Eigen::Vector3d& max, Dimension dimension) const {
  if (!node_.IsSequence() || node_.size() != 2) fail("a list of two corners, as in [-1 -1 0 m, 1 1 2 m]");
  at(std::size_t{0}).read(min, dimension);
  at(std::size_t{1}).read(max, dimension);
  if ((min.array() > max.array()).any()) {
    at(std::size_t{1}).fail("a corner with no coordinate below the first corner's");
  }
}

void Value::read(int& out, const Range& range) const {
  const std::string_view text = node_.IsScalar() ? std::string_view(node_.Scalar()) : std::string_view();
  const bool hexadecimal = text.starts_with("0x");
  const char* const begin = text.data() + (hexadecimal ? 2 : 0);
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(begin, end, out, hexadecimal ? 16 : 10);
  if (error != std::errc() || stop != end || !contains(range, out)) {
    fail("a whole number" + describe(range, ""));
  }
}

void Value::read(bool& out) const { read(out, Words<bool>{{"true", true}, {"false", false}}); }

std::string Value::text(std::string_view expected) const {
  if (!node_.IsScalar() || node_.Scalar().empty()) fail(expected);
  return node_.Scalar();
}

std::vector<Value> Value::items() const {
  if (!node_.IsSequence() || node_.size() == 0) fail("a list with at least one entry");
  std::vector<Value> items;
  for (std::size_t index = 0; index < node_.size(); ++index) items.push_back(at(index));
  return items;
}

Value Value::at(std::string_view key) const {
  for (const auto& entry : node_) {
    if (!entry.first.IsDefined() || !entry.first.IsScalar() || entry.first.Scalar() != key) continue;
    // A section is where its key is: yaml-cpp would say the line of the first key in it, or of what follows
    // where there is nothing.
    const YAML::Node& place = entry.second.IsScalar() ? entry.second : entry.first;
    return {entry.second, path_of(key), place.Mark().line + 1, *source_};
  }
  return {YAML::Node(), path_of(key), line_, *source_};
}

Value Value::at(std::size_t index) const {
  const YAML::Node item = node_[index];
  return {item, fmt::format("{}[{}]", path_, index), item.IsNull() ? line_ : item.Mark().line + 1, *source_};
}

std::string Value::path_of(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

std::string Value::found() const {
  if (node_.IsScalar()) return quoted(node_.Scalar());
  if (node_.IsSequence()) return fmt::format("a list of {}", node_.size());
  return node_.IsMap() ? "a mapping of keys" : "nothing";
}

void Value::fail(std::string_view expected) const {
  fail_with(fmt::format("found {}, expected {}", found(), expected));
}

void Value::fail_with(std::string_view sentence) const {
  throw ConfigError(fmt::format("{}:{}: {}{}{}", source_->file.string(), line_, path_,
                                path_.empty() ? "" : ": ", sentence));
}

Reader::Reader(const Value& section) : section_(section) {
  if (!section_.node_.IsMap()) section_.fail("a mapping of keys, as in 'key: value'");
  for (const auto& entry : section_.node_) {
    const int line = entry.first.Mark().line + 1;
    if (!entry.first.IsScalar()) {
      Value(entry.first, section_.path_, line, *section_.source_).fail("a word as key");
    }
    const auto [first, is_new] = given_.emplace(entry.first.Scalar(), line);
    if (is_new) continue;
    Value(entry.first, section_.path_, line, *section_.source_)
        .fail_with(fmt::format("found key {} again, expected it once; line {} has it", quoted(first->first),
                               first->second));
  }
}

bool Reader::ask(std::string_view key, bool required) {
  asked_.emplace(key, required);
  section_.source_->keys.emplace(without_indices(section_.path_of(key)), required);
  return given_.contains(std::string(key));
}

std::string_view Reader::one_of(std::initializer_list<std::string_view> keys) {
  std::string_view found;
  std::string list;
  for (const std::string_view key : keys) {
    list += (list.empty() ? "" : ", ") + std::string(key);
    if (!ask(key, false)) continue;
    if (!found.empty())
      section_.fail_with(fmt::format("found keys '{}' and '{}', expected one of them", found, key));
    found = key;
  }
  if (!found.empty()) return found;
  // What follows depends on the kind, so that a misspelt one must be told here.
  for (const auto& [key, line] : given_)
    if (!asked_.contains(key) && nearest_asked(key)) fail_unknown(key, line);
  section_.fail_with("missing a key, expected one of: " + list);
}

void Reader::finish() const {
  for (const auto& [key, line] : given_) {
    if (!asked_.contains(key)) fail_unknown(key, line);
  }
  for (const auto& [key, required] : asked_) {
    if (required && !given_.contains(key)) section_.fail_with(fmt::format("missing key '{}'", key));
  }
}

const std::string* Reader::nearest_asked(const std::string& key) const {
  const auto distance = [&](const auto& asked) { return edit_distance(key, asked.first); };
  const auto nearest = std::ranges::min_element(asked_, {}, distance);
  return distance(*nearest) <= 1 + key.size() / 3 ? &nearest->first : nullptr;
}

void Reader::fail_unknown(const std::string& key, int line) const {
  std::string advice = "known keys:";
  if (const std::string* nearest = nearest_asked(key)) {
    advice = fmt::format("did you mean '{}'?", *nearest);
  } else {
    for (const auto& [known, required] : asked_) advice += fmt::format(" {}", known);
  }
  Value(YAML::Node(), section_.path_, line, *section_.source_)
      .fail_with(fmt::format("unknown key {}; {}", quoted(key), advice));
}

Value load_yaml(Source& source) {
  const std::string name = source.file.string();
  const auto cannot_read = [&](const std::string& why) {
    return ConfigError(fmt::format("{}: cannot be read: {}; expected a robot file", name, why));
  };
  std::error_code ignored;
  if (std::filesystem::is_directory(source.file, ignored)) throw cannot_read("it is a folder");
  std::ifstream stream(source.file, std::ios::binary);
  if (!stream) throw cannot_read(std::generic_category().message(errno));
  try {
    std::vector<YAML::Node> documents = YAML::LoadAll(stream);
    if (stream.bad()) throw cannot_read(std::generic_category().message(errno));
    if (documents.empty() || documents[0].IsNull()) {
      throw ConfigError(name + ":1: found nothing, expected a robot");
    }
    if (documents.size() > 1) {
      const int line = documents[1].Mark().line + 1;
      throw ConfigError(fmt::format("{}:{}: found a second document, expected one robot a file", name, line));
    }
    return {documents[0], "", 1, source};
  } catch (const YAML::Exception& error) {
    throw ConfigError(fmt::format("{}:{}: found no valid YAML: {}", name, error.mark.line + 1, error.msg));
  }
}

}  // namespace tendril::app
