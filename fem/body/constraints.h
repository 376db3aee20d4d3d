// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "fem/body/coordinate.h"
#include "fem/mesh/surface.h"

namespace tendril::fem {

/// A cable that slides without friction through its points; the first one is its attachment. It only pulls.
/// λ ≥ 0 is the tension, N; δ is the shortening, m.
struct Cable {
  std::vector<CablePoint> points;  ///< at least two
};

/// A rod between two points. λ, N, is positive if it pushes them apart; δ is the lengthening, m.
struct Rod {
  CablePoint from, to;
};

/// A force on a point of the body along a direction fixed in space. λ is in N; δ, m, is the travel of the
/// point.
struct Force {
  Attachment at;
  Eigen::Vector3d direction;  ///< of any length but 0
};

/// The pressure in a cavity; it follows the wall. λ is in Pa, above the outside; δ is the growth of the
/// volume, m³.
struct Pressure {
  std::vector<Face> surface;  ///< the body's faces around it, see closed_surface(); in the model's numbering
};

using Actuator = std::variant<Cable, Rod, Force, Pressure>;

/// A material point, or the mean of several, whose coordinates are controlled, m.
struct PointEffector {
  std::vector<Attachment> points;                       ///< in the model's numbering
  std::array<bool, 3> controlled = {true, true, true};  ///< x, y, z
};

/// A cavity whose volume is controlled: one coordinate, m³.
struct VolumeEffector {
  std::vector<Face> surface;  ///< as of Pressure
};

using Effector = std::variant<PointEffector, VolumeEffector>;

/// An actuator or effector that Constraints cannot use.
struct ConstraintError : std::invalid_argument {
  enum Role { kActuator, kEffector };
  ConstraintError(Role whose, int number, const std::string& why);

  Role role;
  int index;           ///< in its list
  std::string reason;  ///< what() without role and index
};

/// The m actuators and e effector coordinates of a robot and their directions J in the space of the unknowns.
///
/// Each actuator drives a scalar q_a(x) of the pose. Its displacement is δ_a = q_a(x) − q_a(x_rest), its row
/// of J_a is ∂q_a/∂x. Its effort λ_a is conjugate to it: λ_a δ_a is work, J, for every kind of actuator.
class Constraints {
 public:
  /// Keeps a reference to the model.
  /// @throws ConstraintError if an actuator or effector moves no free node, or its geometry is bad: two
  ///         successive points that coincide at rest, a cable of one point, a direction of length 0, a mean
  ///         of no points, a surface that is not closed
  /// Real-time: no (allocates).
  Constraints(const Model& model, const std::vector<Actuator>& actuators,
              const std::vector<Effector>& effectors);

  int actuators() const { return static_cast<int>(actuators_.size()); }             ///< m
  int effector_coordinates() const { return static_cast<int>(effectors_.size()); }  ///< e

  /// Whether an actuator only pulls, as a cable: λ_a ≥ 0.
  bool pull_only(int actuator) const { return pull_only_[actuator]; }
  /// The same for all, m entries.
  const Eigen::ArrayX<bool>& pull_only() const { return pull_only_; }

  /// Sets of nodes that the actuators couple, for Model::make_stiffness().
  std::vector<std::vector<int>> cliques() const;

  /// For each row of J_a or J_e the free nodes at which it may be nonzero; nodes may occur twice.
  std::vector<std::vector<int>> actuator_nodes() const;
  std::vector<std::vector<int>> effector_nodes() const;

  // Real-time: no, all those below (time depends on the mesh). They allocate only results: those that are
  // returned, and those that do not have their size yet. x is 3N, m.

  /// δ_a(x), m entries, m or m³.
  void displacement(const Eigen::VectorXd& x, Eigen::VectorXd& delta_a) const;
  Eigen::VectorXd displacement(const Eigen::VectorXd& x) const;

  /// J_aT ← J_aᵀ at x, 3N × m, unitless or m².
  void actuator_directions(const Eigen::VectorXd& x, Eigen::Ref<Eigen::MatrixXd> J_aT) const;

  /// p_e(x): the controlled coordinates of the effectors in order, e entries, m or m³.
  void effector_position(const Eigen::VectorXd& x, Eigen::VectorXd& p_e) const;
  Eigen::VectorXd effector_position(const Eigen::VectorXd& x) const;

  /// J_eT ← J_eᵀ at x, 3N × e, unitless or m².
  void effector_directions(const Eigen::VectorXd& x, Eigen::Ref<Eigen::MatrixXd> J_eT) const;

  /// K ← K − ∂(J_aᵀλ)/∂x: the geometric stiffness of the efforts, whose directions turn with the body. The
  /// paper neglects it: it takes J_a as constant. With the semidefinite tangent only taut cables and pulling
  /// rods are added.
  /// @param lambda  m, N or Pa
  /// @param K       N/m, made by Model::make_stiffness() with cliques()
  /// @throws std::invalid_argument if K has another pattern
  void add_stiffness(const Eigen::VectorXd& x, const Eigen::VectorXd& lambda, Tangent tangent,
                     StiffnessMatrix& K) const;

 private:
  std::vector<Coordinate> actuators_, effectors_;
  Eigen::ArrayX<bool> pull_only_;
  Eigen::VectorXd rest_;  // of the actuators' coordinates
  size_t blocks_;         // number of blocks of K
};

}  // namespace tendril::fem
