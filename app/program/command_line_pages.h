// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace CLI {
class App;
}  // namespace CLI

namespace tendril::app {

/// What packages install beside a program, made from the same declarations as its --help. Real-time: no.

/// A manual page, in roff.
/// @param program  its name
std::string man_page(const CLI::App& app, const std::string& program);

/// What completes the program's commands and options in a shell.
/// @param shell  "bash", "zsh" or "fish"
/// @return       empty for another shell
std::string completion(const CLI::App& app, const std::string& program, const std::string& shell);

}  // namespace tendril::app
