#pragma once

#include <string>
#include <string_view>

#include "fem/mesh/mesh_formats.h"

namespace tendril::fem::fuzz {

/// Reads a mesh file and checks the mesh.
/// @param format  "msh", "vtu" or "vtk"
/// @return        whether it was taken; false where it was refused with a MeshError
inline bool read_or_refuse(std::string_view format, const std::string& text) {
  try {
    check(format == "msh"   ? read_gmsh(text, "fuzzed")
          : format == "vtu" ? read_vtu(text, "fuzzed")
                            : read_vtk_legacy(text, "fuzzed"));
    return true;
  } catch (const MeshError&) {
    return false;
  }
}

}  // namespace tendril::fem::fuzz
