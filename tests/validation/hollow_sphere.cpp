// SPDX-License-Identifier: Apache-2.0
#include "tests/validation/hollow_sphere.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

namespace tendril::validation {
namespace {

using Eigen::Vector3d;

/// A triangulated unit sphere.
struct Sphere {
  std::vector<Vector3d> points;
  std::vector<std::array<int, 3>> triangles;
};

/// The twelve corners lie on three golden rectangles; its faces are the twenty triples at the distance of an
/// edge.
Sphere icosahedron() {
  Sphere sphere;
  const double golden = (1 + std::sqrt(5)) / 2;
  for (double a : {-1.0, 1.0})
    for (double b : {-golden, golden})
      for (const Vector3d& p : {Vector3d(0, a, b), Vector3d(a, b, 0), Vector3d(b, 0, a)})
        sphere.points.push_back(p);
  const auto near = [&](int i, int j) {
    return (sphere.points[i] - sphere.points[j]).norm() < 2.1;
  };  // edges: 2
  for (int i = 0; i < 12; ++i)
    for (int j = i + 1; j < 12; ++j)
      for (int k = j + 1; k < 12; ++k) {
        if (!near(i, j) || !near(j, k) || !near(i, k)) continue;
        const auto& p = sphere.points;
        const bool outward = (p[j] - p[i]).cross(p[k] - p[i]).dot(p[i]) > 0;
        sphere.triangles.push_back(outward ? std::array{i, j, k} : std::array{i, k, j});
      }
  return sphere;
}

Sphere subdivided(const Sphere& coarse, int frequency) {
  Sphere fine;
  std::map<std::array<long, 3>, int> known;  // points on edges are met twice
  const auto add = [&](const Vector3d& p) {
    const std::array key{std::lround(1e6 * p.x()), std::lround(1e6 * p.y()), std::lround(1e6 * p.z())};
    const auto [at, is_new] = known.emplace(key, static_cast<int>(fine.points.size()));
    if (is_new) fine.points.push_back(p.normalized());
    return at->second;
  };
  for (const auto& [a, b, c] : coarse.triangles) {
    const Vector3d origin = coarse.points[a];
    const Vector3d u = (coarse.points[b] - origin) / frequency, v = (coarse.points[c] - origin) / frequency;
    const auto point = [&](int i, int j) { return add(origin + i * u + j * v); };
    for (int i = 0; i < frequency; ++i)
      for (int j = 0; i + j < frequency; ++j) {
        fine.triangles.push_back({point(i, j), point(i + 1, j), point(i, j + 1)});
        if (i + j + 1 < frequency)
          fine.triangles.push_back({point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)});
      }
  }
  return fine;
}

}  // namespace

HollowSphere hollow_sphere(const std::vector<double>& radii, int frequency) {
  const Sphere sphere = subdivided(icosahedron(), frequency);
  const int n = static_cast<int>(sphere.points.size());
  const int layers = static_cast<int>(radii.size());
  HollowSphere body{radii, n, sphere.triangles, {}};
  body.mesh.nodes.resize(3, layers * n);
  for (int k = 0; k < layers; ++k)
    for (int s = 0; s < n; ++s) body.mesh.nodes.col(k * n + s) = radii[k] * sphere.points[s];
  // Diagonals go from the lower number below to the higher one above, so that neighbouring prisms match.
  for (int k = 0; k + 1 < layers; ++k)
    for (auto corner : sphere.triangles) {
      std::sort(corner.begin(), corner.end());
      const int a = k * n + corner[0], b = k * n + corner[1], c = k * n + corner[2];
      for (std::array<int, 4> tet :
           {std::array{a, b, c, c + n}, {a, b, b + n, c + n}, {a, a + n, b + n, c + n}}) {
        const auto p = [&](int i) { return Vector3d(body.mesh.nodes.col(tet[i])); };
        if (fem::signed_volume(p(0), p(1), p(2), p(3)) < 0) std::swap(tet[2], tet[3]);
        body.mesh.tets.push_back(tet);
      }
    }
  return body;
}

}  // namespace tendril::validation
