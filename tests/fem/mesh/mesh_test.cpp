// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/mesh.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <numeric>

#include "tests/fem/body/bodies.h"
#include "tests/fem/mesh/mesh_files.h"

namespace tendril::fem::mesh_test {

using Catch::Matchers::Contains;

using testing::refusal;

TEST_CASE("A mesh that no model can stand on is refused with the culprits' numbers", "[unit]") {
  const Mesh good = testing::beam(2, 1, 1, 0.01);
  CHECK_NOTHROW(check(good));

  Mesh inverted = good;
  std::swap(inverted.tets[3][0], inverted.tets[3][1]);
  CHECK_THAT(refusal([&] { check(inverted); }), Contains("1 tetrahedra are inverted: tetrahedron 3 at ("));

  Mesh mirrored = good;
  for (auto& tet : mirrored.tets) std::swap(tet[2], tet[3]);
  CHECK_THAT(refusal([&] { check(mirrored); }),
             Contains("all 12 tetrahedra are inverted: the file numbers their corners the other way round"));

  Mesh flat = good;
  flat.tets.push_back({0, 1, 4, 4});
  CHECK_THAT(refusal([&] { check(flat); }), Contains("tetrahedra are flat: tetrahedron 12"));

  Mesh loose = good;
  loose.nodes.conservativeResize(Eigen::NoChange, good.node_count() + 1);
  loose.nodes.rightCols(1).setConstant(0.5);
  CHECK_THAT(refusal([&] { check(loose); }),
             Contains(fmt::format("1 nodes belong to no tetrahedron: node {} at (500", good.node_count())));

  Mesh wild = good;
  wild.tets[0][2] = 4711;
  CHECK_THAT(refusal([&] { check(wild); }), Contains("tetrahedron 0 names node 4711"));

  Mesh poisoned = good;
  poisoned.nodes(1, 5) = NAN;
  CHECK_THAT(refusal([&] { check(poisoned); }), Contains("not finite: node 5"));

  CHECK_THAT(refusal([] { check(Mesh{}); }), Contains("no tetrahedra"));
}

TEST_CASE("A tetrahedron is flat by its volume against its longest edge, in any size and place", "[unit]") {
  const double size = GENERATE(1e-3, 1.0, 1e3), place = GENERATE(0.0, 5.0);
  const auto said = [&](const Eigen::Vector3d& top) -> std::string {
    Mesh mesh;
    mesh.nodes.resize(3, 4);
    mesh.nodes << 0, 1, 0, top.x(), 0, 0, 1, top.y(), 0, 0, 0, top.z();
    mesh.nodes = (size * (mesh.nodes.array() + place)).eval();
    mesh.tets = {{0, 1, 2, 3}};
    try {
      check(mesh);
    } catch (const MeshError& error) {
      return error.what();
    }
    return "";
  };
  // Its volume is a sixth of the height, its longest edge the root of 2: flat up to a height of 1.70e-8.
  const auto at_height = [&](double height) { return Eigen::Vector3d(0.3, 0.3, height); };
  CHECK_THAT(said(at_height(1.6e-8)), Contains("1 tetrahedra are flat: tetrahedron 0"));
  CHECK_THAT(said(at_height(-1.6e-8)), Contains("1 tetrahedra are flat: tetrahedron 0"));
  CHECK(said(at_height(1.8e-8)) == "");
  CHECK_THAT(said(at_height(-1.8e-8)), Contains("tetrahedra are inverted"));
  // The longest edges may be those of any corner.
  CHECK_THAT(said({1000, 0, 0.9}), Contains("1 tetrahedra are flat: tetrahedron 0"));
  CHECK(said({100, 0, 0.9}) == "");
}

TEST_CASE("A tetrahedron whose corners are one node is flat", "[unit]") {
  Mesh mesh = testing::beam(2, 1, 1, 0.01);
  mesh.tets.push_back({4, 4, 4, 4});
  CHECK_THAT(refusal([&] { check(mesh); }), Contains("tetrahedra are flat: tetrahedron 12"));
}

TEST_CASE("Tetrahedra that do not fill space side by side are refused with their numbers", "[unit]") {
  const Mesh good = testing::beam(2, 1, 1, 0.01);

  Mesh twice = good;
  twice.tets.push_back({good.tets[4][1], good.tets[4][2], good.tets[4][0], good.tets[4][3]});
  CHECK_THAT(refusal([&] { check(twice); }),
             Contains("1 tetrahedra are in the mesh twice: tetrahedron 12 at ("));

  // A third tetrahedron on the face x = 10 mm between the two cubes, and one on a face of the boundary that
  // reaches into the body.
  const int nodes = good.node_count();
  Mesh crowded = good;
  crowded.nodes.conservativeResize(Eigen::NoChange, nodes + 1);
  crowded.nodes.rightCols<1>() = Eigen::Vector3d(0.02, 0.02, 0.02);
  crowded.tets.push_back({4, 6, 7, nodes});
  CHECK_THAT(refusal([&] { check(crowded); }),
             Contains("1 faces belong to more than two tetrahedra: the one of nodes 4, 6, 7 at (10, "));

  Mesh overlapping = good;
  overlapping.nodes.conservativeResize(Eigen::NoChange, nodes + 1);
  overlapping.nodes.rightCols<1>() = Eigen::Vector3d(0.005, 0.005, 0.005);
  overlapping.tets.push_back({0, 2, 3, nodes});
  CHECK_THAT(refusal([&] { check(overlapping); }),
             Contains("lie on the same side of their common face: ") && Contains("and tetrahedron 12 at ("));
}

TEST_CASE("Parts of a body that touch without sharing nodes are refused with the places", "[unit]") {
  const Mesh one = testing::beam(2, 1, 1, 0.01);
  const int n = one.node_count();
  const auto two_parts = [&](double apart) {
    Mesh two = one;
    two.nodes.conservativeResize(Eigen::NoChange, 2 * n);
    two.nodes.rightCols(n) = one.nodes.colwise() + Eigen::Vector3d(0.02 + apart, 0, 0);
    for (auto tet : one.tets) {
      for (int& node : tet) node += n;
      two.tets.push_back(tet);
    }
    return two;
  };
  const double rounding = 1e-12;  // m, as of a file with nine digits in mm
  for (const double apart : {0.0, rounding})
    CHECK_THAT(refusal([&] { check(two_parts(apart)); }), Contains("4 pairs of nodes coincide: ") &&
                                                              Contains("8 and 12 at (20, 0, 0) mm") &&
                                                              Contains("; merge them"));
  CHECK_NOTHROW(check(two_parts(1e-6)));
}

TEST_CASE("A box picks the nodes inside it, borders included", "[unit]") {
  const Mesh mesh = testing::beam(3, 1, 1, 0.01);
  CHECK(nodes_in(mesh, Box{{0, 0, 0}, {0, 0.01, 0.01}}) == mesh.regions.at("base"));
  CHECK(nodes_in(mesh, Box{{0.005, 0, 0}, {0.006, 1, 1}}).empty());
}

TEST_CASE("A sphere picks the nodes inside it, border included", "[unit]") {
  const Mesh mesh = testing::beam(3, 1, 1, 0.5);
  CHECK(nodes_in(mesh, Sphere{{0, 0, 0}, 0.5}) == std::vector<int>{0, 1, 2, 4});
  CHECK(nodes_in(mesh, Sphere{{0.75, 0.25, 0.25}, 0.4}).empty());
}

TEST_CASE("A space picks the tetrahedra whose centroids are inside it", "[unit]") {
  const Mesh mesh = testing::beam(3, 1, 1, 0.01);  // six tetrahedra a cube, one cube after the other
  std::vector<int> second_cube(6);
  std::iota(second_cube.begin(), second_cube.end(), 6);
  CHECK(tets_in(mesh, Box{{0.01, 0, 0}, {0.02, 0.01, 0.01}}) == second_cube);
  CHECK(tets_in(mesh, Sphere{{0.015, 0.005, 0.005}, 0.005}) == second_cube);
  CHECK(tets_in(mesh, Box{{0, 0, 0}, {0, 1, 1}}).empty());  // corners alone do not count
}

}  // namespace tendril::fem::mesh_test
