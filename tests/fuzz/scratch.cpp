// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/scratch.h"

#include <fstream>

#include "tests/own_folder.h"

namespace tendril::fuzz {

std::filesystem::path scratch_path(const std::string& name) {
  static const testing::OwnFolder folder;
  return folder / name;
}

std::filesystem::path scratch_file(const std::string& name, const std::string& bytes) {
  const std::filesystem::path path = scratch_path(name);
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

}  // namespace tendril::fuzz
