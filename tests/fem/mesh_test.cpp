#include "fem/mesh.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <numeric>

#include "fem/mesh_reader.h"
#include "tests/fem/bodies.h"

namespace tendril::fem {
namespace {

using Catch::Matchers::Contains;

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const MeshError& error) {
    return error.what();
  }
  return "no error";
}

std::filesystem::path write_file(const std::string& name, const std::string& text) {
  const auto file = std::filesystem::temp_directory_path() / fmt::format("tendril-{}-{}", getpid(), name);
  std::ofstream(file) << text;
  return file;
}

constexpr const char* kMsh = R"($MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
2 1 "base"
3 2 "soft body"
$EndPhysicalNames
$Entities
0 0 1 1
7 0 0 0 1 1 0 1 1 0
9 0 0 0 1 1 1 1 2 1 7
$EndEntities
$Nodes
2 5 10 14
2 7 0 3
10
11
12
0 0 0
1000 0 0
0 1000 0
3 9 0 2
13
14
0 0 1000
0 0 -1e3
$EndNodes
$Elements
2 3 1 3
2 7 2 1
1 10 11 12
3 9 4 2
2 10 11 12 13
3 10 12 11 14
$EndElements
)";

TEST_CASE("A Gmsh 4.1 file gives nodes in metres, tetrahedra and named regions", "[unit]") {
  const Mesh mesh = read_mesh(write_file("two.msh", kMsh), 1e-3);
  CHECK_NOTHROW(check(mesh));
  CHECK(mesh.node_count() == 5);
  CHECK(mesh.nodes.col(1) == Eigen::Vector3d(1, 0, 0));
  CHECK(mesh.tets == std::vector<std::array<int, 4>>{{0, 1, 2, 3}, {0, 2, 1, 4}});
  CHECK(mesh.regions.at("base") == std::vector<int>{0, 1, 2});
  CHECK(mesh.regions.at("soft body").size() == 5);
}

TEST_CASE("A VTU file gives the same mesh as its arrays", "[unit]") {
  const Mesh mesh = read_mesh(write_file("one.vtu", R"(<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece NumberOfPoints="4" NumberOfCells="2">
<Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 2.5</DataArray></Points>
<Cells><DataArray Name="connectivity" format="ascii">0 1 2 0 1 2 3</DataArray>
<DataArray Name="offsets" format="ascii">3 7</DataArray><DataArray Name="types" format="ascii">5 10</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>)"),
                              1.0);
  CHECK(mesh.tets == std::vector<std::array<int, 4>>{{0, 1, 2, 3}});
  CHECK(mesh.nodes(2, 3) == 2.5);
}

TEST_CASE("A mesh file that cannot be used says what is wrong and where", "[unit]") {
  const auto reading = [](const std::string& name, const std::string& text) {
    return message_of([&] { read_mesh(write_file(name, text), 1.0); });
  };
  const auto edited = [](std::string from, std::string to) {
    std::string text = kMsh;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  CHECK_THAT(message_of([] { read_mesh("/nowhere/robot.msh", 1.0); }),
             Contains("/nowhere/robot.msh: cannot be"));
  CHECK_THAT(reading("a.stl", "solid"), Contains("'.stl' is not known; expected .msh"));
  CHECK_THAT(reading("a.msh", edited("4.1 0 8", "2.2 0 8")),
             Contains("found MSH 2.2 ASCII, expected MSH 4.1"));
  CHECK_THAT(reading("b.msh", edited("1000 0 0", "1000 zero 0")),
             Contains("$Nodes: found 'zero") && Contains("a coordinate is expected"));
  CHECK_THAT(reading("c.msh", edited("2 10 11 12 13", "2 10 11 12 99")), Contains("node 99 does not exist"));
  CHECK_THAT(reading("d.msh", edited("$EndNodes", "")), Contains("section $Nodes is missing"));
  CHECK_THAT(reading("e.msh", edited("3 9 4 2", "3 9 11 2")), Contains("element type 11 is not supported"));
  CHECK_THAT(reading("f.vtu", "<VTKFile>"), Contains("not XML"));
  CHECK_THAT(reading("g.vtu", "<VTKFile/>"), Contains("expected VTKFile/UnstructuredGrid/Piece"));
}

TEST_CASE("A mesh that no model can stand on is refused with the culprits' numbers", "[unit]") {
  const Mesh good = testing::beam(2, 1, 1, 0.01);
  CHECK_NOTHROW(check(good));

  Mesh inverted = good;
  std::swap(inverted.tets[3][0], inverted.tets[3][1]);
  CHECK_THAT(message_of([&] { check(inverted); }), Contains("1 tetrahedra are inverted: tetrahedron 3 at ("));

  Mesh flat = good;
  flat.tets.push_back({0, 1, 4, 4});
  CHECK_THAT(message_of([&] { check(flat); }), Contains("tetrahedra are flat: tetrahedron 12"));

  Mesh loose = good;
  loose.nodes.conservativeResize(Eigen::NoChange, good.node_count() + 1);
  loose.nodes.rightCols(1).setConstant(0.5);
  CHECK_THAT(message_of([&] { check(loose); }),
             Contains(fmt::format("1 nodes belong to no tetrahedron: node {} at (500", good.node_count())));

  Mesh wild = good;
  wild.tets[0][2] = 4711;
  CHECK_THAT(message_of([&] { check(wild); }), Contains("tetrahedron 0 names node 4711"));

  Mesh poisoned = good;
  poisoned.nodes(1, 5) = NAN;
  CHECK_THAT(message_of([&] { check(poisoned); }), Contains("not finite: node 5"));

  CHECK_THAT(message_of([] { check(Mesh{}); }), Contains("no tetrahedra"));
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

}  // namespace
}  // namespace tendril::fem
