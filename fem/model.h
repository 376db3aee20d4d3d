#pragma once

#include <Eigen/Core>
#include <vector>

#include "fem/attachment.h"
#include "fem/corotational.h"
#include "fem/material.h"
#include "fem/mesh.h"
#include "fem/stiffness_matrix.h"

namespace tendril::fem {

/// What a body weighs and how its mass is lumped to the nodes.
struct Mass {
  double total;           ///< kg
  bool per_node = false;  ///< equal shares for all nodes instead of a quarter of each tetrahedron's
};

/// An elastic body: mesh, material, mass, fixed nodes, gravity and loads.
///
/// Nodes are renumbered so that the N free ones come first: the unknowns x (3N, m) are the positions of the
/// free nodes in that order, and the fixed nodes are no part of the system [Largilliere 2015, section II,
/// step 1]. The model is constant while it is used: threads may share it once it is built.
class Model {
 public:
  /// @param mesh   checked here, see check()
  /// @param fixed  node indices of the mesh that do not move; at least three, not all on one line
  /// @throws MeshError for a bad mesh or a body that is not held; std::invalid_argument for a bad material or
  /// mass Real-time: no.
  Model(const Mesh& mesh, const Material& material, const Mass& mass, const std::vector<int>& fixed,
        const Eigen::Vector3d& gravity);

  int free_nodes() const { return free_nodes_; }         ///< N
  int unknowns() const { return 3 * free_nodes_; }       ///< 3N
  const Mesh& mesh() const { return mesh_; }             ///< at rest, in the model's numbering
  const Eigen::VectorXd& rest() const { return rest_; }  ///< x at rest, 3N, m

  /// Where each node of the mesh given at construction stands in the model's numbering.
  const std::vector<int>& numbering() const { return numbering_; }

  /// f_ext: gravity and loads, 3N, N.
  const Eigen::VectorXd& external_forces() const { return external_; }

  /// Lumped masses, one an unknown, 3N, kg.
  const Eigen::VectorXd& masses() const { return masses_; }

  /// Adds a dead load (N) at a material point to f_ext.
  void add_load(const Attachment& at, const Eigen::Vector3d& force);

  /// Position of a node, free or fixed, m.
  Eigen::Vector3d position(const Eigen::VectorXd& x, int node) const;
  /// Position of a material point, m.
  Eigen::Vector3d position(const Eigen::VectorXd& x, const Attachment& at) const;

  /// Elastic energy U(x), J.
  double energy(const Eigen::VectorXd& x) const;

  /// A zero matrix with the pattern of K, widened by the couplings of further sets of nodes (the segments of
  /// cables, see Constraints::cliques()).
  StiffnessMatrix make_stiffness(const std::vector<std::vector<int>>& cliques) const;

  /// Slots of all elements' blocks in a matrix that make_stiffness() made; one list serves all such matrices
  /// of the same cliques.
  using Scatter = std::vector<std::array<int, 10>>;
  Scatter scatter(const StiffnessMatrix& K) const;

  /// Internal forces f(x) (3N, N) and the tangent K(x) = −∂f/∂x (N/m), both overwritten.
  /// @return  number of elements that are inverted; 0 for a usable pose
  /// Real-time: no (time depends on the mesh).
  int assemble(const Eigen::VectorXd& x, Tangent tangent, const Scatter& scatter, Eigen::VectorXd& f,
               StiffnessMatrix& K) const;

  /// Internal forces alone.
  int internal_forces(const Eigen::VectorXd& x, Eigen::VectorXd& f) const;

 private:
  Eigen::Matrix<double, 3, 4> corners(const Eigen::VectorXd& x, int tet) const;
  void add_forces(const CorotationalElement& element, int tet, Eigen::VectorXd& f) const;
  void lump_masses(const Mass& mass, const Eigen::Vector3d& gravity);

  Mesh mesh_;
  Material material_;
  std::vector<int> numbering_;
  int free_nodes_ = 0;
  std::vector<RestTetrahedron> elements_;
  Eigen::VectorXd rest_, masses_, external_;
};

}  // namespace tendril::fem
