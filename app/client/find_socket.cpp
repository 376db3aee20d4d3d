// SPDX-License-Identifier: Apache-2.0
#include "app/client/find_socket.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <stdexcept>
#include <string>
#include <vector>

namespace tendril::app {
namespace {

const std::filesystem::path kSockets = "/run/tendril";

}  // namespace

std::filesystem::path find_socket(const std::filesystem::path& given) {
  if (!given.empty()) return given;
  std::vector<std::filesystem::path> found;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(kSockets, none))
    if (entry.path().extension() == ".sock") found.push_back(entry.path());
  if (found.size() == 1) return found.front();
  if (found.empty())
    throw std::runtime_error(
        fmt::format("no daemon listens in {}: say which socket with --socket, the same as tendrild was given",
                    kSockets.string()));
  std::vector<std::string> names;
  for (const auto& path : found) names.push_back(path.string());
  throw std::runtime_error(
      fmt::format("several daemons run: choose one with --socket {}", fmt::join(names, " or ")));
}

}  // namespace tendril::app
