// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace tendril::app {

/// Where effectors shall be at which time: a table, mostly read from a CSV file. Its header names the
/// columns: "t", and coordinates such as "tip.x", each with its unit in brackets ("tip.x [mm]") or without
/// one in SI units. Between its rows it is linear. Real-time: no, for all of it.
class Trajectory {
 public:
  /// @param coordinates  those that the robot has
  /// @throws ConfigError with file and line where it is not such a table
  Trajectory(const std::filesystem::path& file, const std::vector<std::string>& coordinates);

  /// @param times   s, ascending, the first one is 0
  /// @param points  one a time, each with one value a name, m or m³
  Trajectory(std::vector<std::string> names, std::vector<double> times,
             std::vector<std::vector<double>> points)
      : names_(std::move(names)), times_(std::move(times)), points_(std::move(points)) {}

  /// Names of the coordinates that it moves.
  const std::vector<std::string>& names() const { return names_; }

  double duration_s() const { return times_.back(); }

  /// Where they shall be, one a name, m or m³.
  /// @param t_s  from the first row on; beyond the ends, the first and the last row hold
  std::vector<double> at(double t_s) const;

 private:
  std::vector<std::string> names_;
  std::vector<double> times_;                // s, the first one is 0
  std::vector<std::vector<double>> points_;  // one a time
};

}  // namespace tendril::app
