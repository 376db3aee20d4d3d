// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace tendril::app {

/// Exit codes of every program.
enum ExitCode {
  kOk = 0,
  kCheckFailed = 1,  ///< also: the run ended on a fault
  kUsage = 2,        ///< wrong arguments or configuration
  kEnvironment = 3,  ///< rights or bus are missing
};

}  // namespace tendril::app
