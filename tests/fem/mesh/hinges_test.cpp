// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/hinges.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "tests/fem/body/bodies.h"
#include "tests/fem/mesh/mesh_files.h"

namespace tendril::fem::hinges_test {

using Catch::Matchers::Contains;

/// Cubes of 10 mm at these places (in cubes), with the nodes at common corners shared.
Mesh cubes(const std::vector<Eigen::Vector3d>& places) {
  const Mesh cube = testing::beam(1, 1, 1, 0.01);
  Mesh mesh;
  mesh.nodes.resize(3, 0);
  for (const Eigen::Vector3d& place : places) {
    std::vector<int> number;
    for (const auto& corner : cube.nodes.colwise()) {
      const Eigen::Vector3d p = corner + 0.01 * place;
      int node = 0;
      while (node < mesh.node_count() && (mesh.nodes.col(node) - p).norm() > 1e-9) ++node;
      if (node == mesh.node_count()) {
        mesh.nodes.conservativeResize(Eigen::NoChange, node + 1);
        mesh.nodes.col(node) = p;
      }
      number.push_back(node);
    }
    for (const auto& tet : cube.tets)
      mesh.tets.push_back({number[tet[0]], number[tet[1]], number[tet[2]], number[tet[3]]});
  }
  return mesh;
}

/// What is said of these cubes where the nodes in this box, in cubes, are fixed.
std::string refusal(const std::vector<Eigen::Vector3d>& places, const Eigen::Vector3d& lower,
                    const Eigen::Vector3d& upper) {
  const Mesh mesh = cubes(places);
  const auto fixed = nodes_in(mesh, Box{0.01 * lower, 0.01 * upper});
  return testing::refusal([&] { check_hinges(mesh, fixed); });
}

TEST_CASE("A part that hangs by a node or by an edge is refused with its place", "[unit]") {
  const Eigen::Vector3d far(9, 9, 0);  // of the box of the base
  CHECK_THAT(refusal({{0, 0, 0}, {1, 1, 1}}, {0, 0, 0}, far),
             Contains("hangs on the rest by the node at (10, 10, 10) mm only"));
  CHECK_THAT(refusal({{0, 0, 0}, {1, 0, 1}}, {0, 0, 0}, far),
             Contains("hangs on the rest by the edge from (10, ") && Contains("10, 10) mm only"));
  CHECK_THAT(refusal({{0, 0, 0}, {1, 0, 1}, {0, 0, 2}}, {0, 0, 0}, far),
             Contains("the body has 2 such places"));
  CHECK_THAT(refusal({{0, 0, 0}, {1, 0, 1}}, {0, 0, 0}, far),
             Contains("part of the body with tetrahedron 7 at (12.5, 7.5, 15) mm"));
}

TEST_CASE("A part of a closed ring of hinges is refused with both of its edges", "[unit]") {
  // Each tetrahedron has one edge in common with the one before and one with the next: edges along the ring's
  // axis and across it in turn.
  for (const int number : {4, 6, 8, 24}) {
    CAPTURE(number);
    Mesh ring;
    ring.nodes.resize(3, 2 * number);
    for (int k = 0; k < number; ++k) {
      const double angle = 2 * M_PI * k / number;
      const Eigen::Vector3d outward(std::cos(angle), std::sin(angle), 0);
      const Eigen::Vector3d along = k % 2 == 0 ? outward : Eigen::Vector3d::UnitZ();
      ring.nodes.col(2 * k) = 0.1 * outward - 0.01 * along;
      ring.nodes.col(2 * k + 1) = 0.1 * outward + 0.01 * along;
      const int next = (k + 1) % number;
      ring.tets.push_back({2 * k, 2 * k + 1, 2 * next, 2 * next + 1});
    }
    for (auto& tet : ring.tets)
      if (signed_volume(ring.nodes.col(tet[0]), ring.nodes.col(tet[1]), ring.nodes.col(tet[2]),
                        ring.nodes.col(tet[3])) < 0)
        std::swap(tet[0], tet[1]);
    REQUIRE_NOTHROW(check(ring));
    const std::vector<int> first(ring.tets[0].begin(), ring.tets[0].end());
    const std::string said = testing::refusal([&] { check_hinges(ring, first); });
    CHECK_THAT(said, Contains("hangs on the rest by the edge from") && Contains(" and the edge from") &&
                         Contains(fmt::format("the body has {} such places", number)));
    // The same with nodes of an edge fixed alone: then the ring as a whole can turn, too.
    CHECK_THAT(testing::refusal([&] {
                 check_hinges(ring, std::vector<int>{0, 1});
               }),
               Contains("the edge from"));
    std::vector<int> all(2 * number);
    std::iota(all.begin(), all.end(), 0);
    CHECK(testing::refusal([&] { check_hinges(ring, all); }) == "no error");
  }
}

TEST_CASE("Parts of which each is held are not hinged", "[unit]") {
  CHECK(refusal({{0, 0, 0}, {1, 0, 0}}, {0, 0, 0}, {0, 1, 1}) == "no error");  // a common face
  CHECK(refusal({{0, 0, 0}, {1, 0, 1}}, {0, 0, 0}, {2, 1, 2}) == "no error");  // all fixed
  CHECK(refusal({{0, 0, 0}, {1, 1, 0}}, {0, 0, 0}, {2, 2, 0}) == "no error");  // both stand on the ground
  CHECK(refusal({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 1}, {1, 1, 1}}, {0, 0, 0}, {0, 1, 1}) == "no error");
  // A cube whose corners rest on three others that are held.
  CHECK(refusal({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {1, 1, 1}}, {0, 0, 0}, {3, 3, 0}) == "no error");
  CHECK_THAT(refusal({{0, 0, 0}, {2, 0, 0}, {1, 1, 1}}, {0, 0, 0}, {3, 3, 0}),
             Contains("hangs on the rest by the edge"));
}

TEST_CASE("The model refuses a body with a hinge", "[unit]") {
  Mesh mesh = cubes({{0, 0, 0}, {1, 0, 1}});
  mesh.regions["base"] = nodes_in(mesh, Box{{0, 0, 0}, {0.01, 0.01, 0}});
  CHECK_NOTHROW(check(mesh));
  CHECK_THAT(testing::refusal([&] { testing::beam_model(mesh); }), Contains("hangs on the rest by the edge"));
}

}  // namespace tendril::fem::hinges_test
