// SPDX-License-Identifier: Apache-2.0
#include "app/plant/plant_console.h"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>

#include "app/config/plant_fault_parser.h"

namespace tendril::app {
namespace {

constexpr std::size_t kLongestLine = 1024;

}  // namespace

PlantConsole::PlantConsole(const Config& config) : config_(config) {
  // A job in the background that reads the terminal would be stopped, and the robot with it.
  std::signal(SIGTTIN, SIG_IGN);
}

std::vector<PlantFault> PlantConsole::read(int timeout_ms) {
  std::vector<PlantFault> faults;
  pollfd input{ended_ ? -1 : STDIN_FILENO, POLLIN, 0};  // a negative descriptor only waits
  if (poll(&input, 1, timeout_ms) <= 0) return faults;
  char bytes[512];
  const ssize_t got = ::read(STDIN_FILENO, bytes, sizeof bytes);
  if (got <= 0) {
    ended_ = got == 0 || errno != EINTR;
    return faults;
  }
  pending_.append(bytes, static_cast<std::size_t>(got));
  for (std::size_t end = 0; (end = pending_.find('\n')) != std::string::npos; pending_.erase(0, end + 1))
    obey(pending_.substr(0, end), faults);
  if (pending_.size() > kLongestLine) {
    spdlog::error("standard input: a line longer than {} letters is no fault; 'help' lists them",
                  kLongestLine);
    pending_.clear();
  }
  return faults;
}

void PlantConsole::obey(const std::string& line, std::vector<PlantFault>& faults) const {
  if (line.find_first_not_of(" \t\r") == std::string::npos) return;
  if (line == "help") {
    fmt::print("{}", plant_fault_help(*config_.bus.master.protocol));
    std::fflush(stdout);
    return;
  }
  try {
    faults.push_back(parse_plant_fault(line, config_));
    spdlog::info("injected: {}", line);
  } catch (const PlantFaultMistake& mistake) {
    spdlog::error("standard input: found '{}', expected {}", line, mistake.what());
  }
}

}  // namespace tendril::app
