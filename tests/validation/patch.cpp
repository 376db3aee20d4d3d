// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <random>

#include "fem/body/assembler.h"
#include "tests/fem/body/bodies.h"
#include "tests/validation/cases.h"
#include "tests/validation/statics.h"

// What every element must do whatever its shape: carry a uniform deformation exactly, resist no rigid motion
// however large, and have forces that derive from an energy.

namespace tendril::validation {
namespace {

constexpr double kPatchError = 1e-6;       // of the largest displacement
constexpr double kInnerForce = 1e-11;      // of the largest force on the surface
constexpr double kZeroEigenvalue = 1e-10;  // of the largest
constexpr double kRigidForce = 1e-11;      // of E times the squared cell
constexpr double kTangentError = 1e-6;     // of the tangent's answer

constexpr double kPatchYoung = 150e3, kPatchPoisson = 0.45, kCell = 0.01;
constexpr int kAlong = 5, kAcross = 3;
constexpr unsigned kSeed = 7;

/// A block whose inner nodes were moved at random, so that no two elements are alike.
fem::Mesh irregular_block(std::vector<char>* inner) {
  fem::Mesh mesh = fem::testing::beam(kAlong, kAcross, kAcross, kCell);
  std::mt19937 random(kSeed);
  const Eigen::Vector3d far = mesh.nodes.rowwise().maxCoeff();
  for (int i = 0; i < mesh.node_count(); ++i) {
    const Eigen::Vector3d p = mesh.nodes.col(i);
    inner->push_back((p.array() > 1e-6).all() && (p.array() < far.array() - 1e-6).all());
    if (inner->back()) mesh.nodes.col(i) += fem::testing::random_vector(random, 3, 0.2 * kCell);
  }
  return mesh;
}

/// Internal forces as the running model computes them, 3N, N.
Eigen::VectorXd forces(const fem::Model& model, const Eigen::VectorXd& x) {
  fem::StiffnessMatrix K = model.make_stiffness({});
  Eigen::VectorXd f;
  fem::Assembler(model, K).assemble(x, fem::Tangent::kExact, f, K);
  return f;
}

/// F = I + a e_xᵀ stretches and shears the block and leaves the plane x = 0, which is fixed, where it is.
void uniform_deformation(Report& report, const NamedMaterial& law, double size) {
  std::vector<char> inner;
  const fem::Mesh mesh = irregular_block(&inner);
  fem::Model model(mesh, law.material, fem::Mass{1}, mesh.regions.at("base"), Eigen::Vector3d::Zero());
  const Eigen::Vector3d a = size * Eigen::Vector3d(1, 0.5, -0.3);
  Eigen::VectorXd uniform = model.rest();
  for (int i = 0; i < model.free_nodes(); ++i) uniform.segment<3>(3 * i) += model.rest()[3 * i] * a;
  const Eigen::VectorXd f = forces(model, uniform);

  double on_surface = 0, inside = 0;
  std::vector<NodalLoad> loads;
  for (int node = 0; node < mesh.node_count(); ++node) {
    const int n = model.numbering()[node];
    if (n >= model.free_nodes()) continue;
    const Eigen::Vector3d force = f.segment<3>(3 * n);
    (inner[node] ? inside : on_surface) = std::max(inner[node] ? inside : on_surface, force.norm());
    if (!inner[node]) loads.push_back({node, -force});
  }
  const std::string what = fmt::format("{}, {} % stretch with shear", law.name, 100 * size);
  report.at_most(what + ": force on inner nodes, of the largest on the surface", inside / on_surface, "",
                 kInnerForce);
  const Eigen::VectorXd x = settle(model, model.rest(), loads);
  report.at_most(what + ": distance of the equilibrium from the uniform deformation, of the displacement",
                 (x - uniform).cwiseAbs().maxCoeff() / (uniform - model.rest()).cwiseAbs().maxCoeff(), "",
                 kPatchError);
}

/// K of the body with no node fixed, at rest. A model needs fixed nodes, so that each of its blocks is taken
/// from one of three models that fix different nodes.
Eigen::MatrixXd free_stiffness(const fem::Mesh& mesh, const fem::Material& material) {
  const int n = mesh.node_count();
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  for (const std::vector<int>& fixed : {std::vector{0, 1, 5}, {2, 3, 7}, {n - 1, n - 2, n - 6}}) {
    const fem::Model model(mesh, material, fem::Mass{1}, fixed, Eigen::Vector3d::Zero());
    const Eigen::MatrixXd part = stiffness_at_rest(model);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const int p = model.numbering()[i], q = model.numbering()[j];
        if (p < model.free_nodes() && q < model.free_nodes())
          K.block<3, 3>(3 * i, 3 * j) = part.block<3, 3>(3 * p, 3 * q);
      }
  }
  return K;
}

void free_modes(Report& report, const NamedMaterial& law) {
  std::vector<char> inner;
  const Eigen::MatrixXd K = free_stiffness(irregular_block(&inner), law.material);
  const Eigen::VectorXd values =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K).eigenvalues();  // ascending
  const double largest = values[values.size() - 1];
  const auto zero = (values.array().abs() < kZeroEigenvalue * largest).count();
  report.within(law.name + ": zero eigenvalues of K of the free body", static_cast<double>(zero), "", 6, 6);
  report.note(law.name + ": largest of these, of the largest of all", std::abs(values[5]) / largest, "");
  report.note(law.name + ": seventh eigenvalue, of the largest", values[6] / largest, "");
}

/// Nodes on which fixed ones act: those that share a tetrahedron or a patch with one.
std::vector<char> reached_from_fixed(const fem::Model& model) {
  std::vector<char> reached(model.mesh().node_count(), 0);
  const auto mark = [&](const auto& nodes) {
    if (std::ranges::any_of(nodes, [&](int node) { return node >= model.free_nodes(); }))
      for (int node : nodes) reached[node] = 1;
  };
  for (const auto& tet : model.mesh().tets) mark(tet);
  for (const auto& patch : model.patches()) mark(patch.nodes);
  return reached;
}

/// The block turned as a whole about an oblique axis; nodes that share an element with fixed ones are left
/// out.
void rigid_turn(Report& report, const NamedMaterial& law) {
  std::vector<char> inner;
  const fem::Mesh mesh = irregular_block(&inner);
  const fem::Model model(mesh, law.material, fem::Mass{1}, {0, 1, 5}, Eigen::Vector3d::Zero());
  const std::vector<char> reached = reached_from_fixed(model);
  double worst = 0;
  for (const double degrees : {30, 90, 135, 180}) {
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d(1, -2, 0.5).normalized())
            .toRotationMatrix();
    Eigen::VectorXd x = model.rest();
    for (int i = 0; i < model.free_nodes(); ++i)
      x.segment<3>(3 * i) = R * model.rest().segment<3>(3 * i) + Eigen::Vector3d(0.1, 0, -0.2);
    const Eigen::VectorXd f = forces(model, x);
    for (int i = 0; i < model.free_nodes(); ++i)
      if (!reached[i]) worst = std::max(worst, f.segment<3>(3 * i).norm());
  }
  report.at_most(law.name + ": force of a rigid turn by 30° to 180°, of E times the squared cell",
                 worst / (kPatchYoung * kCell * kCell), "", kRigidForce);
}

/// K v is the change of the forces along v, and u·K v = v·K u, at a strained pose.
void tangent(Report& report, const NamedMaterial& law) {
  std::vector<char> inner;
  const fem::Mesh mesh = irregular_block(&inner);
  const fem::Model model(mesh, law.material, fem::Mass{1}, mesh.regions.at("base"), Eigen::Vector3d::Zero());
  std::mt19937 random(kSeed);
  const auto n = model.unknowns();
  const Eigen::VectorXd x = model.rest() + fem::testing::random_vector(random, n, 0.05 * kCell);
  const Eigen::VectorXd u = fem::testing::random_vector(random, n, 1),
                        v = fem::testing::random_vector(random, n, 1);
  const auto change = [&](const Eigen::VectorXd& along) {
    const double h = 1e-5 * kCell;
    return Eigen::VectorXd((forces(model, x - h * along) - forces(model, x + h * along)) / (2 * h));
  };
  fem::StiffnessMatrix K = model.make_stiffness({});
  Eigen::VectorXd f;
  fem::Assembler(model, K).assemble(x, fem::Tangent::kExact, f, K);
  const Eigen::VectorXd Kv = change(v), Ku = change(u);
  report.at_most(law.name + ": K v against the change of the forces along v",
                 (K.multiply(v) - Kv).norm() / Kv.norm(), "", kTangentError);
  report.at_most(law.name + ": u·Kv against v·Ku, from changes of the forces",
                 std::abs(u.dot(Kv) - v.dot(Ku)) / (u.norm() * Kv.norm()), "", kTangentError);
}

}  // namespace

void patch(Report& report, Extent) {
  std::vector<NamedMaterial> all = laws(kPatchYoung, kPatchPoisson);
  for (NamedMaterial law : laws(kPatchYoung, kPatchPoisson)) {
    law.name += " with patches";
    law.material.dilatation = fem::Dilatation::kPatch;
    all.push_back(law);
  }
  for (const NamedMaterial& law : all) {
    for (const double size : {1e-3, 0.1}) uniform_deformation(report, law, size);
    free_modes(report, law);
    rigid_turn(report, law);
    tangent(report, law);
  }
}

}  // namespace tendril::validation
