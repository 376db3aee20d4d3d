#pragma once

#include <functional>

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

}  // namespace tendril::app
