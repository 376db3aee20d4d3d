// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "fem/mesh/mesh.h"

// The readers behind read_mesh(), one source file each. They take the text of a file and its name for errors,
// and leave coordinates in the file's unit.

namespace tendril::fem {

Mesh read_gmsh(const std::string& text, const std::string& file);        ///< .msh
Mesh read_vtu(const std::string& text, const std::string& file);         ///< .vtu
Mesh read_vtk_legacy(const std::string& text, const std::string& file);  ///< .vtk

}  // namespace tendril::fem
