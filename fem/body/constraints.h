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

/// A cable that slides without friction through its points; its first point is its attachment. It only pulls:
/// its effort λ ≥ 0 is the tension, N, its displacement δ the shortening, m.
struct Cable {
  std::vector<CablePoint> points;  ///< at least two
};

/// A rod between two points. λ, N, is positive where it pushes them apart; δ is the lengthening, m.
struct Rod {
  CablePoint from, to;
};

/// A force on a point of the body along a direction fixed in space: λ, N; δ is the point's travel, m.
struct Force {
  Attachment at;
  Eigen::Vector3d direction;  ///< of any length but zero
};

/// The pressure in a cavity, which follows the cavity's wall: λ, Pa; δ is the growth of its volume, m³.
struct Pressure {
  std::vector<Face> surface;  ///< the body's faces around it, see closed_surface(); in the model's numbering
};

using Actuator = std::variant<Cable, Rod, Force, Pressure>;

/// A material point, or the mean of several, whose coordinates are to be controlled, m.
struct PointEffector {
  std::vector<Attachment> points;                       ///< in the model's numbering
  std::array<bool, 3> controlled = {true, true, true};  ///< x, y, z
};

/// A cavity whose volume is to be controlled: one coordinate, m³.
struct VolumeEffector {
  std::vector<Face> surface;  ///< as of Pressure
};

using Effector = std::variant<PointEffector, VolumeEffector>;

/// What is wrong with one of the actuators or effectors that constraints are made of.
struct ConstraintError : std::invalid_argument {
  enum Role { kActuator, kEffector };
  ConstraintError(Role whose, int number, const std::string& why);

  Role role;
  int index;           ///< in its list
  std::string reason;  ///< what() without role and index
};

/// The m actuators and e effector coordinates of a robot and their directions J in the space of the unknowns.
///
/// Every actuator drives a scalar q_a(x) of the pose. Its displacement is δ_a = q_a(x) − q_a(x_rest), its row
/// of J_a is ∂q_a/∂x, and its effort λ_a is conjugate to it: λᵀδ is work, J, of every kind.
class Constraints {
 public:
  /// Keeps a reference to the model.
  /// @throws ConstraintError if an actuator or effector can move
  ///         nothing, or its geometry is bad: two neighbouring points that coincide at rest, a cable of one
  ///         point, a direction of length zero, a mean of no points, a surface that is not closed
  Constraints(const Model& model, const std::vector<Actuator>& actuators,
              const std::vector<Effector>& effectors);

  int actuators() const { return static_cast<int>(actuators_.size()); }             ///< m
  int effector_coordinates() const { return static_cast<int>(effectors_.size()); }  ///< e

  /// Whether an actuator pulls and cannot push, as a cable: λ_a ≥ 0.
  bool pull_only(int actuator) const { return pull_only_[actuator]; }
  /// The same of all of them, m entries.
  const Eigen::ArrayX<bool>& pull_only() const { return pull_only_; }

  /// Sets of nodes that the actuators couple, for Model::make_stiffness().
  std::vector<std::vector<int>> cliques() const;

  /// For each row of J_a or J_e the free nodes at which it may be nonzero; nodes may occur twice.
  std::vector<std::vector<int>> actuator_nodes() const;
  std::vector<std::vector<int>> effector_nodes() const;

  // Real-time: those below allocate nothing, but for results that have not yet the size they need, and for
  // those that are returned.

  /// δ_a(x), m entries, m or m³.
  void displacement(const Eigen::VectorXd& x, Eigen::VectorXd& delta_a) const;
  Eigen::VectorXd displacement(const Eigen::VectorXd& x) const;

  /// Overwrites J_aT (3N × m; unitless or m²) with J_aᵀ at x.
  void actuator_directions(const Eigen::VectorXd& x, Eigen::Ref<Eigen::MatrixXd> J_aT) const;

  /// p_e(x): the controlled coordinates of the effectors in order, e entries, m or m³.
  void effector_position(const Eigen::VectorXd& x, Eigen::VectorXd& p_e) const;
  Eigen::VectorXd effector_position(const Eigen::VectorXd& x) const;

  /// Overwrites J_eT (3N × e; unitless or m²) with J_eᵀ at x.
  void effector_directions(const Eigen::VectorXd& x, Eigen::Ref<Eigen::MatrixXd> J_eT) const;

  /// Adds −∂(J_aᵀλ)/∂x to K (N/m): the stiffness that efforts lend by turning with the body. It is what the
  /// paper neglects when it takes J_a as constant. Unless the tangent is exact, only what is positive
  /// semidefinite of it is added: that of taut cables and of rods that pull.
  /// @param lambda  m efforts, N or Pa
  /// @param K       made by Model::make_stiffness() with cliques()
  /// @throws std::invalid_argument if K has another pattern
  void add_stiffness(const Eigen::VectorXd& x, const Eigen::VectorXd& lambda, Tangent tangent,
                     StiffnessMatrix& K) const;

 private:
  std::vector<Coordinate> actuators_, effectors_;
  Eigen::ArrayX<bool> pull_only_;
  Eigen::VectorXd rest_;  // of the actuators' coordinates
  size_t blocks_;         // of matrices that the coordinates are bound to
};

}  // namespace tendril::fem
