#pragma once

#include <vector>

#include "fem/mesh/mesh.h"

namespace tendril::fem {

inline constexpr int kNoPatch = -1;

/// Tetrahedra that resist the change of volume together.
///
/// A linear tetrahedron of a nearly incompressible material has one pressure to itself, and a mesh has more
/// tetrahedra than unknowns to satisfy them all: it locks, bending far too little. In a patch only the mean
/// dilatation θ̄ = Σ V_e θ_e / Σ V_e costs energy, λ/2 θ̄² Σ V_e, which leaves one condition a patch [the
/// patch-wise F-bar of de Souza Neto et al., "F-bar-based linear triangles and tetrahedra", 2005; nodal
/// averages in Bonet & Burton 1998]. The shear energy stays each tetrahedron's own, and with it stability:
/// what is averaged is only what an element has beyond a material of ν = 0. Forces p̄ V_e ∂θ_e/∂x, p̄ = λ θ̄,
/// derive from this energy, and the stiffness gains (λ/ΣV_e) b bᵀ, b = Σ V_e ∂θ_e/∂x, which couples all nodes
/// of the patch.
struct Patch {
  std::vector<int> tets;
  std::vector<int> nodes;  ///< ascending
  double volume;           ///< at rest, m³
};

/// Divides tetrahedra into patches of about eight that are connected by faces, as compact as they come.
/// @param group  of every tetrahedron: patches hold tetrahedra of one group; kNoPatch for none
/// Real-time: no.
std::vector<Patch> make_patches(const Mesh& mesh, const std::vector<int>& group);

}  // namespace tendril::fem
