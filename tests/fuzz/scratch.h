// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace tendril::fuzz {

/// A path in a folder of this process, for what is fed through a file or a socket; gone when the process
/// ends.
std::filesystem::path scratch_path(const std::string& name);

/// Writes a file there. @return its path
std::filesystem::path scratch_file(const std::string& name, const std::string& bytes);

}  // namespace tendril::fuzz
