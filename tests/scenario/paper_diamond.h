// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "app/config/config.h"
#include "app/config/load_config.h"
#include "tests/own_folder.h"

namespace tendril::app::testing {

/// paper_diamond.yaml, the robot of Largilliere et al. (2015), with its mesh where it is.
/// @param data  folder of diamond.vtu
inline Config paper_diamond(const std::filesystem::path& data) {
  std::ifstream in(std::filesystem::path(TENDRIL_SOURCE_DIR) / "tests/scenario/paper_diamond.yaml");
  std::string text(std::istreambuf_iterator<char>(in), {});
  const std::string key = "../../../shared/data/diamond/diamond.vtu";
  text.replace(text.find(key), key.size(), (data / "diamond.vtu").string());
  const tendril::testing::OwnFolder folder;
  const auto file = folder / "paper_diamond.yaml";
  std::ofstream(file) << text;
  return load_config(file);
}

}  // namespace tendril::app::testing
