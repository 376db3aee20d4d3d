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

/// The mesh, placed, fixed and loaded as the file says.
/// @param loads  beside gravity
/// @throws ConfigError with the line of what does not fit the mesh
fem::Model build_body(const Config& config, const BodyMaterials& materials,
                      const std::vector<LoadConfig>& loads);

/// Attaches a point to a body.
/// @param key  of the point, for the message
/// @throws ConfigError where it is too far outside
fem::Attachment attach(const fem::Model& model, const Config& config, const PointConfig& point,
                       const std::string& key);

/// The wall of a cavity.
/// @param key  of the region, for the message
/// @throws ConfigError where the region is none, or its wall is not closed
std::vector<fem::Face> wall(const fem::Model& model, const Config& config, const RegionConfig& region,
                            const std::string& key);

}  // namespace tendril::app
