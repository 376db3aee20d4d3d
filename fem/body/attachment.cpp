// SPDX-License-Identifier: Apache-2.0
#include "fem/body/attachment.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <limits>

#include "fem/element/tetrahedron.h"
#include "fem/mesh/format_point.h"

namespace tendril::fem {
namespace {

// Points on the surface count as inside in spite of rounding.
constexpr double kRounding = 1e-9;

// A point farther outside a tetrahedron than the tetrahedron is high has a weight below this.
constexpr double kFarthest = -1;

Eigen::Vector4d barycentric(const Corners& p, const Eigen::Vector3d& point) {
  const auto g = rest_tetrahedron(p).g;
  Eigen::Vector4d weights = g.transpose() * (point - p.col(0));
  weights[0] += 1;
  return weights;
}

Eigen::Vector3d nearest_on_segment(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                   const Eigen::Vector3d& p) {
  const double t = (p - a).dot(b - a) / (b - a).squaredNorm();
  return a + std::clamp(t, 0.0, 1.0) * (b - a);
}

Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                    const Eigen::Vector3d& c, const Eigen::Vector3d& p) {
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  Eigen::Vector3d foot = p - normal * ((p - a).dot(normal) / normal.squaredNorm());
  const auto left_of = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return (to - from).cross(foot - from).dot(normal) >= 0;
  };
  if (left_of(a, b) && left_of(b, c) && left_of(c, a)) return foot;
  Eigen::Vector3d nearest = nearest_on_segment(a, b, p);
  for (const auto& candidate : {nearest_on_segment(b, c, p), nearest_on_segment(c, a, p)})
    if ((candidate - p).squaredNorm() < (nearest - p).squaredNorm()) nearest = candidate;
  return nearest;
}

/// The point of a tetrahedron's surface that is nearest to a point outside it.
Eigen::Vector3d nearest_on_surface(const Corners& p, const Eigen::Vector3d& point) {
  Eigen::Vector3d nearest = p.col(0);
  for (const auto& [a, b, c] : {std::array{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}}) {
    const Eigen::Vector3d candidate = nearest_on_triangle(p.col(a), p.col(b), p.col(c), point);
    if ((candidate - point).squaredNorm() < (nearest - point).squaredNorm()) nearest = candidate;
  }
  return nearest;
}

}  // namespace

Attachment attach(const Mesh& mesh, const Eigen::Vector3d& point, double snap) {
  double best_distance = std::numeric_limits<double>::infinity();
  Eigen::Vector3d nearest = Eigen::Vector3d::Zero();
  Attachment best{};
  for (const auto& tet : mesh.tets) {
    const Corners p = mesh.nodes(Eigen::all, tet);
    const Eigen::Vector4d weights = barycentric(p, point);
    const bool inside = weights.minCoeff() >= -kRounding;
    const Eigen::Vector3d place = inside ? point : nearest_on_surface(p, point);
    const double distance = (place - point).norm();
    if (distance < best_distance) {
      best_distance = distance;
      nearest = place;
      const Eigen::Vector4d w = weights.minCoeff() < kFarthest ? barycentric(p, place) : weights;
      best = {tet, {w[0], w[1], w[2], w[3]}};
    }
    if (inside) break;
  }
  if (best_distance > snap) {
    throw MeshError(
        fmt::format("the point {} lies {:.3g} mm outside the mesh; the nearest point of the body is {}",
                    format_point_mm(point), 1e3 * best_distance, format_point_mm(nearest)));
  }
  return best;
}

}  // namespace tendril::fem
