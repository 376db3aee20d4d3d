// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tendril::app {

/// A robot file without a mistake, beside "body.msh".
extern const std::string kGood;

/// One mistake: the first `good` in a sound file becomes `bad`, and the message names the line on which `at`
/// then first stands (where `at` is null: `bad`), and has all the fragments.
struct Mistake {
  std::string good, bad;
  const char* at;
  std::vector<std::string> fragments;
};

/// Makes each mistake by itself and checks what load_config says of it.
/// @param base  a robot file without a mistake
void check_mistakes(const std::vector<Mistake>& mistakes, const std::string& base = kGood);

/// What load_config says of a file; "no error" where it loads.
std::string error_of(const std::filesystem::path& file);

}  // namespace tendril::app
