// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <variant>
#include <vector>

#include "fem/body/attachment.h"
#include "fem/element/material.h"
#include "fem/element/patches.h"
#include "fem/mesh/mesh.h"
#include "fem/sparse/stiffness_matrix.h"

namespace tendril::fem {

/// The mass of a body and how it is lumped to the nodes.
struct Mass {
  double total;           ///< kg
  bool per_node = false;  ///< true: the same for all nodes; false: a quarter of each tetrahedron's mass

  /// Mass of all that is of a material, kg, if known: one entry for each material, or none at all. The other
  /// materials share the remaining mass by volume, or node by node.
  std::vector<std::optional<double>> of_material = {};
};

/// An elastic body: mesh, materials, mass, fixed nodes, gravity and dead loads.
///
/// Nodes are renumbered so that the N free ones come first: the unknowns x (3N, m) are the positions of the
/// free nodes in that order, and the fixed nodes are no part of the system [Largilliere 2015, section II,
/// step 1]. Once it is built the model is constant, and threads may share it.
class Model {
 public:
  /// @param mesh   m; checked here, see check()
  /// @param fixed  node indices of the mesh that do not move; at least three, not all on one line
  /// @param material_of_tet  index into `materials` of every tetrahedron
  /// @throws MeshError for a bad mesh or a body that is not held; std::invalid_argument for a bad material or
  ///         mass, by its number where there are several
  /// Real-time: no.
  Model(const Mesh& mesh, std::vector<Material> materials, std::vector<int> material_of_tet, const Mass& mass,
        const std::vector<int>& fixed, const Eigen::Vector3d& gravity);

  /// All of one material.
  Model(const Mesh& mesh, const Material& material, const Mass& mass, const std::vector<int>& fixed,
        const Eigen::Vector3d& gravity);

  int free_nodes() const { return free_nodes_; }         ///< N
  int unknowns() const { return 3 * free_nodes_; }       ///< 3N
  const Mesh& mesh() const { return mesh_; }             ///< at rest, in the model's numbering
  const Eigen::VectorXd& rest() const { return rest_; }  ///< x at rest, 3N, m

  /// The model's number of each node of the mesh given at construction.
  const std::vector<int>& numbering() const { return numbering_; }

  /// f_ext: gravity and loads, 3N, N.
  const Eigen::VectorXd& external_forces() const { return external_; }

  /// Lumped mass of each unknown, 3N, kg.
  const Eigen::VectorXd& masses() const { return masses_; }

  /// Adds a dead load (N) at a material point to f_ext.
  void add_load(const Attachment& at, const Eigen::Vector3d& force);

  /// Position of a node, free or fixed, m.
  Eigen::Vector3d position(const Eigen::VectorXd& x, int node) const;
  /// Position of a material point, m.
  Eigen::Vector3d position(const Eigen::VectorXd& x, const Attachment& at) const;

  /// Rest shape, law and moduli of each tetrahedron; and the element at the pose x.
  const std::vector<RestTetrahedron>& tetrahedra() const { return tetrahedra_; }
  Law law(int tet) const { return materials_[material_of_tet_[tet]].law; }
  Moduli moduli(int tet) const;
  Element element(const Eigen::VectorXd& x, int tet) const;

  /// Patches of the tetrahedra whose material has Dilatation::kPatch.
  const std::vector<Patch>& patches() const { return patches_; }
  int patch_of(int tet) const { return patch_of_tet_[tet]; }  ///< or kNoPatch
  /// λ of the patch's material, Pa.
  double patch_modulus(size_t patch) const {
    return materials_[material_of_tet_[patches_[patch].tets.front()]].lame_lambda();
  }

  /// Elastic energy U(x), J. It goes element by element, as internal_forces(), with the plain formulas; tests
  /// compare the Assembler with them.
  double energy(const Eigen::VectorXd& x) const;

  /// Internal forces f(x), 3N, N, overwritten.
  /// @return  number of elements that are inverted; 0 for a usable pose
  /// Real-time: no (allocates).
  int internal_forces(const Eigen::VectorXd& x, Eigen::VectorXd& f) const;

  /// A zero matrix with the pattern of K.
  /// @param cliques  further sets of nodes that are coupled, see Constraints::cliques()
  StiffnessMatrix make_stiffness(const std::vector<std::vector<int>>& cliques) const;

 private:
  std::vector<double> patch_dilatations(const Eigen::VectorXd& x) const;
  void lump_masses(const Mass& mass, const Eigen::Vector3d& gravity);

  Mesh mesh_;
  std::vector<Material> materials_;
  std::vector<int> material_of_tet_, patch_of_tet_;
  std::vector<int> numbering_;
  int free_nodes_ = 0;
  std::vector<RestTetrahedron> tetrahedra_;
  std::vector<Patch> patches_;
  Eigen::VectorXd rest_, masses_, external_;
};

}  // namespace tendril::fem
