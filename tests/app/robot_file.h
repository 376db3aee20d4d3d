// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace tendril::app {

/// Pieces of a robot file, and what stands there instead.
using Changes = std::vector<std::pair<std::string, std::string>>;

/// A robot file in a folder of its own, beside a file that may pass for its mesh; gone with the object.
class RobotFile {
 public:
  explicit RobotFile(const std::string& yaml, const std::string& mesh = "body.msh");
  ~RobotFile();
  RobotFile(const RobotFile&) = delete;
  RobotFile& operator=(const RobotFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path folder() const { return path_.parent_path(); }

 private:
  std::filesystem::path path_;
};

/// @return the whole file
/// @throws std::runtime_error where there is none
std::string read_text_file(const std::filesystem::path& file);

}  // namespace tendril::app
