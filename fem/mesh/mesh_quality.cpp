// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/mesh_quality.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "fem/mesh/format_point.h"

namespace tendril::fem {
namespace {

constexpr size_t kWorstNamed = 5;
constexpr double kDegrees = 180 / std::numbers::pi;

struct Edges {
  double sum_of_squares = 0, shortest = INFINITY, longest = 0;
};

Edges edges_of(const Eigen::Matrix<double, 3, 4>& p) {
  Edges edges;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) {
      const double length = (p.col(i) - p.col(j)).norm();
      edges.sum_of_squares += length * length;
      edges.shortest = std::min(edges.shortest, length);
      edges.longest = std::max(edges.longest, length);
    }
  return edges;
}

/// Widens [least, greatest] by the six dihedral angles. The gradient of a barycentric coordinate is normal to
/// the face opposite its corner and points inwards.
void add_dihedral_angles(const Eigen::Matrix<double, 3, 4>& p, double& least, double& greatest) {
  Eigen::Matrix3d sides;
  for (int i = 0; i < 3; ++i) sides.col(i) = p.col(i + 1) - p.col(0);
  Eigen::Matrix<double, 4, 3> normals;
  normals.bottomRows<3>() = sides.inverse();
  normals.row(0) = -normals.bottomRows<3>().colwise().sum();
  normals.rowwise().normalize();
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) {
      const double angle = std::acos(std::clamp(-normals.row(i).dot(normals.row(j)), -1.0, 1.0));
      least = std::min(least, angle);
      greatest = std::max(greatest, angle);
    }
}

}  // namespace

Quality mesh_quality(const Mesh& mesh) {
  Quality quality;
  quality.dihedral_min = std::numbers::pi;
  std::vector<Quality::Element> elements;
  for (int t = 0; t < mesh.tet_count(); ++t) {
    const Eigen::Matrix<double, 3, 4> p = mesh.nodes(Eigen::all, mesh.tets[t]);
    const Edges edges = edges_of(p);
    const double volume = signed_volume(p.col(0), p.col(1), p.col(2), p.col(3));
    elements.push_back({t, 12 * std::pow(3 * volume, 2.0 / 3) / edges.sum_of_squares, p.rowwise().mean()});
    quality.edge_ratio_max = std::max(quality.edge_ratio_max, edges.longest / edges.shortest);
    add_dihedral_angles(p, quality.dihedral_min, quality.dihedral_max);
  }
  std::stable_sort(elements.begin(), elements.end(),
                   [](const auto& a, const auto& b) { return a.mean_ratio < b.mean_ratio; });
  quality.mean_ratio_min = elements.front().mean_ratio;
  quality.mean_ratio_median = elements[elements.size() / 2].mean_ratio;
  quality.slivers = static_cast<int>(
      std::count_if(elements.begin(), elements.end(), [](const auto& e) { return e.mean_ratio < kSliver; }));
  elements.resize(std::min(elements.size(), kWorstNamed));
  quality.worst = std::move(elements);
  return quality;
}

std::string summary(const Quality& quality) {
  std::string line = fmt::format(
      "mean ratio: worst {:.2f}, median {:.2f}; dihedral angles: {:.1f}° to {:.1f}°", quality.mean_ratio_min,
      quality.mean_ratio_median, kDegrees * quality.dihedral_min, kDegrees * quality.dihedral_max);
  if (quality.slivers == 0) return line;
  const auto& [tet, mean_ratio, centre] = quality.worst.front();
  return line + fmt::format(
                    "; {} slivers (mean ratio below {}), the worst is tetrahedron {} at {}: "
                    "mesh the body again with a quality bound",
                    quality.slivers, kSliver, tet, format_point_mm(centre));
}

}  // namespace tendril::fem
