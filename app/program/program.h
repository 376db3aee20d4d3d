// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "app/program/command_line.h"

namespace tendril::app {

/// A program from its first line to its exit code: reads the command line, makes stderr its log, and runs its
/// body. What the body throws becomes one line of log and an exit code: kUsage for a ConfigError,
/// kEnvironment for anything else. To be all that a main does once the command line is declared.
/// @param name  of the program, in each line of its log
/// @param body  gives the exit code; not called where the command line ends the program, as --help does
/// Real-time: no.
int run_program(const std::string& name, CommandLine& command_line, int argc, const char* const* argv,
                const std::function<int()>& body);

}  // namespace tendril::app
