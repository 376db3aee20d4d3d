// SPDX-License-Identifier: Apache-2.0
#include "tests/validation/report.h"

#include <nlohmann/json.hpp>

namespace tendril::validation {
namespace {

using nlohmann::json;

json or_null(const std::optional<double>& value) { return value ? json(*value) : json(); }

void write(std::ostream* lines, const json& line) {
  if (lines) *lines << line.dump() << std::endl;  // at once: tools/validate shows progress
}

const char* name_of(Style style) {
  switch (style) {
    case Style::kLine:
      return "line";
    case Style::kMarks:
      return "marks";
    case Style::kBoth:
      return "both";
    case Style::kGuide:
      return "guide";
  }
  return "";
}

}  // namespace

bool Row::passed() const {
  const bool limited = at_least || at_most;
  return !limited || (value >= at_least.value_or(value) && value <= at_most.value_or(value));
}

void Report::begin_case(const std::string& name, const std::string& title) {
  write(lines_, {{"kind", "case"}, {"name", name}, {"title", title}});
}

void Report::add(const Row& row) {
  rows_.push_back(row);
  write(lines_, {{"kind", "row"},
                 {"what", row.what},
                 {"value", row.value},
                 {"unit", row.unit},
                 {"at_least", or_null(row.at_least)},
                 {"at_most", or_null(row.at_most)},
                 {"passed", row.passed()}});
}

void Report::note(const std::string& what, double value, const std::string& unit) {
  add({what, value, unit, {}, {}});
}

void Report::at_most(const std::string& what, double value, const std::string& unit, double limit) {
  add({what, value, unit, {}, limit});
}

void Report::within(const std::string& what, double value, const std::string& unit, double lower,
                    double upper) {
  add({what, value, unit, lower, upper});
}

void Report::picture(const Picture& picture) {
  write(lines_, {{"kind", "picture"},
                 {"title", picture.title},
                 {"x", picture.x},
                 {"y", picture.y},
                 {"logarithmic", picture.logarithmic}});
}

void Report::series(const std::string& label, Style style, const std::vector<double>& x,
                    const std::vector<double>& y) {
  write(lines_, {{"kind", "series"}, {"label", label}, {"style", name_of(style)}, {"x", x}, {"y", y}});
}

void Report::skipped(const std::string& why) {
  skipped_.push_back(why);
  write(lines_, {{"kind", "skipped"}, {"why", why}});
}

}  // namespace tendril::validation
