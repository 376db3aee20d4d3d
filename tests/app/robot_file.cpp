// SPDX-License-Identifier: Apache-2.0
#include "tests/app/robot_file.h"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace tendril::app {

namespace fs = std::filesystem;

RobotFile::RobotFile(const std::string& yaml, const std::string& mesh) {
  std::string folder = (fs::temp_directory_path() / "tendril-robot-XXXXXX").string();
  if (!mkdtemp(folder.data())) throw std::runtime_error("cannot make a folder like " + folder);
  path_ = fs::path(folder) / "robot.yaml";
  std::ofstream(path_, std::ios::binary) << yaml;
  std::ofstream(fs::path(folder) / mesh) << "not looked into\n";
}

RobotFile::~RobotFile() {
  std::error_code ignored;
  fs::remove_all(folder(), ignored);
}

std::string read_text_file(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace tendril::app
