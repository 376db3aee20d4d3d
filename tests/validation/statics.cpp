// SPDX-License-Identifier: Apache-2.0
#include "tests/validation/statics.h"

#include <fmt/format.h>

#include <stdexcept>

#include "fem/body/assembler.h"
#include "fem/body/equilibrium.h"

namespace tendril::validation {

using Eigen::Vector3d;
using Eigen::VectorXd;

std::vector<NamedMaterial> laws(double young_modulus, double poisson_ratio) {
  return {{"corotational", {young_modulus, poisson_ratio, fem::Law::of<fem::CorotationalElement>()}},
          {"Neo-Hookean", {young_modulus, poisson_ratio, fem::Law::of<fem::NeoHookeanElement>()}}};
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
    const fem::EquilibriumResult settled = body.settle_under_efforts(VectorXd(), kTolerance * size);
    if (!settled.converged)
      throw std::runtime_error(fmt::format("a body of {} nodes did not come to rest under load step {} of {}",
                                           model.mesh().node_count(), step, steps));
  }
  return body.x();
}

Eigen::SparseMatrix<double> stiffness_at_rest(const fem::Model& model) {
  fem::StiffnessMatrix blocks = model.make_stiffness({});
  VectorXd f;
  fem::Assembler(model, blocks).assemble(model.rest(), fem::Tangent::kExact, f, blocks);
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

}  // namespace tendril::validation
