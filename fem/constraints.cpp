#include "fem/constraints.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <stdexcept>

namespace tendril::fem {
namespace {

// A segment shorter than this has no direction: its ends have met.
constexpr double kShortest = 1e-6;  // m

/// A node's share in the vector from one end of a segment to the other.
struct Share {
  int node;
  double weight;
};

std::vector<Share> shares(const CablePoint& from, const CablePoint& to, int free_nodes) {
  std::vector<Share> result;
  const auto add = [&](const CablePoint& point, double sign) {
    const auto* body = std::get_if<Attachment>(&point);
    for (int k = 0; body && k < 4; ++k)
      if (body->nodes[k] < free_nodes && body->weights[k] != 0)
        result.push_back({body->nodes[k], sign * body->weights[k]});
  };
  add(from, -1);
  add(to, +1);
  return result;
}

}  // namespace

Constraints::Constraints(const Model& model, std::vector<Cable> cables, std::vector<Effector> effectors)
    : model_(model), cables_(std::move(cables)), effectors_(std::move(effectors)) {
  rest_lengths_.resize(actuators());
  for (int a = 0; a < actuators(); ++a) {
    const auto& points = cables_[a].points;
    if (points.size() < 2)
      throw std::invalid_argument(fmt::format("cable {} has {} points, expected two", a, points.size()));
    for (size_t k = 1; k < points.size(); ++k)
      if ((place(model.rest(), points[k]) - place(model.rest(), points[k - 1])).norm() < kShortest)
        throw std::invalid_argument(fmt::format("points {} and {} of cable {} coincide", k - 1, k, a));
    bool moves = false;
    for (size_t k = 1; k < points.size(); ++k)
      moves = moves || !shares(points[k - 1], points[k], model.free_nodes()).empty();
    if (!moves) throw std::invalid_argument(fmt::format("cable {} is attached to fixed nodes only", a));
    rest_lengths_[a] = length(model.rest(), cables_[a]);
  }
  for (size_t effector = 0; effector < effectors_.size(); ++effector) {
    const CablePoint point = effectors_[effector].at;
    if (shares(point, Eigen::Vector3d(Eigen::Vector3d::Zero()), model.free_nodes()).empty())
      throw std::invalid_argument(fmt::format("effector {} is attached to fixed nodes only", effector));
    for (int axis = 0; axis < 3; ++axis)
      if (effectors_[effector].controlled[axis]) rows_.push_back({static_cast<int>(effector), axis});
  }
}

std::vector<std::vector<int>> Constraints::cliques() const {
  std::vector<std::vector<int>> result;
  for (const auto& cable : cables_)
    for (size_t k = 1; k < cable.points.size(); ++k) {
      std::vector<int> nodes;
      for (const auto& share : shares(cable.points[k - 1], cable.points[k], model_.free_nodes()))
        nodes.push_back(share.node);
      result.push_back(nodes);
    }
  return result;
}

Eigen::Vector3d Constraints::place(const Eigen::VectorXd& x, const CablePoint& point) const {
  if (const auto* body = std::get_if<Attachment>(&point)) return model_.position(x, *body);
  return std::get<Eigen::Vector3d>(point);
}

double Constraints::length(const Eigen::VectorXd& x, const Cable& cable) const {
  double sum = 0;
  for (size_t k = 1; k < cable.points.size(); ++k)
    sum += (place(x, cable.points[k]) - place(x, cable.points[k - 1])).norm();
  return sum;
}

Eigen::VectorXd Constraints::shortening(const Eigen::VectorXd& x) const {
  Eigen::VectorXd delta_a = rest_lengths_;
  for (int a = 0; a < actuators(); ++a) delta_a[a] -= length(x, cables_[a]);
  return delta_a;
}

void Constraints::actuator_directions(const Eigen::VectorXd& x, Eigen::Ref<Eigen::MatrixXd> J_aT) const {
  J_aT.setZero();
  for (int a = 0; a < actuators(); ++a)
    for (size_t k = 1; k < cables_[a].points.size(); ++k) {
      const auto& from = cables_[a].points[k - 1];
      const auto& to = cables_[a].points[k];
      const Eigen::Vector3d segment = place(x, to) - place(x, from);
      if (segment.norm() < kShortest) continue;
      const Eigen::Vector3d u = segment.normalized();
      for (const auto& share : shares(from, to, model_.free_nodes()))
        J_aT.col(a).segment<3>(3 * share.node) -= share.weight * u;
    }
}

Eigen::VectorXd Constraints::effector_position(const Eigen::VectorXd& x) const {
  Eigen::VectorXd p(effector_coordinates());
  for (int r = 0; r < effector_coordinates(); ++r)
    p[r] = model_.position(x, effectors_[rows_[r].effector].at)[rows_[r].axis];
  return p;
}

Eigen::MatrixXd Constraints::effector_displacement(const Eigen::MatrixXd& Y) const {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(effector_coordinates(), Y.cols());
  for (int r = 0; r < effector_coordinates(); ++r) {
    const Attachment& at = effectors_[rows_[r].effector].at;
    for (int k = 0; k < 4; ++k)
      if (at.nodes[k] < model_.free_nodes())
        result.row(r) += at.weights[k] * Y.row(3 * at.nodes[k] + rows_[r].axis);
  }
  return result;
}

void Constraints::add_cable_stiffness(const Eigen::VectorXd& x, const Eigen::VectorXd& lambda,
                                      StiffnessMatrix& K) const {
  for (int a = 0; a < actuators(); ++a)
    for (size_t k = 1; k < cables_[a].points.size(); ++k) {
      const auto& from = cables_[a].points[k - 1];
      const auto& to = cables_[a].points[k];
      const Eigen::Vector3d segment = place(x, to) - place(x, from);
      const double L = segment.norm();
      if (L < kShortest) continue;
      const Eigen::Vector3d u = segment / L;
      const Eigen::Matrix3d across = (lambda[a] / L) * (Eigen::Matrix3d::Identity() - u * u.transpose());
      const auto nodes = shares(from, to, model_.free_nodes());
      for (const auto& i : nodes)
        for (const auto& j : nodes)
          if (i.node >= j.node) K.add(K.slot(i.node, j.node), (i.weight * j.weight) * across);
    }
}

}  // namespace tendril::fem
