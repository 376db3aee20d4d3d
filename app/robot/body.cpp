// SPDX-License-Identifier: Apache-2.0
#include "app/robot/body.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "fem/mesh/mesh_reader.h"

namespace tendril::app {
namespace {

using Names = std::map<std::string, std::vector<int>>;

/// The nodes, or the tetrahedra, of a region, at least one.
/// @param names  those that the mesh gives
/// @param in     what of the mesh lies in a space
/// @param kind   "node" or "tetrahedron"
std::vector<int> members(const Config& config, const RegionConfig& region, const std::string& key,
                         const Names& names, const auto& in, const char* kind) {
  if (const auto* space = std::get_if<fem::Space>(&region.where)) {
    std::vector<int> found = in(*space);
    if (found.empty())
      refuse(config, region.line,
             fmt::format("{}: found no {} of the mesh inside the {}", key, kind,
                         std::holds_alternative<fem::Box>(*space) ? "box" : "sphere"));
    return found;
  }
  const auto& name = std::get<std::string>(region.where);
  if (const auto found = names.find(name); found != names.end()) return found->second;
  std::vector<std::string> known;
  for (const auto& entry : names) known.push_back(entry.first);
  refuse(config, region.line,
         fmt::format("{}: found '{}', expected a {} of {}: {}", key, name,
                     kind[0] == 'n' ? "region" : "volume", config.mesh.file.filename().string(),
                     known.empty() ? "it has none; use a box or a sphere"
                                   : fmt::format("{}", fmt::join(known, ", "))));
}

/// For each tetrahedron its place among the materials.
std::vector<int> material_of_tets(const Config& config, const fem::Mesh& mesh) {
  const auto& regions = config.material.regions;
  std::vector<int> result(static_cast<size_t>(mesh.tet_count()), 0);
  const auto in = [&](const fem::Space& space) { return fem::tets_in(mesh, space); };
  for (size_t k = 0; k < regions.size(); ++k)
    for (const int tet : members(config, regions[k].where, fmt::format("material.regions[{}].where", k),
                                 mesh.volumes, in, "tetrahedron"))
      result[tet] = static_cast<int>(k) + 1;
  for (size_t k = 0; k < regions.size(); ++k)
    if (std::ranges::find(result, static_cast<int>(k) + 1) == result.end())
      refuse(config, regions[k].where.line,
             fmt::format("material.regions[{}].where: later regions cover all of it", k));
  return result;
}

}  // namespace

void refuse(const Config& config, int line, const std::string& what) {
  throw ConfigError(fmt::format("{}:{}: {}", config.file.string(), line, what));
}

BodyMaterials model_materials(const Config& config) {
  const MaterialConfig& m = config.material;
  BodyMaterials result{{m.material}, {m.mass, m.mass_per_node, {}}};
  for (const MaterialRegionConfig& region : m.regions) result.materials.push_back(region.material);
  if (std::ranges::any_of(m.regions, [](const auto& region) { return region.mass.has_value(); })) {
    result.mass.of_material = {std::nullopt};
    for (const MaterialRegionConfig& region : m.regions) result.mass.of_material.push_back(region.mass);
  }
  return result;
}

BodyMaterials plant_materials(const Config& config) {
  const PlantConfig& plant = *config.plant;
  BodyMaterials result = model_materials(config);
  const double stiffer = plant.young_modulus / config.material.material.young_modulus;
  const double heavier = plant.mass / config.material.mass;
  for (fem::Material& material : result.materials) material.young_modulus *= stiffer;
  result.materials[0].young_modulus = plant.young_modulus;
  result.materials[0].poisson_ratio = plant.poisson_ratio;
  for (auto& mass : result.mass.of_material)
    if (mass) *mass *= heavier;
  result.mass.total = plant.mass;
  return result;
}

fem::Mesh load_mesh(const Config& config) {
  fem::Mesh mesh;
  const auto refuse_mesh = [&](const std::string& what) {
    refuse(config, config.mesh.line, fmt::format("mesh.file: {}", what));
  };
  try {
    mesh = fem::read_mesh(config.mesh.file, config.mesh.unit);
  } catch (const fem::MeshError& error) {  // names the mesh file itself
    refuse_mesh(error.what());
  }
  mesh.nodes = (config.mesh.rotation * mesh.nodes).colwise() + config.mesh.translation;
  try {
    fem::check(mesh);
  } catch (const fem::MeshError& error) {
    refuse_mesh(fmt::format("{}: {}", config.mesh.file.string(), error.what()));
  }
  return mesh;
}

std::vector<int> nodes_of(const Config& config, const fem::Mesh& mesh, const RegionConfig& region,
                          const std::string& key) {
  const auto in = [&](const fem::Space& space) { return fem::nodes_in(mesh, space); };
  return members(config, region, key, mesh.regions, in, "node");
}

fem::Model build_body(const Config& config, const BodyMaterials& materials,
                      const std::vector<LoadConfig>& loads) {
  const fem::Mesh mesh = load_mesh(config);
  const auto fixed = nodes_of(config, mesh, config.fixed, "fixed");
  const auto of_tet = material_of_tets(config, mesh);
  try {
    fem::Model model(mesh, materials.materials, of_tet, materials.mass, fixed, config.gravity);
    for (const LoadConfig& load : loads)
      model.add_load(attach(model.mesh(), config, load.at, "loads"), load.force);
    return model;
  } catch (const fem::MeshError& error) {
    refuse(config, config.fixed.line, fmt::format("fixed: {}", error.what()));
  } catch (const std::invalid_argument& error) {
    throw ConfigError(fmt::format("{}: material: {}", config.file.string(), error.what()));
  }
}

fem::Attachment attach(const fem::Mesh& mesh, const Config& config, const PointConfig& point,
                       const std::string& key) {
  try {
    return fem::attach(mesh, point.at, config.snap);
  } catch (const fem::MeshError& error) {
    refuse(config, point.line,
           fmt::format("{}: {}; move it there or allow more with 'snap'", key, error.what()));
  }
}

std::vector<fem::Face> wall(const fem::Mesh& mesh, const Config& config, const RegionConfig& region,
                            const std::string& key) {
  const auto nodes = nodes_of(config, mesh, region, key);
  try {
    return fem::closed_surface(mesh, nodes);
  } catch (const fem::MeshError& error) {
    refuse(config, region.line, fmt::format("{}: {}", key, error.what()));
  }
}

}  // namespace tendril::app
