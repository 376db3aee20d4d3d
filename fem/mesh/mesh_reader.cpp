// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/mesh_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "fem/mesh/mesh_formats.h"

namespace tendril::fem {
namespace {

using Reader = Mesh (*)(const std::string& text, const std::string& file);

std::string in_small_letters(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// The reader that a file's first characters ask for; null where they tell nothing.
Reader reader_for(const std::string& text) {
  const std::string start = in_small_letters(text.substr(0, 200));
  const size_t first = start.find_first_not_of(" \t\r\n");
  if (first == start.npos) return nullptr;
  if (start[first] == '<') return read_vtu;
  if (start[first] == '$') return read_gmsh;
  return start.starts_with("# vtk datafile") ? read_vtk_legacy : nullptr;
}

/// The reader that goes with a file's ending.
Reader reader_for(const std::filesystem::path& file) {
  static const std::map<std::string, Reader> kReaders = {
      {".msh", read_gmsh}, {".vtu", read_vtu}, {".vtk", read_vtk_legacy}};
  const std::string ending = file.extension().string();
  const auto reader = kReaders.find(in_small_letters(ending));
  if (reader == kReaders.end())
    throw MeshError(
        fmt::format("{}: mesh format '{}' is not known; expected .msh (Gmsh 4.1 ASCII), .vtu or .vtk",
                    file.string(), ending));
  return reader->second;
}

}  // namespace

Mesh read_mesh(const std::filesystem::path& file, double unit) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream buffer;
  if (!in || !(buffer << in.rdbuf())) throw MeshError(fmt::format("{}: cannot be read", file.string()));
  std::string text = std::move(buffer).str();
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);  // the mark of UTF-8, which some editors write
  Reader reader = reader_for(text);
  if (reader == nullptr) reader = reader_for(file);
  Mesh mesh = reader(text, file.string());
  mesh.nodes *= unit;
  return mesh;
}

}  // namespace tendril::fem
