// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "fem/mesh/vtk_grid.h"

namespace tendril::fem {

/// The grid that is stored in pieces. Points of different pieces at one position are one point, since each
/// piece lists those on its border.
/// @param pieces  at least one
/// @param file    for errors
/// @throws MeshError if a piece names a point that it has not, or lacks an array that others have
VtkGrid joined(std::vector<VtkGrid> pieces, const std::string& file);

}  // namespace tendril::fem
