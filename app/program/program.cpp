// SPDX-License-Identifier: Apache-2.0
#include "app/program/program.h"

#include <spdlog/spdlog.h>

#include "app/config/config_error.h"
#include "app/program/exit_codes.h"
#include "app/program/output.h"

namespace tendril::app {

int run_program(const std::string& name, CommandLine& command_line, int argc, const char* const* argv,
                const std::function<int()>& body) {
  open_standard_descriptors();
  if (const auto code = command_line.parse(argc, argv)) return *code;
  log_to_stderr(name);
  try {
    return body();
  } catch (const ConfigError& error) {
    spdlog::error("{}", error.what());
    return kUsage;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return kEnvironment;
  }
}

}  // namespace tendril::app
