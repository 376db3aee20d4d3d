#pragma once

#include <functional>
#include <optional>

namespace CLI {
class App;
}

namespace tendril::app {

/// Exit codes of every program.
enum ExitCode {
  kOk = 0,
  kCheckFailed = 1,  ///< also: the run ended on a fault
  kUsage = 2,        ///< wrong arguments or configuration
  kEnvironment = 3,  ///< rights or bus are missing
};

/// Runs the body of a main and turns what it throws into one line of log and an exit code: kUsage for a
/// ConfigError, kEnvironment for anything else.
int exit_code_of(const std::function<int()>& body);

/// Parses the arguments of a program.
/// @return  the exit code where the program shall end at once: after --help and --version, and for wrong
/// usage,
///          which CLI11 has explained on stderr by then
std::optional<int> parse_arguments(CLI::App& cli, int argc, char** argv);

}  // namespace tendril::app
