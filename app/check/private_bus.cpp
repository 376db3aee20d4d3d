// SPDX-License-Identifier: Apache-2.0
#include "app/check/private_bus.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <filesystem>
#include <stdexcept>

namespace tendril::app {

PrivateBus::PrivateBus() : folder_((std::filesystem::temp_directory_path() / "tendril-XXXXXX").string()) {
  if (mkdtemp(folder_.data()) == nullptr)
    throw std::runtime_error(
        fmt::format("cannot make {}: set TMPDIR to a folder that can be written", folder_));
}

PrivateBus::~PrivateBus() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace tendril::app
