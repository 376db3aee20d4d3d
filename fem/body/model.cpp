// SPDX-License-Identifier: Apache-2.0
#include "fem/body/model.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "fem/mesh/connected_parts.h"
#include "fem/mesh/format_point.h"
#include "fem/mesh/hinges.h"

namespace tendril::fem {
namespace {

constexpr int kNotANode = -1;

/// How messages name a material: by its number where there are several.
std::string material_prefix(size_t material, size_t count) {
  return count == 1 ? "" : fmt::format("material {}: ", material);
}

void check(const std::vector<Material>& materials, const std::vector<int>& material_of_tet, int tets) {
  for (size_t m = 0; m < materials.size(); ++m) {
    const auto& [E, nu, law, dilatation] = materials[m];
    const std::string where = material_prefix(m, materials.size());
    if (!(E > 0) || !std::isfinite(E))
      throw std::invalid_argument(
          fmt::format("{}Young's modulus is {} Pa, expected a positive number", where, E));
    if (!(nu >= 0 && nu < 0.5))
      throw std::invalid_argument(fmt::format("{}Poisson's ratio is {}, expected 0 <= nu < 0.5", where, nu));
  }
  if (std::ssize(material_of_tet) != tets)
    throw std::invalid_argument(
        fmt::format("{} tetrahedra are given a material, the mesh has {}", material_of_tet.size(), tets));
  for (int t = 0; t < tets; ++t)
    if (material_of_tet[t] < 0 || material_of_tet[t] >= std::ssize(materials))
      throw std::invalid_argument(fmt::format("tetrahedron {} is of material {}, expected 0..{}", t,
                                              material_of_tet[t], std::ssize(materials) - 1));
}

/// New index of every node: the free ones first, each group in the mesh's order.
std::vector<int> free_nodes_first(int nodes, const std::vector<int>& fixed, int& free_nodes) {
  std::vector<char> is_fixed(nodes, 0);
  for (int node : fixed) {
    if (node < 0 || node >= nodes)
      throw MeshError(fmt::format("fixed node {} is outside 0..{}", node, nodes - 1));
    is_fixed[node] = 1;
  }
  free_nodes = static_cast<int>(std::count(is_fixed.begin(), is_fixed.end(), 0));
  std::vector<int> numbering(nodes, kNotANode);
  int next_free = 0, next_fixed = free_nodes;
  for (int i = 0; i < nodes; ++i) numbering[i] = is_fixed[i] ? next_fixed++ : next_free++;
  return numbering;
}

Mesh renumbered(const Mesh& mesh, const std::vector<int>& numbering) {
  Mesh result = mesh;
  for (int i = 0; i < mesh.node_count(); ++i) result.nodes.col(numbering[i]) = mesh.nodes.col(i);
  for (auto& tet : result.tets)
    for (int& node : tet) node = numbering[node];
  for (auto& [name, region] : result.regions) {
    for (int& node : region) node = numbering[node];
    std::sort(region.begin(), region.end());
  }
  return result;
}

/// A body is held when its fixed nodes span a plane: otherwise it can turn as a whole.
bool held(const Eigen::Ref<const Eigen::Matrix3Xd>& fixed) {
  if (fixed.cols() < 3) return false;
  const Eigen::Matrix3Xd spread = fixed.colwise() - fixed.rowwise().mean();
  const Eigen::Vector3d sizes =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread * spread.transpose()).eigenvalues();  // ascending
  return sizes[1] > 1e-12 * sizes[2];
}

/// Refuses a body of which some part is not held.
void check_held(const Mesh& mesh, int free_nodes) {
  const std::vector<int> parts = connected_parts(mesh.node_count(), mesh.tets);
  const std::set<int> names(parts.begin(), parts.end());
  for (int part : names) {
    std::vector<int> fixed;
    for (int node = free_nodes; node < mesh.node_count(); ++node)
      if (parts[node] == part) fixed.push_back(node);
    if (held(mesh.nodes(Eigen::all, fixed))) continue;
    const std::string where =
        names.size() == 1
            ? ""
            : fmt::format(
                  " in the part of it around {}; merge nodes that coincide, for the mesh falls into {} parts",
                  format_point_mm(mesh.nodes.col(part)), names.size());
    throw MeshError(fmt::format("{} nodes are fixed, expected at least three that do not lie on one line{}",
                                fixed.size(), where));
  }
  std::vector<int> fixed(mesh.node_count() - free_nodes);
  std::iota(fixed.begin(), fixed.end(), free_nodes);
  check_hinges(mesh, fixed);
}

/// The part of the body that weighs together with each material: 0 for all whose mass is not given.
/// @throws std::invalid_argument for a mass that cannot be
std::vector<int> parts(const Mass& mass, size_t materials) {
  if (!(mass.total > 0) || !std::isfinite(mass.total))
    throw std::invalid_argument(fmt::format("the mass is {} kg, expected a positive number", mass.total));
  if (!mass.of_material.empty() && mass.of_material.size() != materials)
    throw std::invalid_argument(
        fmt::format("masses are listed for {} materials, there are {}", mass.of_material.size(), materials));
  std::vector<int> part(materials, 0);
  int next = 1;
  for (size_t m = 0; m < mass.of_material.size(); ++m) {
    if (!mass.of_material[m]) continue;
    const double given = *mass.of_material[m];
    if (!(given > 0) || !std::isfinite(given))
      throw std::invalid_argument(fmt::format("{}the mass is {} kg, expected a positive number",
                                              material_prefix(m, materials), given));
    part[m] = next++;
  }
  return part;
}

/// Mass of every part, kg; the first one has what the others leave.
/// @throws std::invalid_argument if that is not what the tetrahedra of the parts can have
std::vector<double> masses_of_parts(const Mass& mass, const std::vector<int>& part_of_tet) {
  std::vector<double> masses{mass.total};
  for (size_t m = 0; m < mass.of_material.size(); ++m) {
    if (!mass.of_material[m]) continue;
    masses.push_back(*mass.of_material[m]);
    masses[0] -= masses.back();
    if (std::count(part_of_tet.begin(), part_of_tet.end(), std::ssize(masses) - 1) == 0)
      throw std::invalid_argument(
          fmt::format("{}it has a mass but no tetrahedron", material_prefix(m, mass.of_material.size())));
  }
  const bool rest = std::count(part_of_tet.begin(), part_of_tet.end(), 0) > 0;
  const double rounding = 1e-9 * mass.total;
  if (rest ? masses[0] <= 0 : std::abs(masses[0]) > rounding)
    throw std::invalid_argument(
        fmt::format("the materials whose mass is given weigh {} kg together, expected {} {} kg",
                    mass.total - masses[0], rest ? "less than" : "the body's", mass.total));
  if (!rest) masses[0] = 0;
  return masses;
}

}  // namespace

Model::Model(const Mesh& mesh, const Material& material, const Mass& mass, const std::vector<int>& fixed,
             const Eigen::Vector3d& gravity)
    : Model(mesh, {material}, std::vector<int>(mesh.tets.size(), 0), mass, fixed, gravity) {}

Model::Model(const Mesh& mesh, std::vector<Material> materials, std::vector<int> material_of_tet,
             const Mass& mass, const std::vector<int>& fixed, const Eigen::Vector3d& gravity)
    : materials_(std::move(materials)), material_of_tet_(std::move(material_of_tet)) {
  fem::check(mesh);
  check(materials_, material_of_tet_, mesh.tet_count());
  numbering_ = free_nodes_first(mesh.node_count(), fixed, free_nodes_);
  mesh_ = renumbered(mesh, numbering_);
  check_held(mesh_, free_nodes_);
  if (free_nodes_ == 0) throw MeshError("all nodes are fixed, so nothing can move");

  rest_ = mesh_.nodes.leftCols(free_nodes_).reshaped();
  for (const auto& tet : mesh_.tets) tetrahedra_.push_back(rest_tetrahedron(mesh_.nodes(Eigen::all, tet)));
  lump_masses(mass, gravity);

  std::vector<int> group(material_of_tet_);
  for (int& m : group)
    if (materials_[m].dilatation == Dilatation::kElement) m = kNoPatch;
  patches_ = make_patches(mesh_, group);
  patch_of_tet_.assign(mesh_.tets.size(), kNoPatch);
  for (size_t p = 0; p < patches_.size(); ++p)
    for (int tet : patches_[p].tets) patch_of_tet_[tet] = static_cast<int>(p);
}

void Model::lump_masses(const Mass& mass, const Eigen::Vector3d& gravity) {
  const std::vector<int> part_of_material = parts(mass, materials_.size());
  std::vector<int> part_of_tet;
  for (int m : material_of_tet_) part_of_tet.push_back(part_of_material[m]);
  const std::vector<double> part_masses = masses_of_parts(mass, part_of_tet);

  Eigen::VectorXd node_masses = Eigen::VectorXd::Zero(mesh_.node_count());
  for (size_t part = 0; part < part_masses.size(); ++part) {
    Eigen::VectorXd share = Eigen::VectorXd::Zero(mesh_.node_count());
    for (int t = 0; t < mesh_.tet_count(); ++t)
      for (int node : mesh_.tets[t])
        if (part_of_tet[t] == static_cast<int>(part)) {
          if (mass.per_node)
            share[node] = 1;
          else
            share[node] += tetrahedra_[t].volume;
        }
    if (part_masses[part] > 0) node_masses += part_masses[part] / share.sum() * share;
  }
  masses_.resize(unknowns());
  external_.resize(unknowns());
  for (int i = 0; i < free_nodes_; ++i) {
    masses_.segment<3>(3 * i).setConstant(node_masses[i]);
    external_.segment<3>(3 * i) = node_masses[i] * gravity;
  }
}

void Model::add_load(const Attachment& at, const Eigen::Vector3d& force) {
  for (int k = 0; k < 4; ++k)
    if (at.nodes[k] < free_nodes_) external_.segment<3>(3 * at.nodes[k]) += at.weights[k] * force;
}

Eigen::Vector3d Model::position(const Eigen::VectorXd& x, int node) const {
  if (node < free_nodes_) return x.segment<3>(3 * node);
  return mesh_.nodes.col(node);
}

Eigen::Vector3d Model::position(const Eigen::VectorXd& x, const Attachment& at) const {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (int k = 0; k < 4; ++k) p += at.weights[k] * position(x, at.nodes[k]);
  return p;
}

Moduli Model::moduli(int tet) const {
  const Material& material = materials_[material_of_tet_[tet]];
  const bool alone = material.dilatation == Dilatation::kElement;
  return {material.lame_mu(), alone ? material.lame_lambda() : 0};
}

Element Model::element(const Eigen::VectorXd& x, int tet) const {
  Corners corners;
  for (int a = 0; a < 4; ++a) corners.col(a) = position(x, mesh_.tets[tet][a]);
  return law(tet).element(tetrahedra_[tet], moduli(tet), corners);
}

std::vector<double> Model::patch_dilatations(const Eigen::VectorXd& x) const {
  std::vector<double> mean(patches_.size(), 0.0);
  for (size_t p = 0; p < patches_.size(); ++p)
    for (int t : patches_[p].tets)
      mean[p] += tetrahedra_[t].volume / patches_[p].volume *
                 std::visit([](const auto& e) { return e.dilatation(); }, element(x, t));
  return mean;
}

double Model::energy(const Eigen::VectorXd& x) const {
  double sum = 0;
  for (int t = 0; t < mesh_.tet_count(); ++t)
    sum += std::visit([](const auto& e) { return e.energy(); }, element(x, t));
  const std::vector<double> theta = patch_dilatations(x);
  for (size_t p = 0; p < patches_.size(); ++p)
    sum += 0.5 * patch_modulus(p) * patches_[p].volume * theta[p] * theta[p];
  return sum;
}

int Model::internal_forces(const Eigen::VectorXd& x, Eigen::VectorXd& f) const {
  f.setZero(unknowns());
  const std::vector<double> theta = patch_dilatations(x);
  int inverted = 0;
  for (int t = 0; t < mesh_.tet_count(); ++t) {
    const int p = patch_of_tet_[t];
    const double pressure = p == kNoPatch ? 0 : patch_modulus(p) * theta[p];
    const Element element = this->element(x, t);
    inverted += std::visit([](const auto& e) { return e.inverted(); }, element);
    const Corners forces = std::visit([&](const auto& e) { return e.forces(pressure); }, element);
    for (int a = 0; a < 4; ++a)
      if (const int node = mesh_.tets[t][a]; node < free_nodes_) f.segment<3>(3 * node) += forces.col(a);
  }
  return inverted;
}

StiffnessMatrix Model::make_stiffness(const std::vector<std::vector<int>>& cliques) const {
  std::vector<std::vector<int>> all(cliques);
  for (const auto& tet : mesh_.tets) all.emplace_back(tet.begin(), tet.end());
  for (const Patch& patch : patches_) all.push_back(patch.nodes);
  return {free_nodes_, all};
}

}  // namespace tendril::fem
