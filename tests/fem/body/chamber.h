// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fem/body/constraints.h"
#include "fem/mesh/surface.h"
#include "tests/fem/body/bodies.h"

namespace tendril::fem::testing {

/// The mesh without the tetrahedra inside a box; the box's wall becomes the region `name`, other regions go.
inline Mesh hollowed(const Mesh& solid, const Box& box, const std::string& name) {
  Mesh mesh;
  std::vector<char> hollow(solid.tets.size(), 0);
  for (int tet : tets_in(solid, box)) hollow[tet] = 1;
  std::vector<int> numbering(solid.node_count(), -1);
  for (int t = 0; t < solid.tet_count(); ++t) {
    if (hollow[t]) continue;
    mesh.tets.push_back(solid.tets[t]);
    for (int& node : mesh.tets.back()) {
      if (numbering[node] < 0) {
        numbering[node] = mesh.node_count();
        mesh.nodes.conservativeResize(Eigen::NoChange, mesh.node_count() + 1);
        mesh.nodes.rightCols<1>() = solid.nodes.col(node);
      }
      node = numbering[node];
    }
  }
  mesh.regions[name] = nodes_in(mesh, box);
  return mesh;
}

/// A block of 30 × 20 × 20 mm around a cavity of 2 ml, with an actuator of every kind.
struct Chamber {
  static constexpr double kVolume = 2e-6;  // m³, of the cavity
  static constexpr double kTiny = 1e-9;    // m, so that nodes on a box's border are in it
  enum { kCable, kRodToGuide, kRodInside, kForce, kPressure, kActuators };

  /// @param held  nodes up to this x do not move, m; from 5 mm on they include a part of the cavity's wall
  explicit Chamber(double held = 0, const Eigen::Vector3d& gravity = Eigen::Vector3d::Zero())
      : mesh(hollowed(beam(6, 4, 4, 0.005),
                      Box{Eigen::Vector3d(0.005, 0.005, 0.005).array() - kTiny,
                          Eigen::Vector3d(0.025, 0.015, 0.015).array() + kTiny},
                      "cavity")),
        model(mesh, Material{150e3, 0.45}, Mass{0.01},
              nodes_in(mesh, Box{{-1, -1, -1}, {held + kTiny, 1, 1}}), gravity),
        wall(closed_surface(model.mesh(), model.mesh().regions.at("cavity"))),
        constraints(model, actuators(), effectors()) {}

  Attachment at(double x, double y, double z) const { return attach(model.mesh(), {x, y, z}, 0); }

  std::vector<Actuator> actuators() const {
    const Eigen::Vector3d behind(-0.02, 0.01, 0.02), before(0.05, 0.01, 0.011);
    std::vector<Actuator> result(kActuators);
    result[kCable] = Cable{{at(0.03, 0.01, 0.018), at(0.012, 0.011, 0.018), behind}};
    result[kRodToGuide] = Rod{before, at(0.03, 0.012, 0.012)};
    result[kRodInside] = Rod{at(0.03, 0.002, 0.003), at(0.028, 0.018, 0.018)};
    result[kForce] = Force{at(0.03, 0.01, 0.01), {0, 1, 2}};
    result[kPressure] = Pressure{wall};
    return result;
  }
  std::vector<Effector> effectors() const {
    return {PointEffector{{at(0.03, 0.004, 0.004), at(0.03, 0.016, 0.017)}, {true, false, true}},
            VolumeEffector{wall}};
  }

  Mesh mesh;
  Model model;
  std::vector<Face> wall;
  Constraints constraints;
};

}  // namespace tendril::fem::testing
