#include "fem/model.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace tendril::fem {
namespace {

constexpr int kNotANode = -1;

void check(const Material& material, const Mass& mass) {
  if (!(material.young_modulus > 0) || !std::isfinite(material.young_modulus))
    throw std::invalid_argument(
        fmt::format("Young's modulus is {} Pa, expected a positive number", material.young_modulus));
  if (!(material.poisson_ratio >= 0 && material.poisson_ratio < 0.5))
    throw std::invalid_argument(
        fmt::format("Poisson's ratio is {}, expected 0 <= nu < 0.5", material.poisson_ratio));
  if (!(mass.total > 0) || !std::isfinite(mass.total))
    throw std::invalid_argument(fmt::format("the mass is {} kg, expected a positive number", mass.total));
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
  Mesh result;
  result.nodes.resize(3, mesh.node_count());
  for (int i = 0; i < mesh.node_count(); ++i) result.nodes.col(numbering[i]) = mesh.nodes.col(i);
  for (auto tet : mesh.tets) {
    for (int& node : tet) node = numbering[node];
    result.tets.push_back(tet);
  }
  for (auto [name, region] : mesh.regions) {
    for (int& node : region) node = numbering[node];
    std::sort(region.begin(), region.end());
    result.regions[name] = region;
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

/// Part of the body that each node belongs to, named by one of its nodes: parts share no node.
std::vector<int> parts_of(const Mesh& mesh) {
  std::vector<int> parent(mesh.node_count());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int node) {
    while (parent[node] != node) node = parent[node] = parent[parent[node]];
    return node;
  };
  for (const auto& tet : mesh.tets)
    for (int node : tet) parent[root(node)] = root(tet[0]);
  for (int node = 0; node < mesh.node_count(); ++node) parent[node] = root(node);
  return parent;
}

/// Refuses a body of which some part is not held. A part that hangs on others by one node or one edge is not
/// found out here.
void check_held(const Mesh& mesh, int free_nodes) {
  const std::vector<int> parts = parts_of(mesh);
  const std::set<int> names(parts.begin(), parts.end());
  for (int part : names) {
    Eigen::Matrix3Xd fixed(3, 0);
    for (int node = free_nodes; node < mesh.node_count(); ++node)
      if (parts[node] == part) {
        fixed.conservativeResize(Eigen::NoChange, fixed.cols() + 1);
        fixed.rightCols<1>() = mesh.nodes.col(node);
      }
    if (held(fixed)) continue;
    const std::string where = names.size() == 1
                                  ? ""
                                  : fmt::format(
                                        " in the part of it around ({:.4g}, {:.4g}, {:.4g}) mm; merge nodes "
                                        "that coincide, for the mesh falls into {} parts",
                                        1e3 * mesh.nodes(0, part), 1e3 * mesh.nodes(1, part),
                                        1e3 * mesh.nodes(2, part), names.size());
    throw MeshError(fmt::format("{} nodes are fixed, expected at least three that do not lie on one line{}",
                                fixed.cols(), where));
  }
}

}  // namespace

Model::Model(const Mesh& mesh, const Material& material, const Mass& mass, const std::vector<int>& fixed,
             const Eigen::Vector3d& gravity)
    : material_(material) {
  fem::check(mesh);
  check(material, mass);
  numbering_ = free_nodes_first(mesh.node_count(), fixed, free_nodes_);
  mesh_ = renumbered(mesh, numbering_);
  check_held(mesh_, free_nodes_);
  if (free_nodes_ == 0) throw MeshError("all nodes are fixed, so nothing can move");

  rest_ = mesh_.nodes.leftCols(free_nodes_).reshaped();
  for (const auto& tet : mesh_.tets) elements_.push_back(rest_tetrahedron(mesh_.nodes(Eigen::all, tet)));
  lump_masses(mass, gravity);
}

void Model::lump_masses(const Mass& mass, const Eigen::Vector3d& gravity) {
  Eigen::VectorXd share = Eigen::VectorXd::Constant(mesh_.node_count(), 1.0 / mesh_.node_count());
  if (!mass.per_node) {
    share.setZero();
    for (int t = 0; t < mesh_.tet_count(); ++t)
      for (int node : mesh_.tets[t]) share[node] += elements_[t].volume / 4;
    share /= share.sum();
  }
  masses_.resize(unknowns());
  external_.resize(unknowns());
  for (int i = 0; i < free_nodes_; ++i) {
    masses_.segment<3>(3 * i).setConstant(mass.total * share[i]);
    external_.segment<3>(3 * i) = mass.total * share[i] * gravity;
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

Eigen::Matrix<double, 3, 4> Model::corners(const Eigen::VectorXd& x, int tet) const {
  Eigen::Matrix<double, 3, 4> p;
  for (int a = 0; a < 4; ++a) p.col(a) = position(x, mesh_.tets[tet][a]);
  return p;
}

double Model::energy(const Eigen::VectorXd& x) const {
  double sum = 0;
  for (int t = 0; t < mesh_.tet_count(); ++t)
    sum += CorotationalElement(elements_[t], material_, corners(x, t)).energy();
  return sum;
}

StiffnessMatrix Model::make_stiffness(const std::vector<std::vector<int>>& cliques) const {
  std::vector<std::vector<int>> all(cliques);
  for (const auto& tet : mesh_.tets) all.emplace_back(tet.begin(), tet.end());
  return {free_nodes_, all};
}

Model::Scatter Model::scatter(const StiffnessMatrix& K) const {
  Scatter slots(mesh_.tets.size());
  for (size_t t = 0; t < mesh_.tets.size(); ++t) {
    const auto& tet = mesh_.tets[t];
    int k = 0;
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b <= a; ++b, ++k)
        if (tet[a] < free_nodes_ && tet[b] < free_nodes_)
          slots[t][k] = K.slot(std::max(tet[a], tet[b]), std::min(tet[a], tet[b]));
  }
  return slots;
}

void Model::add_forces(const CorotationalElement& element, int tet, Eigen::VectorXd& f) const {
  const Eigen::Matrix<double, 3, 4> forces = element.forces();
  for (int a = 0; a < 4; ++a)
    if (const int node = mesh_.tets[tet][a]; node < free_nodes_) f.segment<3>(3 * node) += forces.col(a);
}

int Model::assemble(const Eigen::VectorXd& x, Tangent tangent, const Scatter& scatter, Eigen::VectorXd& f,
                    StiffnessMatrix& K) const {
  f.setZero(unknowns());
  K.set_zero();
  int inverted = 0;
  for (int t = 0; t < mesh_.tet_count(); ++t) {
    const CorotationalElement element(elements_[t], material_, corners(x, t));
    inverted += element.inverted();
    add_forces(element, t, f);
    const auto blocks = element.stiffness(tangent);
    const auto& tet = mesh_.tets[t];
    int k = 0;
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b <= a; ++b, ++k) {
        if (tet[a] >= free_nodes_ || tet[b] >= free_nodes_) continue;
        if (tet[a] >= tet[b])
          K.add(scatter[t][k], blocks[k]);
        else
          K.add(scatter[t][k], blocks[k].transpose());
      }
  }
  return inverted;
}

int Model::internal_forces(const Eigen::VectorXd& x, Eigen::VectorXd& f) const {
  f.setZero(unknowns());
  int inverted = 0;
  for (int t = 0; t < mesh_.tet_count(); ++t) {
    const CorotationalElement element(elements_[t], material_, corners(x, t));
    inverted += element.inverted();
    add_forces(element, t, f);
  }
  return inverted;
}

}  // namespace tendril::fem
