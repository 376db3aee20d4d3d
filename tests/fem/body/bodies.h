// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

#include "fem/body/constraints.h"
#include "fem/body/model.h"
#include "fem/mesh/mesh.h"

namespace tendril::fem::testing {

inline constexpr double kGravity = 9.81;

/// A beam along x of nx × ny × nz cubes of side `size` (m), each cut into six tetrahedra (Kuhn's division,
/// which matches across neighbouring cubes). Region "base" is the face x = 0.
inline Mesh beam(int nx, int ny, int nz, double size) {
  Mesh mesh;
  const auto index = [&](int i, int j, int k) { return (i * (ny + 1) + j) * (nz + 1) + k; };
  mesh.nodes.resize(3, (nx + 1) * (ny + 1) * (nz + 1));
  for (int i = 0; i <= nx; ++i)
    for (int j = 0; j <= ny; ++j)
      for (int k = 0; k <= nz; ++k) {
        mesh.nodes.col(index(i, j, k)) = size * Eigen::Vector3d(i, j, k);
        if (i == 0) mesh.regions["base"].push_back(index(i, j, k));
      }
  const int permutations[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  for (int i = 0; i < nx; ++i)
    for (int j = 0; j < ny; ++j)
      for (int k = 0; k < nz; ++k)
        for (int p = 0; p < 6; ++p) {
          Eigen::Vector3i at(i, j, k);
          std::array<int, 4> tet{index(i, j, k), 0, 0, 0};
          for (int step = 0; step < 3; ++step) {
            ++at[permutations[p][step]];
            tet[step + 1] = index(at.x(), at.y(), at.z());
          }
          if (p >= 3) std::swap(tet[2], tet[3]);  // odd permutations are left-handed
          mesh.tets.push_back(tet);
        }
  return mesh;
}

inline Model beam_model(const Mesh& mesh, const Material& material = {150e3, 0.45}, double mass = 0.05,
                        const Eigen::Vector3d& gravity = {0, 0, -kGravity}) {
  return {mesh, material, Mass{mass}, mesh.regions.at("base"), gravity};
}

/// Two cables through the beam's length, above and below its middle, to guides behind the base, and the
/// middle of the far end as effector. The first is routed through a point inside the body.
inline Constraints beam_constraints(const Model& model, double length, double height) {
  const auto body = [&](double x, double z) {
    return CablePoint(attach(model.mesh(), {x, height / 2, z}, 0));
  };
  const auto guide = [&](double x, double z) { return CablePoint(Eigen::Vector3d(x, height / 2, z)); };
  const Cable upper{
      {body(length, 0.9 * height), body(0.4 * length, 0.8 * height), guide(-0.02, 0.9 * height)}};
  const Cable lower{{body(length, 0.1 * height), guide(-0.02, 0.05 * height)}};
  const PointEffector tip{{attach(model.mesh(), {length, height / 2, height / 2}, 0)}};
  return {model, {upper, lower}, {tip}};
}

/// The beam of 80 × 20 × 20 mm with its cables and effector that most tests bend.
struct Beam {
  static constexpr double kLength = 0.08, kHeight = 0.02;  // m
  Mesh mesh = beam(8, 2, 2, 0.01);
  Model model = beam_model(mesh);
  Constraints constraints = beam_constraints(model, kLength, kHeight);
};

inline Eigen::VectorXd random_vector(std::mt19937& random, Eigen::Index size, double amplitude) {
  std::uniform_real_distribution<double> uniform(-amplitude, amplitude);
  return Eigen::VectorXd::NullaryExpr(size, [&] { return uniform(random); });
}

}  // namespace tendril::fem::testing
