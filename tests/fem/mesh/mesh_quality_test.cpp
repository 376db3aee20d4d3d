// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/mesh_quality.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "tests/fem/body/bodies.h"

namespace tendril::fem::mesh_quality_test {

using Catch::Matchers::Contains;

constexpr double kDegree = std::numbers::pi / 180;

Mesh single(const Eigen::Matrix<double, 3, 4>& corners) {
  Mesh mesh;
  mesh.nodes = corners;
  mesh.tets = {{0, 1, 2, 3}};
  return mesh;
}

TEST_CASE("A regular tetrahedron has the mean ratio 1 and angles of acos(1/3), whatever its size", "[law]") {
  Eigen::Matrix<double, 3, 4> corners;
  corners << 1, 1, -1, -1,  //
      1, -1, -1, 1,         //
      1, -1, 1, -1;
  const Quality quality = mesh_quality(single(0.007 * corners));
  CHECK(quality.mean_ratio_min == Approx(1));
  CHECK(quality.dihedral_min == Approx(std::acos(1.0 / 3)));
  CHECK(quality.dihedral_max == Approx(std::acos(1.0 / 3)));
  CHECK(quality.edge_ratio_max == Approx(1));
  CHECK(quality.slivers == 0);
}

TEST_CASE("The corner of a cube has the quality that its edges and volume give", "[law]") {
  // Edges 1, 1, 1, √2, √2, √2 and V = 1/6: η = 12 (1/2)^(2/3) / 9; the slanted face meets the others at
  // acos(1/√3).
  Eigen::Matrix<double, 3, 4> corners;
  corners << 0, 1, 0, 0,  //
      0, 0, 1, 0,         //
      0, 0, 0, 1;
  const Quality quality = mesh_quality(single(corners));
  CHECK(quality.mean_ratio_min == Approx(12 * std::pow(0.5, 2.0 / 3) / 9));
  CHECK(quality.dihedral_min == Approx(std::acos(1 / std::sqrt(3.0))));
  CHECK(quality.dihedral_max == Approx(90 * kDegree));
  CHECK(quality.edge_ratio_max == Approx(std::sqrt(2.0)));
}

TEST_CASE("A sliver is named with its number and place", "[unit]") {
  Mesh mesh = testing::beam(3, 1, 1, 0.01);
  const int sliver = mesh.tet_count();
  Eigen::Matrix<double, 3, 4> corners;    // near a square of 10 mm around (105, 5, 0) mm
  corners << 0.100, 0.110, 0.110, 0.100,  //
      0, 0, 0.010, 0.010,                 //
      -5e-5, 5e-5, -5e-5, 5e-5;
  mesh.nodes.conservativeResize(Eigen::NoChange, mesh.node_count() + 4);
  mesh.nodes.rightCols<4>() = corners;
  const int first = mesh.node_count() - 4;
  mesh.tets.push_back({first, first + 1, first + 2, first + 3});
  if (signed_volume(corners.col(0), corners.col(1), corners.col(2), corners.col(3)) < 0)
    std::swap(mesh.tets.back()[2], mesh.tets.back()[3]);

  CHECK_NOTHROW(check(mesh));
  const Quality quality = mesh_quality(mesh);
  CHECK(quality.slivers == 1);
  REQUIRE(quality.worst.size() == 5);
  CHECK(quality.worst[0].tet == sliver);
  CHECK(quality.worst[0].mean_ratio == quality.mean_ratio_min);
  CHECK(quality.worst[1].mean_ratio > kSliver);
  CHECK((quality.worst[0].centre - Eigen::Vector3d(0.105, 0.005, 0)).norm() < 1e-9);
  CHECK(quality.dihedral_max > 175 * kDegree);
  CHECK(quality.mean_ratio_median == Approx(mesh_quality(testing::beam(3, 1, 1, 0.01)).mean_ratio_median));
  CHECK_THAT(summary(quality), Contains("1 slivers") && Contains("tetrahedron 18 at (105, 5, "));
}

}  // namespace tendril::fem::mesh_quality_test
