#pragma once

#include <filesystem>

#include "fem/mesh.h"

namespace tendril::fem {

/// Reads a tetrahedral mesh and its named regions: Gmsh `.msh` 4.1 ASCII (physical groups become regions) or
/// VTK `.vtu` with ASCII arrays (no regions). Elements other than linear tetrahedra count for regions only.
/// Coordinates are multiplied by `unit` (m per length unit of the file). The mesh is not checked; see
/// check().
/// @throws MeshError naming the file, the place in it and what was expected
/// Real-time: no (reads a file).
Mesh read_mesh(const std::filesystem::path& file, double unit);

}  // namespace tendril::fem
