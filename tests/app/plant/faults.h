// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hal/bus/bus.h"
#include "tests/app/program/programs.h"

namespace tendril::app {

/// Fails the test where the daemon does not come to run.
void require_running(Process& daemon, Workbench& bench);

/// What befalls a robot, as a line to the plant, and the reason with which it then stops.
using Faults = std::vector<std::pair<std::string, std::string>>;

/// Lets it all befall one robot, run by run; each run clears what the former has left.
void check_stops(Workbench& bench, const Faults& faults);

using Question = std::function<bool(const hal::Frame&)>;

/// Listens to some frames of a bus from now on, also while nobody asks for them.
class Ear {
 public:
  /// @param wanted  identifiers; so few of their frames come that they find room until they are asked for
  Ear(const std::string& bus, const std::vector<uint32_t>& wanted);

  /// Waits until each question has had a frame that answers it with yes.
  /// @return  false where patience was at an end before
  bool hears(std::vector<Question> questions);

 private:
  std::unique_ptr<hal::Bus> bus_;
  std::string last_;
};

}  // namespace tendril::app
