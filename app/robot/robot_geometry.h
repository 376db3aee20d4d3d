// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/config/config.h"
#include "fem/mesh/mesh.h"

namespace tendril::app {

/// What a robot file describes, as a JSON document for whoever draws it: lengths in mm, in the robot's frame
/// and the shape of the mesh. Needs no model, so it is there where none can be built.
///
/// | key | content |
/// | --- | --- |
/// | robot | its name |
/// | nodes, size_mm | of the mesh: their number, and its extent along x, y, z |
/// | surface | nodes_mm; faces, three places in nodes_mm each, counter-clockwise from outside the body |
/// | fixed_mm | the fixed nodes |
/// | actuators | name, kind (cable, rod, push, cavity); points, direction of a push, faces of a cavity |
/// | same | effort_limits, N or Pa; displacement_limits, m or m³ |
/// | effectors | name, points or faces; coordinates, such as "xz" |
/// | loads | point, force_N |
/// | workspace_mm | two corners; null where the file has none |
/// | motion | effector, origin_mm, waypoints_mm from the frame's origin, closed; or null |
/// | gravity_m_per_s2 | three numbers |
/// | problems | what does not fit the mesh, a sentence each, with file, line and key |
///
/// A point has at_mm, where it is attached, and on_body. One that cannot be attached stays where the file has
/// it, and has misplaced: true. A region that does not fit has no faces.
/// @param mesh  the robot's, in any numbering
/// Real-time: no (searches the mesh, allocates).
std::string robot_geometry(const Config& config, const fem::Mesh& mesh);

}  // namespace tendril::app
