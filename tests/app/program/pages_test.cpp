// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <fstream>

#include "tests/app/program/programs.h"

// What is installed beside the programs: manual pages and what completes their commands in a shell. Made from
// the same declarations as --help.

namespace tendril::app::pages_test {

std::string printed(const std::vector<std::string>& arguments) {
  const Ended ended = run(arguments);
  INFO(ended.err);
  REQUIRE(ended.code == 0);
  return ended.out;
}

/// The long options that --help names, with their dashes.
std::vector<std::string> options_of(const std::string& help) {
  std::vector<std::string> result;
  for (const std::string& line : lines_of(help)) {
    const std::size_t begin = line.find("--");
    if (begin == std::string::npos || line.find_first_not_of(" -h,") < begin + 2) continue;
    result.push_back(line.substr(begin, line.find_first_of(" ,\n", begin) - begin));
  }
  return result;
}

TEST_CASE("A manual page has every option that --help has, and no line that roff takes for a request",
          "[unit]") {
  const std::string program = GENERATE(kDaemon, kPlant, kCtl);
  CAPTURE(program);
  const std::string page = printed({program, "--print-man-page"});
  const auto options = options_of(printed({program, "--help"}));
  REQUIRE(options.size() >= 1);
  for (std::string option : options) {
    for (std::size_t at = 0; (at = option.find('-', at)) != std::string::npos; at += 2)
      option.insert(at, "\\");
    CHECK_THAT(page, Catch::Contains(option));
  }
  for (const std::string& line : lines_of(page)) {
    if (!line.starts_with('.')) continue;
    const std::string request = line.substr(0, line.find(' '));
    CHECK((request == ".TH" || request == ".SH" || request == ".SS" || request == ".TP" || request == ".PP" ||
           request == ".br"));
  }
}

TEST_CASE("bash completes commands, and the options of each", "[unit]") {
  RobotFile file("");
  const std::filesystem::path script = file.folder() / "completion";
  std::ofstream(script) << printed({kCtl, "--print-completion", "bash"});
  const auto completed = [&](const std::string& words, int place) {
    return lines_of(printed({"/bin/bash", "-c",
                             "source " + script.string() + "; COMP_WORDS=(tendrilctl " + words +
                                 "); COMP_CWORD=" + std::to_string(place) +
                                 "; _tendrilctl; printf '%s\\n' \"${COMPREPLY[@]}\""}));
  };
  CHECK(completed("res", 1) == std::vector<std::string>{"resume", "reset"});
  CHECK(completed("monitor --r", 2) == std::vector<std::string>{"--rate"});
  CHECK(completed("status --w", 2) == std::vector<std::string>{"--watch"});
}

TEST_CASE("zsh and fish learn every command", "[unit]") {
  const std::string shell = GENERATE("zsh", "fish");
  const std::string script = printed({kCtl, "--print-completion", shell});
  for (const std::string command : {"status", "faults", "target", "play", "reset", "jog"})
    CHECK_THAT(script, Catch::Contains(command));
}

}  // namespace tendril::app::pages_test
