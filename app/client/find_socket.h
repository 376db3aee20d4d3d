// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace tendril::app {

/// The socket that is asked for, or the only one in /run/tendril.
/// @param given  empty: none
/// @throws std::runtime_error where there is none there, or several
/// Real-time: no.
std::filesystem::path find_socket(const std::filesystem::path& given);

}  // namespace tendril::app
