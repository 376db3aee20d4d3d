#pragma once

#include <Eigen/Core>
#include <array>
#include <variant>
#include <vector>

#include "fem/attachment.h"
#include "fem/model.h"
#include "fem/stiffness_matrix.h"

namespace tendril::fem {

/// A point that a cable passes: a material point of the body (in the model's numbering), or a guide that
/// stands still (m).
using CablePoint = std::variant<Attachment, Eigen::Vector3d>;

/// A cable that slides without friction through its points; its first point is its attachment.
struct Cable {
  std::vector<CablePoint> points;  ///< at least two
};

/// A material point whose coordinates are to be controlled.
struct Effector {
  Attachment at;                                        ///< in the model's numbering
  std::array<bool, 3> controlled = {true, true, true};  ///< x, y, z
};

/// The m actuators and e effector coordinates of a robot and their directions J in the space of the unknowns.
///
/// A cable's displacement δ_a is its shortening from the rest length, δ_a = ℓ(x_rest) − ℓ(x), so that its row
/// of J_a is −∂ℓ/∂x and its conjugate effort λ ≥ 0 is the tension (N).
class Constraints {
 public:
  /// @throws std::invalid_argument if two neighbouring points of a cable coincide at rest, a cable has one
  /// point only,
  ///         or a cable or an effector is attached to nothing that can move
  Constraints(const Model& model, std::vector<Cable> cables, std::vector<Effector> effectors);

  int actuators() const { return static_cast<int>(cables_.size()); }           ///< m
  int effector_coordinates() const { return static_cast<int>(rows_.size()); }  ///< e

  /// Sets of nodes that the cables couple, for Model::make_stiffness().
  std::vector<std::vector<int>> cliques() const;

  /// δ_a(x), m entries, m.
  Eigen::VectorXd shortening(const Eigen::VectorXd& x) const;

  /// Overwrites J_aT (3N × m, unitless) with J_aᵀ at x.
  void actuator_directions(const Eigen::VectorXd& x, Eigen::Ref<Eigen::MatrixXd> J_aT) const;

  /// p_e(x): the controlled coordinates of the effectors in order, e entries, m.
  Eigen::VectorXd effector_position(const Eigen::VectorXd& x) const;

  /// J_e Y for displacements Y (3N × c) of the free nodes; J_e is constant.
  /// @return  e × c
  Eigen::MatrixXd effector_displacement(const Eigen::MatrixXd& Y) const;

  /// Adds −∂(J_aᵀλ)/∂x to K (N/m): the stiffness that a cable's tension lends by turning with the body. A
  /// segment of length L and direction u adds (λ/L)(I − u uᵀ) to the relative motion of its ends. It is what
  /// the paper neglects when it takes J_a as constant; semidefinite for λ ≥ 0.
  /// @param lambda  m tensions, N
  void add_cable_stiffness(const Eigen::VectorXd& x, const Eigen::VectorXd& lambda, StiffnessMatrix& K) const;

 private:
  struct Row {
    int effector;
    int axis;
  };
  Eigen::Vector3d place(const Eigen::VectorXd& x, const CablePoint& point) const;
  double length(const Eigen::VectorXd& x, const Cable& cable) const;

  const Model& model_;
  std::vector<Cable> cables_;
  std::vector<Effector> effectors_;
  std::vector<Row> rows_;
  Eigen::VectorXd rest_lengths_;
};

}  // namespace tendril::fem
