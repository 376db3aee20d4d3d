#include "fem/assembler.h"

namespace tendril::fem {

Assembler::Assembler(const Model& model, const StiffnessMatrix&) : model_(model) {}

int Assembler::assemble(const Eigen::VectorXd& x, Tangent tangent, Eigen::VectorXd& f, StiffnessMatrix& K) {
  const int inverted = model_.internal_forces(x, f);
  const int N = model_.free_nodes();
  K.set_zero();
  const auto& patches = model_.patches();
  std::vector<double> pressures(patches.size(), 0.0);
  std::vector<Eigen::VectorXd> growth(patches.size(), Eigen::VectorXd::Zero(3 * model_.mesh().node_count()));
  for (int t = 0; t < model_.mesh().tet_count(); ++t)
    if (const int p = model_.patch_of(t); p != kNoPatch) {
      const Element element = model_.element(x, t);
      pressures[p] += model_.patch_modulus(p) * model_.tetrahedra()[t].volume / patches[p].volume *
                      std::visit([](const auto& e) { return e.dilatation(); }, element);
      const Corners h = std::visit([](const auto& e) { return e.dilatation_gradient(); }, element);
      for (int a = 0; a < 4; ++a)
        growth[p].segment<3>(3 * model_.mesh().tets[t][a]) += model_.tetrahedra()[t].volume * h.col(a);
    }
  for (int t = 0; t < model_.mesh().tet_count(); ++t) {
    const int p = model_.patch_of(t);
    const double pressure = p == kNoPatch ? 0 : pressures[p];
    const Blocks blocks =
        std::visit([&](const auto& e) { return e.stiffness(tangent, pressure); }, model_.element(x, t));
    const auto& tet = model_.mesh().tets[t];
    for (int a = 0, k = 0; a < 4; ++a)
      for (int b = 0; b <= a; ++b, ++k) {
        if (tet[a] >= N || tet[b] >= N) continue;
        if (tet[a] >= tet[b])
          K.add(K.slot(tet[a], tet[b]), blocks[k]);
        else
          K.add(K.slot(tet[b], tet[a]), blocks[k].transpose());
      }
  }
  for (size_t p = 0; p < patches.size(); ++p)
    for (int i : patches[p].nodes)
      for (int j : patches[p].nodes)
        if (j <= i && i < N)
          K.add(K.slot(i, j), model_.patch_modulus(p) / patches[p].volume * growth[p].segment<3>(3 * i) *
                                  growth[p].segment<3>(3 * j).transpose());
  return inverted;
}

}  // namespace tendril::fem
