// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/app/program/process.h"
#include "tests/app/robot_file.h"

namespace tendril::app {

inline const std::string kDaemon = TENDRIL_DAEMON;
inline const std::string kPlant = TENDRIL_PLANT;
inline const std::string kCtl = TENDRIL_CTL;

/// The text of config/finger.yaml, whose mesh is found from any folder, with pieces of it replaced.
/// @param changes  each replaces the first such piece
/// @throws std::runtime_error where a piece is not there
std::string finger(const Changes& changes = {});

/// What makes of it the file for ODrive axes on the same nodes.
/// @param reference  of both, "absolute" or "power_on"
Changes odrive(const std::string& firmware, const std::string& reference = "absolute");

/// The number of the line of finger() on which a piece first stands.
int line_of(const std::string& piece);

/// A command whose Python does not start: it draws no pictures of the run, which would take longer than it.
std::vector<std::string> without_pictures(std::vector<std::string> command);

/// For tests in which a node falls silent: it is missed after 5 s instead of 30. Whoever stalls for as long
/// is missed, too.
extern const Changes kSoonMissed;

/// Both programs on a bus, on a finger that is patient with a busy machine: it runs at a third of its
/// rate and waits half a minute and more before it calls something late. Folder, bus and plant go with the
/// object.
class Workbench {
 public:
  /// Starts the plant and waits for its bus.
  /// @param changes  of the finger's file; they go before the patience
  /// @param bus  a CAN interface; empty: a local bus of the bench's own
  /// @throws std::runtime_error with what the plant says where it does not come up
  explicit Workbench(const Changes& changes = {}, const std::string& bus = {});

  /// The command line of the daemon on this bench, and what is added to it.
  std::vector<std::string> daemon(const std::vector<std::string>& more = {}) const;

  /// `tendrilctl jog` of an actuator on this bench, and what is added to it.
  std::vector<std::string> jog(const std::string& actuator, const std::vector<std::string>& more) const;

  Process& plant() { return plant_; }
  std::string bus() const { return bus_; }
  std::filesystem::path folder() const { return file_.folder(); }
  std::filesystem::path report() const { return folder() / "report"; }

 private:
  RobotFile file_;
  std::string bus_;
  Process plant_;
};

/// report/summary.json.
nlohmann::json read_summary(const std::filesystem::path& report);

/// report/trace.csv.
struct Trace {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  // one a cycle, all as long as columns

  /// A cell as text. @throws std::out_of_range where there is no such column
  const std::string& cell(std::size_t row, const std::string& column) const;
  /// A cell as a number. @throws std::invalid_argument where it is none
  double number(std::size_t row, const std::string& column) const { return std::stod(cell(row, column)); }
  /// The rows of some phases.
  std::vector<std::size_t> of(const std::vector<std::string>& phases) const;
};

/// @throws std::runtime_error where a row has another number of cells than the header
Trace read_trace(const std::filesystem::path& report);

}  // namespace tendril::app
