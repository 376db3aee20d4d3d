#include "tests/validation/statics.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "fem/equilibrium.h"
#include "tests/fem/bodies.h"

namespace tendril::validation {

using Eigen::Vector3d;
using Eigen::VectorXd;

std::vector<NamedMaterial> laws(double young_modulus, double poisson_ratio) {
  return {{"corotational", {young_modulus, poisson_ratio}}};
}

fem::Attachment at_node(const fem::Model& model, int node) {
  const int n = model.numbering()[node];
  return {{n, n, n, n}, {1, 0, 0, 0}};
}

Vector3d displacement(const fem::Model& model, const VectorXd& x, int node) {
  const int n = model.numbering()[node];
  return model.position(x, n) - model.mesh().nodes.col(n);
}

VectorXd settle(fem::Model& model, const VectorXd& start, const std::vector<NodalLoad>& loads, int steps) {
  constexpr double kTolerance = 1e-9;  // of the body's size
  const fem::Constraints none(model, {}, {});
  fem::Equilibrium body(model, none);
  body.set_x(start);
  const auto& nodes = model.mesh().nodes;
  const double size = (nodes.rowwise().maxCoeff() - nodes.rowwise().minCoeff()).norm();
  for (int step = 1; step <= steps; ++step) {
    for (const auto& load : loads) model.add_load(at_node(model, load.node), load.force / steps);
    const fem::Settled settled = body.settle_under_efforts(VectorXd(), kTolerance * size);
    if (!settled.converged)
      throw std::runtime_error(fmt::format("a body of {} nodes did not come to rest under load step {} of {}",
                                           model.mesh().node_count(), step, steps));
  }
  return body.x();
}

Eigen::SparseMatrix<double> stiffness_at_rest(const fem::Model& model) {
  fem::StiffnessMatrix blocks = model.make_stiffness({});
  VectorXd f;
  model.assemble(model.rest(), fem::Tangent::kExact, model.scatter(blocks), f, blocks);
  std::vector<Eigen::Triplet<double>> entries;
  for (int column = 0; column < blocks.nodes(); ++column)
    for (int slot = blocks.column_starts()[column]; slot < blocks.column_starts()[column + 1]; ++slot)
      for (int k = 0; k < 9; ++k) {
        const int i = 3 * blocks.rows()[slot] + k % 3, j = 3 * column + k / 3;
        entries.emplace_back(i, j, blocks.block(slot)[k]);
        if (blocks.rows()[slot] != column) entries.emplace_back(j, i, blocks.block(slot)[k]);
      }
  Eigen::SparseMatrix<double> K(blocks.size(), blocks.size());
  K.setFromTriplets(entries.begin(), entries.end());
  return K;
}

fem::Mesh Beam::mesh() const {
  fem::Mesh mesh = fem::testing::beam(cells_along, cells_wide, cells_high, 1);
  const Vector3d cell(length / cells_along, width / cells_wide, height / cells_high);
  mesh.nodes = cell.asDiagonal() * mesh.nodes;
  return mesh;
}

std::vector<int> Beam::clamped() const { return mesh().regions.at("base"); }

std::vector<std::pair<int, double>> Beam::end_face() const {
  std::vector<std::pair<int, double>> shares;
  const auto share = [](int i, int cells) { return (i == 0 || i == cells ? 0.5 : 1.0) / cells; };
  for (int j = 0; j <= cells_wide; ++j)
    for (int k = 0; k <= cells_high; ++k)
      shares.emplace_back(node(cells_along, j, k), share(j, cells_wide) * share(k, cells_high));
  return shares;
}

std::vector<NodalLoad> Beam::end_load(const Vector3d& force) const {
  std::vector<NodalLoad> loads;
  for (const auto& [node, share] : end_face()) loads.push_back({node, share * force});
  return loads;
}

Vector3d Beam::end_displacement(const fem::Model& model, const VectorXd& x) const {
  Vector3d mean = Vector3d::Zero();
  for (const auto& [node, share] : end_face()) mean += share * displacement(model, x, node);
  return mean;
}

}  // namespace tendril::validation
