// SPDX-License-Identifier: Apache-2.0
#include "fem/body/constraints.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <stdexcept>

namespace tendril::fem {
namespace {

double value(const Coordinate& coordinate, const Eigen::VectorXd& x) {
  return std::visit([&](const auto& q) { return q.value(x); }, coordinate);
}

std::vector<int> nodes_of(const Coordinate& coordinate) {
  return std::visit([](const auto& q) { return q.nodes(); }, coordinate);
}

std::vector<std::vector<int>> nodes_of(const std::vector<Coordinate>& coordinates) {
  std::vector<std::vector<int>> result;
  for (const Coordinate& coordinate : coordinates) result.push_back(nodes_of(coordinate));
  return result;
}

void gradients(const std::vector<Coordinate>& coordinates, const Eigen::VectorXd& x,
               Eigen::Ref<Eigen::MatrixXd> J_T) {
  J_T.setZero();
  for (size_t k = 0; k < coordinates.size(); ++k)
    std::visit([&](const auto& q) { q.add_gradient(x, J_T.col(static_cast<int>(k))); }, coordinates[k]);
}

/// Makes the coordinates of an actuator or effector; refuses bad geometry.
class Builder {
 public:
  explicit Builder(const Model& model) : model_(model) {}

  Coordinate operator()(const Cable& cable) const {
    if (cable.points.size() < 2)
      throw std::invalid_argument(fmt::format("a cable has {} points, expected two", cable.points.size()));
    return line(cable.points, -1);
  }
  Coordinate operator()(const Rod& rod) const { return line({rod.from, rod.to}, +1); }
  Coordinate operator()(const Force& force) const {
    const double length = force.direction.norm();
    if (!(length > 0) || !std::isfinite(length))
      throw std::invalid_argument("the direction of a force has no length");
    return mean({force.at}, force.direction / length);
  }
  Coordinate operator()(const Pressure& pressure) const { return cavity(pressure.surface); }

  std::vector<Coordinate> operator()(const PointEffector& effector) const {
    if (effector.points.empty()) throw std::invalid_argument("it has no point");
    std::vector<Coordinate> result;
    for (int axis = 0; axis < 3; ++axis)
      if (effector.controlled[axis]) result.push_back(mean(effector.points, Eigen::Vector3d::Unit(axis)));
    return result;
  }
  std::vector<Coordinate> operator()(const VolumeEffector& effector) const {
    return {cavity(effector.surface)};
  }

 private:
  Coordinate line(const std::vector<CablePoint>& points, double sign) const {
    Length length(model_, points, sign);
    if (const int k = length.first_degenerate_segment(model_.rest()); k >= 0)
      throw std::invalid_argument(fmt::format("its points {} and {} coincide", k, k + 1));
    return length;
  }
  Coordinate mean(const std::vector<Attachment>& points, const Eigen::Vector3d& direction) const {
    LinearVector mean;
    for (const Attachment& point : points) mean.add(model_, point, 1.0 / static_cast<double>(points.size()));
    return Projection(mean, direction);
  }
  Coordinate cavity(const std::vector<Face>& surface) const {
    try {
      check_closed(model_.mesh(), surface);
    } catch (const MeshError& error) {
      throw std::invalid_argument(error.what());
    }
    return Volume(model_, surface);
  }

  const Model& model_;
};

/// The coordinates of one actuator or effector.
template <typename Result, typename Kind>
Result build(const Model& model, const Kind& kind, ConstraintError::Role role, int index) {
  try {
    return std::visit(Builder(model), kind);
  } catch (const std::invalid_argument& error) {
    throw ConstraintError(role, index, error.what());
  }
}

void refuse_if_held(const Coordinate& coordinate, ConstraintError::Role role, int index) {
  if (nodes_of(coordinate).empty()) throw ConstraintError(role, index, "it is attached to fixed nodes only");
}

}  // namespace

ConstraintError::ConstraintError(Role whose, int number, const std::string& why)
    : std::invalid_argument(
          fmt::format("{} {}: {}", whose == kActuator ? "actuator" : "effector", number, why)),
      role(whose),
      index(number),
      reason(why) {}

Constraints::Constraints(const Model& model, const std::vector<Actuator>& actuators,
                         const std::vector<Effector>& effectors)
    : pull_only_(actuators.size()), rest_(actuators.size()) {
  for (int a = 0; a < static_cast<int>(actuators.size()); ++a) {
    actuators_.push_back(build<Coordinate>(model, actuators[a], ConstraintError::kActuator, a));
    refuse_if_held(actuators_.back(), ConstraintError::kActuator, a);
    pull_only_[a] = std::holds_alternative<Cable>(actuators[a]);
    rest_[a] = value(actuators_.back(), model.rest());
  }
  for (int e = 0; e < static_cast<int>(effectors.size()); ++e)
    for (auto& coordinate :
         build<std::vector<Coordinate>>(model, effectors[e], ConstraintError::kEffector, e)) {
      refuse_if_held(coordinate, ConstraintError::kEffector, e);
      effectors_.push_back(std::move(coordinate));
    }
  const StiffnessMatrix K = model.make_stiffness(cliques());
  blocks_ = K.rows().size();
  for (auto& actuator : actuators_) std::visit([&](auto& q) { q.bind(K); }, actuator);
}

std::vector<std::vector<int>> Constraints::cliques() const {
  std::vector<std::vector<int>> result;
  for (const auto& actuator : actuators_)
    for (auto& clique : std::visit([](const auto& q) { return q.cliques(); }, actuator))
      result.push_back(std::move(clique));
  return result;
}

std::vector<std::vector<int>> Constraints::actuator_nodes() const { return nodes_of(actuators_); }
std::vector<std::vector<int>> Constraints::effector_nodes() const { return nodes_of(effectors_); }

void Constraints::displacement(const Eigen::VectorXd& x, Eigen::VectorXd& delta_a) const {
  delta_a.resize(actuators());
  for (int a = 0; a < actuators(); ++a) delta_a[a] = value(actuators_[a], x) - rest_[a];
}

Eigen::VectorXd Constraints::displacement(const Eigen::VectorXd& x) const {
  Eigen::VectorXd delta_a;
  displacement(x, delta_a);
  return delta_a;
}

void Constraints::actuator_directions(const Eigen::VectorXd& x, Eigen::Ref<Eigen::MatrixXd> J_aT) const {
  gradients(actuators_, x, J_aT);
}

void Constraints::effector_position(const Eigen::VectorXd& x, Eigen::VectorXd& p_e) const {
  p_e.resize(effector_coordinates());
  for (int r = 0; r < effector_coordinates(); ++r) p_e[r] = value(effectors_[r], x);
}

Eigen::VectorXd Constraints::effector_position(const Eigen::VectorXd& x) const {
  Eigen::VectorXd p_e;
  effector_position(x, p_e);
  return p_e;
}

void Constraints::effector_directions(const Eigen::VectorXd& x, Eigen::Ref<Eigen::MatrixXd> J_eT) const {
  gradients(effectors_, x, J_eT);
}

void Constraints::add_stiffness(const Eigen::VectorXd& x, const Eigen::VectorXd& lambda, Tangent tangent,
                                StiffnessMatrix& K) const {
  if (K.rows().size() != blocks_)
    throw std::invalid_argument("the stiffness matrix was not made with the cliques of these constraints");
  for (int a = 0; a < actuators(); ++a)
    std::visit([&](const auto& q) { q.add_hessian(x, -lambda[a], tangent, K); }, actuators_[a]);
}

}  // namespace tendril::fem
