// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "fem/mesh/mesh.h"

namespace tendril::fem {

/// Of a tetrahedron that is in no patch.
inline constexpr int kNoPatch = -1;

/// Tetrahedra that resist the change of volume together, against locking.
///
/// A linear tetrahedron of a nearly incompressible material has one pressure of its own. A mesh has more
/// tetrahedra than unknowns, so it locks: it bends far too little. In a patch only the mean dilatation θ̄ = Σ
/// V_e θ_e / V_p costs energy, λ/2 θ̄² V_p with V_p = Σ V_e: one condition for each patch [patch-wise F-bar:
/// de Souza Neto et al., "F-bar-based linear triangles and tetrahedra", 2005; nodal averages: Bonet & Burton
/// 1998]. The shear energy stays with each tetrahedron and keeps it stable: only the part of the energy
/// beyond a material of ν = 0 is averaged.
///
/// The forces are −p̄ V_e ∂θ_e/∂x, p̄ = λ θ̄. The stiffness gains (λ/V_p) b bᵀ, b = Σ V_e ∂θ_e/∂x, which
/// couples all nodes of the patch.
struct Patch {
  std::vector<int> tets;   ///< indices into the mesh
  std::vector<int> nodes;  ///< ascending
  double volume;           ///< at rest, m³
};

/// Divides tetrahedra into compact patches of about eight that are connected by faces.
/// @param group  of each tetrahedron; a patch has tetrahedra of one group; kNoPatch: of no patch
/// Real-time: no.
std::vector<Patch> make_patches(const Mesh& mesh, const std::vector<int>& group);

}  // namespace tendril::fem
