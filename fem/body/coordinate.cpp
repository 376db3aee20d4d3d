// SPDX-License-Identifier: Apache-2.0
#include "fem/body/coordinate.h"

#include <Eigen/Dense>
#include <algorithm>

#include "fem/element/tetrahedron.h"

namespace tendril::fem {
namespace {

// A shorter segment has no direction.
constexpr double kMinSegmentLength = 1e-6;  // m

}  // namespace

void LinearVector::add(const Model& model, const CablePoint& point, double weight) {
  const auto* body = std::get_if<Attachment>(&point);
  if (!body) {
    constant_ += weight * std::get<Eigen::Vector3d>(point);
    return;
  }
  for (int k = 0; k < 4; ++k) {
    const int node = body->nodes[k];
    const double share = weight * body->weights[k];
    if (node >= model.free_nodes()) constant_ += share * model.mesh().nodes.col(node);
    if (node >= model.free_nodes() || share == 0) continue;
    const auto at = std::find_if(terms_.begin(), terms_.end(), [&](auto& s) { return s.node <= node; });
    if (at != terms_.end() && at->node == node)
      at->weight += share;
    else
      terms_.insert(at, {node, share});
  }
}

Eigen::Vector3d LinearVector::at(const Eigen::VectorXd& x) const {
  Eigen::Vector3d v = constant_;
  for (const Term& term : terms_) v += term.weight * x.segment<3>(3 * term.node);
  return v;
}

void LinearVector::add_gradient(const Eigen::Vector3d& u, Eigen::Ref<Eigen::VectorXd> g) const {
  for (const Term& term : terms_) g.segment<3>(3 * term.node) += term.weight * u;
}

std::vector<int> LinearVector::nodes() const {
  std::vector<int> result;
  for (const Term& term : terms_) result.push_back(term.node);
  return result;
}

Projection::Projection(LinearVector point, const Eigen::Vector3d& direction)
    : point_(std::move(point)), direction_(direction) {}

Length::Length(const Model& model, const std::vector<CablePoint>& points, double sign) : sign_(sign) {
  for (size_t k = 1; k < points.size(); ++k) {
    Segment segment;
    segment.span.add(model, points[k], 1);
    segment.span.add(model, points[k - 1], -1);
    segments_.push_back(std::move(segment));
  }
}

double Length::value(const Eigen::VectorXd& x) const {
  double sum = 0;
  for (const Segment& segment : segments_) sum += segment.span.at(x).norm();
  return sign_ * sum;
}

void Length::add_gradient(const Eigen::VectorXd& x, Eigen::Ref<Eigen::VectorXd> g) const {
  for (const Segment& segment : segments_) {
    const Eigen::Vector3d span = segment.span.at(x);
    const double L = span.norm();
    if (L >= kMinSegmentLength) segment.span.add_gradient(sign_ / L * span, g);
  }
}

void Length::add_hessian(const Eigen::VectorXd& x, double scale, Tangent tangent, StiffnessMatrix& K) const {
  const double force = sign_ * scale;
  if (force == 0 || (force < 0 && tangent != Tangent::kExact)) return;
  for (const Segment& segment : segments_) {
    const Eigen::Vector3d span = segment.span.at(x);
    const double L = span.norm();
    if (L < kMinSegmentLength) continue;
    const Eigen::Vector3d u = span / L;
    const Eigen::Matrix3d across = (force / L) * (Eigen::Matrix3d::Identity() - u * u.transpose());
    const auto& terms = segment.span.terms();
    size_t pair = 0;
    for (size_t i = 0; i < terms.size(); ++i)
      for (size_t j = i; j < terms.size(); ++j)
        K.add(segment.slots[pair++], (terms[i].weight * terms[j].weight) * across);
  }
}

std::vector<std::vector<int>> Length::cliques() const {
  std::vector<std::vector<int>> result;
  for (const Segment& segment : segments_) result.push_back(segment.span.nodes());
  return result;
}

void Length::bind(const StiffnessMatrix& K) {
  for (Segment& segment : segments_) {
    const auto& terms = segment.span.terms();
    segment.slots.clear();
    for (size_t i = 0; i < terms.size(); ++i)
      for (size_t j = i; j < terms.size(); ++j) segment.slots.push_back(K.slot(terms[i].node, terms[j].node));
  }
}

std::vector<int> Length::nodes() const {
  std::vector<int> result;
  for (const auto& clique : cliques()) result.insert(result.end(), clique.begin(), clique.end());
  return result;
}

int Length::first_degenerate_segment(const Eigen::VectorXd& x) const {
  for (size_t k = 0; k < segments_.size(); ++k)
    if (segments_[k].span.at(x).norm() < kMinSegmentLength) return static_cast<int>(k);
  return -1;
}

Volume::Volume(const Model& model, std::vector<Face> surface) : model_(&model), surface_(std::move(surface)) {
  // Reversed, the faces are counter-clockwise seen from outside the cavity, as the sum over tetrahedra to the
  // origin expects.
  for (auto& face : surface_) std::swap(face[1], face[2]);
}

double Volume::value(const Eigen::VectorXd& x) const {
  double sum = 0;
  for (const auto& [a, b, c] : surface_)
    sum += model_->position(x, a).dot(model_->position(x, b).cross(model_->position(x, c)));
  return sum / 6;
}

void Volume::add_gradient(const Eigen::VectorXd& x, Eigen::Ref<Eigen::VectorXd> g) const {
  for (const auto& face : surface_)
    for (int k = 0; k < 3; ++k)
      if (face[k] < model_->free_nodes())
        g.segment<3>(3 * face[k]) +=
            model_->position(x, face[(k + 1) % 3]).cross(model_->position(x, face[(k + 2) % 3])) / 6;
}

void Volume::add_hessian(const Eigen::VectorXd& x, double scale, Tangent tangent, StiffnessMatrix& K) const {
  if (tangent != Tangent::kExact || scale == 0) return;
  for (size_t f = 0; f < surface_.size(); ++f)
    for (int k = 0; k < 3; ++k) {
      const int i = surface_[f][(k + 1) % 3], j = surface_[f][(k + 2) % 3];
      // 6 V contains x_k · (x_i × x_j) = −x_iᵀ [x_k]× x_j.
      const Eigen::Matrix3d block = cross_matrix((-scale / 6) * model_->position(x, surface_[f][k]));
      K.add(slots_[f][k], i > j ? block : block.transpose());
    }
}

void Volume::bind(const StiffnessMatrix& K) {
  slots_.resize(surface_.size());
  for (size_t f = 0; f < surface_.size(); ++f)
    for (int k = 0; k < 3; ++k) {
      const auto [j, i] = std::minmax(surface_[f][(k + 1) % 3], surface_[f][(k + 2) % 3]);
      slots_[f][k] = i < model_->free_nodes() ? K.slot(i, j) : K.discard_slot();
    }
}

std::vector<int> Volume::nodes() const {
  std::vector<int> result;
  for (const auto& face : surface_)
    std::copy_if(face.begin(), face.end(), std::back_inserter(result),
                 [this](int node) { return node < model_->free_nodes(); });
  return result;
}

}  // namespace tendril::fem
