// SPDX-License-Identifier: Apache-2.0
#include "tests/app/program/programs.h"

#include <algorithm>
#include <stdexcept>

namespace tendril::app {
namespace {

const std::filesystem::path kConfig = std::filesystem::path(TENDRIL_SOURCE_DIR) / "config";

// A model that refreshes as often as it can leaves other programs no CPU; a cap that is measured is too low
// on a slow machine.
const Changes kPatience{
    {"rate: 600 Hz", "rate: 200 Hz\n  model_rate_limit: 20 Hz\n  iteration_cap: 32"},
    {"late_cycles_limit: 20", "late_cycles_limit: 100000"},
    {"snapshot_age_limit: 500 ms", "snapshot_age_limit: 300 s"},
    {"target_age_limit: 500 ms", "target_age_limit: 300 s"},
    {"heartbeat_timeout: 150 ms", "heartbeat_timeout: 30 s\n  feedback_timeout: 30 s"},
    {"bitrate: 1 Mbit/s\n",
     "bitrate: 1 Mbit/s\n  boot_timeout: 5 s\n  enable_timeout: 60 s\n  disable_timeout: 10 s\n"},
    {"  master_node: 127\n", "  master_node: 127\n  sdo_timeout: 3 s\n"}};

/// Where the plant stalls while the daemon does not, axes lag behind their commands.
std::string with_patient_axes(const std::string& text) {
  std::string result;
  for (std::string line : lines_of(text)) {
    const std::size_t end = line.find("pulley_radius: 5 mm}");
    const bool patient =
        line.find("following_error") == std::string::npos && line.find("effort") == std::string::npos;
    if (end != std::string::npos && patient) line.insert(line.find('}', end), ", following_error: 1 m");
    result += line + "\n";
  }
  return result;
}

/// What a test has changed itself stays as it is.
std::string patient_finger(const Changes& changes) {
  finger(kPatience);  // throws where the shipped file no longer has one of these
  std::string text = finger(changes);
  for (const auto& [from, to] : kPatience)
    if (const std::size_t at = text.find(from); at != std::string::npos) text.replace(at, from.size(), to);
  return with_patient_axes(text);
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char letter : line)
    if (letter == ',')
      cells.emplace_back();
    else
      cells.back() += letter;
  return cells;
}

}  // namespace

std::string finger(const Changes& changes) {
  std::string text = read_text_file(kConfig / "finger.yaml");
  const auto replace = [&text](const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos) throw std::runtime_error("config/finger.yaml has no '" + from + "'");
    text.replace(at, from.size(), to);
  };
  for (const auto& [from, to] : changes) replace(from, to);
  if (text.find("file: finger.msh") != std::string::npos)
    replace("file: finger.msh", "file: " + (kConfig / "finger.msh").string());
  return text;
}

Changes odrive(const std::string& firmware, const std::string& reference) {
  const std::pair<std::string, std::string> turns{"counts_per_turn: 65536, ",
                                                  "reference: " + reference + ", "};
  return {turns,
          turns,
          {"master_node: 127", "protocol: odrive\n  firmware: " + firmware},
          {"id: 0x1F0", "id: 0x7F0"},  // the nodes own the lower ones
          {"id: 0x1F1", "id: 0x7F1"}};
}

std::vector<std::string> without_pictures(std::vector<std::string> command) {
  // Below a device there is no folder on any machine.
  command.insert(command.begin(), {"env", "PYTHONHOME=/dev/null/none"});
  return command;
}

const Changes kSoonMissed{{"heartbeat_timeout: 150 ms", "heartbeat_timeout: 5 s\n  feedback_timeout: 30 s"}};

int line_of(const std::string& piece) {
  const std::string text = finger();
  const auto at = static_cast<std::ptrdiff_t>(text.find(piece));
  return 1 + static_cast<int>(std::count(text.begin(), text.begin() + at, '\n'));
}

Workbench::Workbench(const Changes& changes, const std::string& bus)
    : file_(patient_finger(changes)),
      bus_(bus.empty() ? "local:" + (file_.folder() / "bus").string() : bus),
      plant_({kPlant, file_.path().string(), "--bus", bus_}) {
  if (!plant_.says("ready")) throw std::runtime_error("the plant did not come up: " + plant_.err());
}

std::vector<std::string> Workbench::daemon(const std::vector<std::string>& more) const {
  std::vector<std::string> arguments{kDaemon, file_.path().string(), "--bus", bus(), "--allow-non-rt"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

std::vector<std::string> Workbench::jog(const std::string& actuator,
                                        const std::vector<std::string>& more) const {
  std::vector<std::string> arguments{kCtl,    "jog", file_.path().string(), actuator,
                                     "--bus", bus_,  "--allow-non-rt"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

nlohmann::json read_summary(const std::filesystem::path& report) {
  return nlohmann::json::parse(read_text_file(report / "summary.json"));
}

const std::string& Trace::cell(std::size_t row, const std::string& column) const {
  const auto found = std::ranges::find(columns, column);
  if (found == columns.end()) throw std::out_of_range("the trace has no column " + column);
  return rows.at(row)[static_cast<std::size_t>(found - columns.begin())];
}

std::vector<std::size_t> Trace::of(const std::vector<std::string>& phases) const {
  std::vector<std::size_t> found;
  for (std::size_t row = 0; row < rows.size(); ++row)
    if (std::ranges::find(phases, cell(row, "phase")) != phases.end()) found.push_back(row);
  return found;
}

Trace read_trace(const std::filesystem::path& report) {
  Trace trace;
  for (const std::string& line : lines_of(read_text_file(report / "trace.csv"))) {
    std::vector<std::string> cells = cells_of(line);
    if (trace.columns.empty())
      trace.columns = std::move(cells);
    else if (cells.size() == trace.columns.size())
      trace.rows.push_back(std::move(cells));
    else
      throw std::runtime_error("a row of the trace has not as many cells as its header: " + line);
  }
  return trace;
}

}  // namespace tendril::app
