// SPDX-License-Identifier: Apache-2.0
#include "app/client/trajectory.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <span>

#include "app/config/config_error.h"
#include "app/config/quantity.h"

namespace tendril::app {
namespace {

std::string trimmed(const std::string& text) {
  const auto begin = text.find_first_not_of(" \t\r"), end = text.find_last_not_of(" \t\r");
  return begin == std::string::npos ? "" : text.substr(begin, end - begin + 1);
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  for (std::size_t begin = 0;;) {
    const std::size_t end = line.find(',', begin);
    cells.push_back(trimmed(line.substr(begin, end - begin)));
    if (end == std::string::npos) return cells;
    begin = end + 1;
  }
}

std::optional<double> number(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// A column of the header: "tip.x [mm]".
struct Column {
  std::string name;
  Dimension dimension;
  double si = 1;  // of one of its units
};

Column column_of(const std::string& cell, const std::string& where) {
  const std::size_t bracket = cell.find('[');
  const std::string name = bracket == std::string::npos ? cell : trimmed(cell.substr(0, bracket));
  const Dimension dimension = name == "t"                 ? Dimension::kTime
                              : name.ends_with(".volume") ? Dimension::kVolume
                                                          : Dimension::kLength;
  Column column{name, dimension, 1};
  if (bracket == std::string::npos) return column;
  const std::string unit = trimmed(cell.substr(bracket + 1, cell.rfind(']') - bracket - 1));
  if (!cell.ends_with("]") || !parse_quantity("1 " + unit, dimension, std::span(&column.si, 1)))
    throw ConfigError(fmt::format("{}: '{}' has no unit that is known, such as {}", where, cell,
                                  describe_quantity(1, dimension)));
  return column;
}

/// A cell in the SI unit. Differences and products of values that a robot can have stay finite.
double value_of(const std::string& cell, const Column& column, const std::string& where) {
  const auto value = number(cell);
  if (!value) throw ConfigError(fmt::format("{}: '{}' is no finite number", where, cell));
  const double greatest = magnitudes_of(column.dimension).greatest;
  if (std::abs(*value * column.si) > greatest)
    throw ConfigError(
        fmt::format("{}: '{}' is beyond {:g} {}", where, cell, greatest, si_unit(column.dimension)));
  return *value * column.si;
}

}  // namespace

Trajectory::Trajectory(const std::filesystem::path& file, const std::vector<std::string>& coordinates) {
  std::ifstream in(file);
  if (!in) throw ConfigError(fmt::format("{}: there is no such file, or it cannot be read", file.string()));
  std::vector<Column> columns;
  int number_of_line = 0;
  for (std::string line; std::getline(in, line);) {
    const std::string where = fmt::format("{}:{}", file.string(), ++number_of_line);
    if (trimmed(line).empty() || trimmed(line).front() == '#') continue;
    const std::vector<std::string> cells = cells_of(line);
    if (columns.empty()) {
      for (const std::string& cell : cells) columns.push_back(column_of(cell, where));
      if (columns.front().name != "t" || columns.size() < 2)
        throw ConfigError(fmt::format("{}: the header begins with t and names coordinates: t, {}", where,
                                      fmt::join(coordinates, ", ")));
      for (std::size_t k = 1; k < columns.size(); ++k) {
        if (std::find(coordinates.begin(), coordinates.end(), columns[k].name) == coordinates.end())
          throw ConfigError(fmt::format("{}: the robot has no coordinate '{}'; it has: {}", where,
                                        columns[k].name, fmt::join(coordinates, ", ")));
        if (std::find(names_.begin(), names_.end(), columns[k].name) != names_.end())
          throw ConfigError(fmt::format("{}: '{}' stands twice", where, columns[k].name));
        names_.push_back(columns[k].name);
      }
      continue;
    }
    if (cells.size() != columns.size())
      throw ConfigError(
          fmt::format("{}: {} values, where the header has {} columns", where, cells.size(), columns.size()));
    std::vector<double> values;
    for (std::size_t k = 0; k < cells.size(); ++k) values.push_back(value_of(cells[k], columns[k], where));
    if (!times_.empty() && values.front() <= times_.back())
      throw ConfigError(fmt::format("{}: t = {:g} s is not after the row before it", where, values.front()));
    times_.push_back(values.front());
    points_.emplace_back(values.begin() + 1, values.end());
  }
  if (times_.empty()) throw ConfigError(fmt::format("{}: has no row beside its header", file.string()));
  const double begin = times_.front();
  for (double& time : times_) time -= begin;
}

std::vector<double> Trajectory::at(double t_s) const {
  const auto after = std::upper_bound(times_.begin(), times_.end(), t_s);
  if (after == times_.begin()) return points_.front();
  if (after == times_.end()) return points_.back();
  const auto next = static_cast<std::size_t>(after - times_.begin());
  const double share = (t_s - times_[next - 1]) / (times_[next] - times_[next - 1]);
  std::vector<double> point = points_[next - 1];
  for (std::size_t k = 0; k < point.size(); ++k) point[k] += share * (points_[next][k] - point[k]);
  return point;
}

}  // namespace tendril::app
