// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/mesh_reader.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "tests/fem/mesh/mesh_files.h"
#include "tests/fem/mesh/vtk_files.h"
#include "tests/own_folder.h"

namespace tendril::fem::mesh_reader_test {

using Catch::Matchers::Contains;
using testing::kMsh;
using testing::refusal;

/// A mesh file in a folder of its own, gone with the object.
class MeshFile {
 public:
  MeshFile(const std::string& name, const std::string& text) : path_(folder_ / name) {
    std::ofstream(path_, std::ios::binary) << text;
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  tendril::testing::OwnFolder folder_;
  std::filesystem::path path_;
};

TEST_CASE("A Gmsh 4.1 file gives nodes in metres, tetrahedra, named regions and volumes", "[unit]") {
  const Mesh mesh = read_mesh(MeshFile("two.msh", kMsh).path(), 1e-3);
  CHECK_NOTHROW(check(mesh));
  CHECK(mesh.node_count() == 5);
  CHECK(mesh.nodes.col(1) == Eigen::Vector3d(1, 0, 0));
  CHECK(mesh.tets == std::vector<std::array<int, 4>>{{0, 1, 2, 3}, {0, 2, 1, 4}});
  CHECK(mesh.regions.at("base") == std::vector<int>{0, 1, 2});
  CHECK(mesh.regions.at("soft body").size() == 5);
  CHECK(mesh.volumes == std::map<std::string, std::vector<int>>{{"soft body", {0, 1}}});
}

TEST_CASE("Line ends of Windows make no difference", "[unit]") {
  std::string text;
  for (const char c : std::string(kMsh)) text += c == '\n' ? "\r\n" : std::string(1, c);
  const Mesh mesh = read_mesh(MeshFile("windows.msh", text).path(), 1);
  CHECK(mesh.tet_count() == 2);
  CHECK(mesh.regions.contains("soft body"));
}

TEST_CASE("The first characters of a file say which format it has, whatever its name ends in", "[unit]") {
  for (const char* name : {"a.msh", "A.MSH", "a.vtk", "mesh", "a.mesh.bak"}) {
    CHECK(read_mesh(MeshFile(name, kMsh).path(), 1).tet_count() == 2);
    CHECK(read_mesh(MeshFile(name, "\xEF\xBB\xBF" + std::string(kMsh)).path(), 1).tet_count() == 2);
    CHECK(read_mesh(MeshFile(name, testing::ascii_vtu()).path(), 1).tet_count() == 2);
    CHECK(read_mesh(MeshFile(name, testing::kOldVtk).path(), 1).tet_count() == 2);
  }
  CHECK_THAT(refusal([] { read_mesh(MeshFile("A.VTK", "something").path(), 1); }),
             Contains("A.VTK:1: found 'something'"));
}

TEST_CASE("Nodes that nothing uses are left out and the others keep their order", "[unit]") {
  // Node 10 becomes the centre of some circle: the faces and tetrahedra name 15 in its stead.
  const std::string text = testing::edited(
      testing::edited(kMsh, "3 9 0 2\n13\n14\n", "3 9 0 3\n13\n14\n15\n"), "0 0 -1e3\n", "0 0 -1e3\n1 0 0\n");
  const std::string counted = testing::edited(testing::edited(text, "2 5 10 14", "2 6 10 15"),
                                              "1 10 11 12\n3 9 4 2\n2 10 11 12 13\n3 10 12 11 14",
                                              "1 15 11 12\n3 9 4 2\n2 15 11 12 13\n3 15 12 11 14");
  const Mesh mesh = read_mesh(MeshFile("centre.msh", counted).path(), 1);
  CHECK(mesh.node_count() == 5);
  CHECK(mesh.nodes.col(0) == Eigen::Vector3d(1000, 0, 0));
  CHECK(mesh.tets[0] == std::array<int, 4>{4, 0, 1, 2});
  CHECK(mesh.regions.at("base") == std::vector<int>{0, 1, 4});
}

TEST_CASE("A mesh file that cannot be used says what is wrong and on which line", "[unit]") {
  const auto reading = [](const std::string& name, const std::string& text) {
    return refusal([&] { read_mesh(MeshFile(name, text).path(), 1.0); });
  };
  const auto edited = [&](const std::string& from, const std::string& to) {
    return reading("a.msh", testing::edited(kMsh, from, to));
  };
  const tendril::testing::OwnFolder folder;
  const std::string absent = folder / "absent.msh";
  CHECK_THAT(refusal([&] { read_mesh(absent, 1.0); }), Contains(absent + ": cannot be"));
  CHECK_THAT(reading("a.stl", "solid"), Contains("'.stl' is not known; expected .msh"));
  CHECK_THAT(edited("4.1 0 8", "2.2 0 8"), Contains("a.msh:2: found MSH 2.2 ASCII, expected MSH 4.1"));
  CHECK_THAT(edited("1000 0 0", "1000 zero 0"), Contains("a.msh:21: found 'zero', expected a coordinate"));
  CHECK_THAT(edited("1000 0 0", "1000 1.5mm 0"), Contains("a.msh:21: found '1.5mm', expected a coordinate"));
  CHECK_THAT(edited("2 10 11 12 13", "2 10 11 12 99"),
             Contains("a.msh:34: found '99', expected the tag of a node"));
  CHECK_THAT(edited("11\n12\n", "11\n11\n"),
             Contains("a.msh:19: found '11', expected a node tag that no other"));
  CHECK_THAT(edited("2 5 10 14", "2 4 10 14"), Contains("expected no more than the 4 nodes announced"));
  CHECK_THAT(edited("2 5 10 14", "2 6 10 14"), Contains("found 5 nodes, expected 6"));
  CHECK_THAT(edited("2 5 10 14", "2 5000000000 10 14"),
             Contains("a.msh:15: found 5000000000 for a number of nodes"));
  CHECK_THAT(edited("$EndNodes", ""), Contains("a.msh:14: section $Nodes has no end"));
  CHECK_THAT(edited("$Nodes", "$Knots"), Contains("section $Nodes is missing"));
  CHECK_THAT(edited("3 9 4 2", "3 9 5 2"), Contains("a.msh:33: found '5', expected element type 4"));
  CHECK_THAT(edited("3 9 4 2", "3 9 11 2"),
             Contains("a.msh:33: found second-order tetrahedra (type 11), expected linear ones (type 4); "
                      "export with element order 1"));
}

}  // namespace tendril::fem::mesh_reader_test
