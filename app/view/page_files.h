// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace tendril::app {

/// A file of the page, as it is sent.
struct PageFile {
  const char* type;  ///< of its content, for the browser
  std::string content;
};

/// The files of the page by their path in a URL, such as "/main.js"; "/" is index.html.
/// @param folders  those that are not there have no files
/// @throws std::runtime_error where there is no index.html
/// Real-time: no.
std::map<std::string, PageFile> read_page(const std::vector<std::filesystem::path>& folders);

/// Where the page lies: what was installed with the program, else what the build has.
std::vector<std::filesystem::path> page_folders();

}  // namespace tendril::app
