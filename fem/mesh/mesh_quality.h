// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "fem/mesh/mesh.h"

namespace tendril::fem {

/// How well the tetrahedra of a mesh are shaped. A needle or a sliver makes the body locally too stiff and K
/// badly conditioned.
///
/// The mean ratio of a tetrahedron of volume V is η = 12 (3V)^(2/3) / Σ l², over its six edges l: 1 where it
/// is regular, 0 where it is flat  [Liu & Joe, "Relationship between tetrahedron shape measures", BIT 34,
/// 1994]. A dihedral angle is the one inside the body between two faces at their edge: 70.53° where regular.
struct Quality {
  struct Element {
    int tet;
    double mean_ratio;
    Eigen::Vector3d centre;  ///< m
  };
  double mean_ratio_min = 0, mean_ratio_median = 0;
  double dihedral_min = 0, dihedral_max = 0;  ///< over all edges of all tetrahedra, rad
  double edge_ratio_max = 0;                  ///< longest edge of a tetrahedron over its shortest
  int slivers = 0;                            ///< tetrahedra of a mean ratio below kSliver
  std::vector<Element> worst;                 ///< those of the lowest mean ratio, at most five, worst first
};

/// Below this mean ratio a tetrahedron is worth a warning: four points near a square reach it where their
/// dihedral angles are 2° and 177°.
inline constexpr double kSliver = 0.1;

/// @param mesh  one that check() accepts
/// Real-time: no.
Quality mesh_quality(const Mesh& mesh);

/// One line for a person: worst and median mean ratio, angles, and where slivers are.
std::string summary(const Quality& quality);

}  // namespace tendril::fem
