// SPDX-License-Identifier: Apache-2.0
#include "app/view/page_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <fstream>
#include <iterator>
#include <stdexcept>

namespace tendril::app {
namespace {

/// nullptr: no file of a page.
const char* type_of(const std::filesystem::path& file) {
  if (file.extension() == ".html") return "text/html; charset=utf-8";
  if (file.extension() == ".css") return "text/css; charset=utf-8";
  if (file.extension() == ".js") return "text/javascript; charset=utf-8";
  if (file.extension() == ".svg") return "image/svg+xml";
  return nullptr;
}

}  // namespace

std::map<std::string, PageFile> read_page(const std::vector<std::filesystem::path>& folders) {
  std::map<std::string, PageFile> files;
  for (const auto& folder : folders) {
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
      const char* type = type_of(entry.path());
      if (!type) continue;
      std::ifstream input(entry.path(), std::ios::binary);
      files[fmt::format("/{}", entry.path().filename().string())] = {
          type, {std::istreambuf_iterator<char>(input), {}}};
    }
  }
  const auto index = files.find("/index.html");
  if (index == files.end()) {
    std::vector<std::string> names;
    for (const auto& folder : folders) names.push_back(folder.string());
    throw std::runtime_error(
        fmt::format("there is no index.html in {}; install Tendril again", fmt::join(names, " and ")));
  }
  files["/"] = index->second;
  return files;
}

std::vector<std::filesystem::path> page_folders() {
  std::error_code untold;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", untold);
  const auto installed = program.parent_path().parent_path() / TENDRIL_INSTALLED_PAGE;
  if (std::filesystem::exists(installed / "index.html", untold)) return {installed};
  return {TENDRIL_PAGE, TENDRIL_THREE};
}

}  // namespace tendril::app
