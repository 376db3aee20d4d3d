// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "app/config/config.h"
#include "fem/body/attachment.h"
#include "fem/body/model.h"
#include "fem/mesh/surface.h"

// From a robot file to a body that actuators and effectors can be attached to. Real-time: no, all of it.
namespace tendril::app {

/// Throws a ConfigError "FILE:LINE: WHAT".
[[noreturn]] void refuse(const Config& config, int line, const std::string& what);

/// The materials of a body: that of the whole first, then that of each of the file's regions.
struct BodyMaterials {
  std::vector<fem::Material> materials;
  fem::Mass mass;
};
BodyMaterials model_materials(const Config& config);
/// Those of the simulated robot; the file has the section `plant`.
BodyMaterials plant_materials(const Config& config);

/// The mesh in the robot's frame.
/// @throws ConfigError with the line of `mesh`, where it cannot be read or no model can be built on it
fem::Mesh load_mesh(const Config& config);

/// The mesh, placed, fixed and loaded as the file says.
/// @param loads  beside gravity
/// @throws ConfigError with the line of what does not fit the mesh
fem::Model build_body(const Config& config, const BodyMaterials& materials,
                      const std::vector<LoadConfig>& loads);

/// The nodes of a region, at least one.
/// @param key  of the region, for the message
/// @throws ConfigError where there is none
std::vector<int> nodes_of(const Config& config, const fem::Mesh& mesh, const RegionConfig& region,
                          const std::string& key);

/// Attaches a point to a body.
/// @param key  of the point, for the message
/// @throws ConfigError where it is too far outside
fem::Attachment attach(const fem::Mesh& mesh, const Config& config, const PointConfig& point,
                       const std::string& key);

/// The wall of a cavity.
/// @param key  of the region, for the message
/// @throws ConfigError where the region is none, or its wall is not closed
std::vector<fem::Face> wall(const fem::Mesh& mesh, const Config& config, const RegionConfig& region,
                            const std::string& key);

}  // namespace tendril::app
