// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/surface.h"

#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>

#include "tests/fem/body/chamber.h"

namespace tendril::fem::surface_test {

using Catch::Matchers::Contains;
using testing::Chamber;

struct Measures {
  double volume = 0;                                      // m³, positive inside
  double area = 0;                                        // m²
  Eigen::Vector3d vector_area = Eigen::Vector3d::Zero();  // m²
};

Measures measures(const Mesh& mesh, const std::vector<Face>& surface) {
  Measures result;
  for (const auto& [a, b, c] : surface) {
    const Eigen::Vector3d p = mesh.nodes.col(a);
    const Eigen::Vector3d normal = (mesh.nodes.col(b) - p).cross(mesh.nodes.col(c) - p) / 2;
    result.volume += p.dot(normal) / 3;
    result.area += normal.norm();
    result.vector_area += normal;
  }
  return result;
}

TEST_CASE("The nodes of faces come once each, in the order of the faces", "[unit]") {
  CHECK(nodes_of({{4, 0, 2}, {2, 0, 3}}) == std::vector<int>{4, 0, 2, 3});
  CHECK(nodes_of({}).empty());
}

TEST_CASE("The boundary of a block is closed, looks outward and encloses its volume", "[law]") {
  const Mesh mesh = testing::beam(3, 2, 2, 0.01);
  const auto surface = boundary(mesh);
  const Measures m = measures(mesh, surface);
  CHECK_NOTHROW(check_closed(mesh, surface));
  CHECK(m.volume == Approx(12e-6));
  CHECK(m.area == Approx(32e-4));
  CHECK(m.vector_area.norm() < 1e-15);
}

TEST_CASE("All faces of a tetrahedron look outward", "[law]") {
  Mesh mesh;
  mesh.nodes = Eigen::Matrix<double, 3, 4>{{0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  mesh.tets = {{0, 1, 2, 3}};
  const Eigen::Vector3d inside = Eigen::Vector3d::Constant(0.25);
  const auto surface = boundary(mesh);
  CHECK(surface.size() == 4);
  for (const auto& [a, b, c] : surface)
    CHECK(signed_volume(mesh.nodes.col(a), mesh.nodes.col(b), mesh.nodes.col(c), inside) < 0);
}

TEST_CASE("A cavity's wall looks into the cavity and encloses it, in whichever order its nodes are named",
          "[law]") {
  const Chamber chamber;
  auto nodes = chamber.mesh.regions.at("cavity");
  std::mt19937 random(5);
  std::shuffle(nodes.begin(), nodes.end(), random);
  const auto wall = closed_surface(chamber.mesh, nodes);
  const Measures m = measures(chamber.mesh, wall);
  CHECK(m.volume == Approx(-Chamber::kVolume));
  CHECK(enclosed_volume(chamber.mesh, wall) == Approx(Chamber::kVolume));
  CHECK(m.area == Approx(10e-4));
  CHECK(m.vector_area.norm() < 1e-15);
}

TEST_CASE("A wall that lacks a node is refused with a place where it is open", "[unit]") {
  const Chamber chamber;
  std::vector<int> nodes = chamber.mesh.regions.at("cavity");
  const Eigen::Vector3d lost(0.005, 0.010, 0.010);
  std::erase_if(nodes, [&](int node) { return (chamber.mesh.nodes.col(node) - lost).norm() < 1e-6; });
  // The faces around the lost node leave a hole of six edges, all of them in its plane.
  CHECK_THROWS_WITH(closed_surface(chamber.mesh, nodes), Contains("open at 6 of its edges") &&
                                                             Contains("near (5, ") &&
                                                             Contains("close its air inlet"));
}

TEST_CASE("Nodes that enclose no cavity are refused", "[unit]") {
  const Chamber chamber;
  CHECK_THROWS_WITH(closed_surface(chamber.mesh, {0, 1}), Contains("among the 2 nodes"));
  CHECK_THROWS_WITH(check_closed(chamber.mesh, {}), Contains("has no faces"));
  std::vector<int> all(chamber.mesh.node_count());
  for (int i = 0; i < chamber.mesh.node_count(); ++i) all[i] = i;
  CHECK_THROWS_WITH(closed_surface(chamber.mesh, all), Contains("outside of the body"));
}

TEST_CASE("A region may name two cavities, which then are one", "[law]") {
  const double size = 0.005, tiny = Chamber::kTiny;
  const Mesh solid = testing::beam(5, 3, 3, size);
  const auto cube = [&](double x) {
    return Box{{x - tiny, size - tiny, size - tiny}, {x + size + tiny, 2 * size + tiny, 2 * size + tiny}};
  };
  Mesh mesh = testing::hollowed(testing::hollowed(solid, cube(size), "first"), cube(3 * size), "second");
  std::vector<int> both = mesh.regions.at("second");
  for (int node : nodes_in(mesh, cube(size))) both.push_back(node);
  CHECK(measures(mesh, closed_surface(mesh, both)).volume == Approx(-2 * size * size * size));
}

}  // namespace tendril::fem::surface_test
