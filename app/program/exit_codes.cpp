#include "app/program/exit_codes.h"

#include <spdlog/spdlog.h>

#include "app/config/config_error.h"

namespace tendril::app {

int exit_code_of(const std::function<int()>& body) {
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
