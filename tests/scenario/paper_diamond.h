#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "app/config.h"

namespace tendril::app::testing {

/// paper_diamond.yaml, the robot of Largilliere et al. (2015), with its mesh where it is.
/// @param data  folder of diamond.vtu
inline Config paper_diamond(const std::filesystem::path& data) {
  std::ifstream in(std::filesystem::path(TENDRIL_SOURCE_DIR) / "tests/scenario/paper_diamond.yaml");
  std::string text(std::istreambuf_iterator<char>(in), {});
  const std::string key = "../../../shared/data/diamond/diamond.vtu";
  text.replace(text.find(key), key.size(), (data / "diamond.vtu").string());
  const auto file =
      std::filesystem::temp_directory_path() / ("tendril-paper-diamond-" + std::to_string(getpid()));
  std::ofstream(file) << text;
  const Config config = load_config(file);
  std::filesystem::remove(file);
  return config;
}

}  // namespace tendril::app::testing
