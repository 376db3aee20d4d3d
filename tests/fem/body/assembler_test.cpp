// SPDX-License-Identifier: Apache-2.0
#include "fem/body/assembler.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "rt/heap_guard.h"
#include "tests/fem/body/bodies.h"

namespace tendril::fem::assembler_test {

using testing::beam;
using testing::random_vector;

struct Assembled {
  int inverted;
  Eigen::VectorXd f;
  Eigen::MatrixXd K;
};

/// Element by element, from what the model says of each.
Assembled reference(const Model& model, const Eigen::VectorXd& x, Tangent tangent) {
  const auto& patches = model.patches();
  const int n = 3 * model.mesh().node_count();
  std::vector<double> pressures(patches.size(), 0.0);
  std::vector<Eigen::VectorXd> growth(patches.size(), Eigen::VectorXd::Zero(n));
  const auto add = [](Eigen::VectorXd& to, const std::array<int, 4>& tet, const Corners& by_corner) {
    for (int a = 0; a < 4; ++a) to.segment<3>(3 * tet[a]) += by_corner.col(a);
  };
  for (size_t p = 0; p < patches.size(); ++p)
    for (int t : patches[p].tets)
      std::visit(
          [&](const auto& element) {
            const double volume = model.tetrahedra()[t].volume;
            pressures[p] += model.patch_modulus(p) * volume / patches[p].volume * element.dilatation();
            add(growth[p], model.mesh().tets[t], volume * element.dilatation_gradient());
          },
          model.element(x, t));

  Assembled sum{0, Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n)};
  for (int t = 0; t < model.mesh().tet_count(); ++t) {
    const auto& tet = model.mesh().tets[t];
    const double pressure = model.patch_of(t) == kNoPatch ? 0 : pressures[model.patch_of(t)];
    std::visit(
        [&](const auto& element) {
          sum.inverted += element.inverted();
          add(sum.f, tet, element.forces(pressure));
          const Blocks blocks = element.stiffness(tangent, pressure);
          for (int a = 0, k = 0; a < 4; ++a)
            for (int b = 0; b <= a; ++b, ++k) {
              sum.K.block<3, 3>(3 * tet[a], 3 * tet[b]) += blocks[k];
              if (a != b) sum.K.block<3, 3>(3 * tet[b], 3 * tet[a]) += blocks[k].transpose();
            }
        },
        model.element(x, t));
  }
  for (size_t p = 0; p < patches.size(); ++p)
    sum.K += model.patch_modulus(p) / patches[p].volume * growth[p] * growth[p].transpose();
  const int free = model.unknowns();
  return {sum.inverted, sum.f.head(free), sum.K.topLeftCorner(free, free)};
}

/// A piece of each law along the beam, then one of the first law again. No piece fills a whole number of
/// batches.
Model mixed_model(Dilatation dilatation) {
  const Mesh mesh = beam(5, 3, 2, 0.01);
  std::vector<Material> materials;
  for (const Law law : kLaws)
    materials.push_back({materials.size() % 2 == 0 ? 150e3 : 90e3, 0.45, law, dilatation});
  materials.front().dilatation = Dilatation::kElement;
  materials.push_back({200e3, 0.3, kLaws.front(), dilatation});
  const int last = static_cast<int>(materials.size()) - 1, piece = mesh.tet_count() / (last + 1) + 1;
  std::vector<int> material_of_tet;
  for (int t = 0; t < mesh.tet_count(); ++t) material_of_tet.push_back(std::min(t / piece, last));
  return {mesh, materials, material_of_tet, Mass{0.1}, mesh.regions.at("base"), Eigen::Vector3d::Zero()};
}

/// kScalar: a law without kernels is assembled element by element.
std::vector<InstructionSet> sets_of_this_machine() {
  std::vector<InstructionSet> all{InstructionSet::kScalar, InstructionSet::kV3};
  if (best_instruction_set() != InstructionSet::kV3) all.push_back(best_instruction_set());
  return all;
}

void check_same(const Assembled& found, const Assembled& expected) {
  CHECK(found.inverted == expected.inverted);
  const double strained_by_one = 150e3 * 0.01 * 0.01;  // N
  CHECK((found.f - expected.f).norm() < 1e-12 * std::max(expected.f.norm(), strained_by_one));
  CHECK((found.K - expected.K).norm() < 1e-12 * expected.K.norm());
}

TEST_CASE("Batches of elements give the forces and stiffness of the elements", "[law]") {
  const unsigned seed = GENERATE(1u, 2u);
  const Tangent tangent = GENERATE(Tangent::kExact, Tangent::kSemidefinite);
  const Dilatation dilatation = GENERATE(Dilatation::kElement, Dilatation::kPatch);
  CAPTURE(seed);
  const Model model = mixed_model(dilatation);
  for (const InstructionSet set : sets_of_this_machine()) {
    CAPTURE(static_cast<int>(set));
    std::mt19937 random(seed);
    Assembled found;
    StiffnessMatrix K = model.make_stiffness({});
    Assembler assembler(model, K, set);
    // Small moves, then a turn of the whole by more than a right angle, then elements inside out and back.
    Eigen::VectorXd x = model.rest();
    for (const double amplitude : {0.0, 5e-4, 5e-4, 1.0, 5e-4, 8e-3, 5e-4}) {
      if (amplitude == 1.0) {
        const Eigen::Matrix3d R =
            Eigen::AngleAxisd(2.4, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
        x = (R * x.reshaped(3, model.free_nodes())).reshaped().eval();
      } else {
        x = model.rest() + random_vector(random, model.unknowns(), amplitude);
      }
      found.inverted = assembler.assemble(x, tangent, found.f, K);
      found.K = K.dense();
      check_same(found, reference(model, x, tangent));
    }
  }
}

TEST_CASE("Assembling allocates nothing once it has begun", "[law]") {
  if (!rt::HeapGuard::available()) {
    WARN("skipped: heap calls are not counted in this build");
    return;
  }
  std::mt19937 random(3);
  const Model model = mixed_model(Dilatation::kPatch);
  StiffnessMatrix K = model.make_stiffness({});
  Assembler assembler(model, K);
  Eigen::VectorXd f(model.unknowns());
  for (const double amplitude : {5e-4, 8e-3}) {  // the larger one turns elements inside out
    const Eigen::VectorXd x = model.rest() + random_vector(random, model.unknowns(), amplitude);
    const rt::HeapGuard heap;
    for (const Tangent tangent : {Tangent::kExact, Tangent::kSemidefinite})
      assembler.assemble(x, tangent, f, K);
    CHECK(heap.calls() == 0);
  }
}

}  // namespace tendril::fem::assembler_test
