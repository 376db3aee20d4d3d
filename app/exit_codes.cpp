#include "app/exit_codes.h"

#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>

#include "app/config.h"

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

std::optional<int> parse_arguments(CLI::App& cli, int argc, char** argv) {
  try {
    cli.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    return cli.exit(error) == 0 ? kOk : kUsage;  // CLI11's own codes are many, ours are four
  }
}

}  // namespace tendril::app
