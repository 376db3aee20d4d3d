// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "fem/mesh/mesh.h"

namespace tendril::fem {

/// Reads a tetrahedral mesh with its named regions and volumes. The first characters of the file say which
/// format it has, whatever its name ends in:
///
///   .msh  Gmsh 4.1 ASCII; each physical group is a region, one of solids a volume as well. A group without a
///         name is called after its tag: physical_3
///   .vtu  VTK XML unstructured grid: ASCII, or binary inline or appended, plain or packed with zlib; the
///         pieces of a grid are joined
///   .vtk  VTK legacy unstructured grid, versions 2 to 5.1, ASCII or binary
///
/// In VTK files each value of a cell array of whole numbers is a region and a volume, called after array and
/// value: `material_2`. Points, lines and faces count for regions only; a solid cell other than the linear
/// tetrahedron is refused, since leaving it out would leave a hole. Nodes that no tetrahedron uses are left
/// out, but for those in groups of Gmsh, which check() refuses. Coordinates are multiplied by `unit` (m per
/// length unit of the file). The mesh is not checked; see check().
/// @throws MeshError naming the file, the line or byte in it, what is found and what is expected
/// Real-time: no (reads a file).
Mesh read_mesh(const std::filesystem::path& file, double unit);

}  // namespace tendril::fem
