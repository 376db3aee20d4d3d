#include "fem/mesh/mesh_reader.h"

#include <fmt/format.h>

#include <fstream>
#include <sstream>

#include "fem/mesh/mesh_formats.h"

namespace tendril::fem {

Mesh read_mesh(const std::filesystem::path& file, double unit) {
  static const std::map<std::string, Mesh (*)(const std::string&, const std::string&)> kReaders = {
      {".msh", read_gmsh}, {".vtu", read_vtu}, {".vtk", read_vtk_legacy}};
  const auto reader = kReaders.find(file.extension().string());
  if (reader == kReaders.end())
    throw MeshError(
        fmt::format("{}: mesh format '{}' is not known; expected .msh (Gmsh 4.1 ASCII), .vtu or .vtk",
                    file.string(), file.extension().string()));
  std::ifstream in(file, std::ios::binary);
  std::ostringstream buffer;
  if (!in || !(buffer << in.rdbuf())) throw MeshError(fmt::format("{}: cannot be read", file.string()));
  Mesh mesh = reader->second(buffer.str(), file.string());
  mesh.nodes *= unit;
  return mesh;
}

}  // namespace tendril::fem
