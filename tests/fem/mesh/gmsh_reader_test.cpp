// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "fem/mesh/mesh_formats.h"
#include "tests/fem/mesh/mesh_files.h"

namespace tendril::fem::gmsh_reader_test {

using Catch::Matchers::Contains;
using testing::edited;
using testing::kMsh;
using testing::refusal;

std::string refused(const std::string& text) {
  return refusal([&] { read_gmsh(text, "a.msh"); });
}

std::string unnamed(const std::string& text) {
  return edited(text, "$PhysicalNames\n2\n2 1 \"base\"\n3 2 \"soft body\"\n$EndPhysicalNames\n", "");
}

TEST_CASE("The sign of a physical tag turns normals and changes no group", "[unit]") {
  const Mesh plain = read_gmsh(kMsh, "a.msh");
  const std::string surface = edited(kMsh, "7 0 0 0 1 1 0 1 1 0", "7 0 0 0 1 1 0 1 -1 0");
  const std::string both = edited(surface, "9 0 0 0 1 1 1 1 2 1 7", "9 0 0 0 1 1 1 1 -2 1 -7");
  for (const std::string& text : {surface, both}) {
    const Mesh mesh = read_gmsh(text, "a.msh");
    CHECK(mesh.regions == plain.regions);
    CHECK(mesh.volumes == plain.volumes);
  }
}

TEST_CASE("A physical group without a name is called after its tag", "[unit]") {
  const Mesh mesh = read_gmsh(unnamed(kMsh), "a.msh");
  CHECK(mesh.regions.at("physical_1") == std::vector<int>{0, 1, 2});
  CHECK(mesh.regions.at("physical_2").size() == 5);
  CHECK(mesh.volumes == std::map<std::string, std::vector<int>>{{"physical_2", {0, 1}}});

  const Mesh one_named = read_gmsh(edited(kMsh, "2\n2 1 \"base\"\n", "1\n"), "a.msh");
  CHECK(one_named.regions.contains("physical_1"));
  CHECK(one_named.regions.contains("soft body"));
}

TEST_CASE("Groups without names of one tag and two dimensions stay two groups", "[unit]") {
  const Mesh mesh = read_gmsh(edited(unnamed(kMsh), "1 1 1 1 2 1 7", "1 1 1 1 1 1 7"), "a.msh");
  CHECK(mesh.regions.at("physical_surface_1").size() == 3);
  CHECK(mesh.regions.at("physical_volume_1").size() == 5);
  CHECK(mesh.regions.size() == 2);
}

TEST_CASE("Sections that say nothing of the mesh may hold anything, anywhere", "[unit]") {
  const Mesh plain = read_gmsh(kMsh, "a.msh");
  const std::string comment = "$Comments\nthe sections $Nodes and $EndNodes\n$Nodes\n2\n$EndComments\n";
  for (const char* place : {"$MeshFormat", "$PhysicalNames", "$Entities", "$Nodes", "$Elements"}) {
    const Mesh mesh = read_gmsh(edited(kMsh, place, comment + place), "a.msh");
    CHECK(mesh.regions == plain.regions);
    CHECK(mesh.tets == plain.tets);
  }
  CHECK(read_gmsh(kMsh + comment, "a.msh").tets == plain.tets);
  const std::string in_a_name = edited(kMsh, "\"base\"", "\"base $EndPhysicalNames\"");
  CHECK(read_gmsh(in_a_name, "a.msh").regions.contains("base $EndPhysicalNames"));
}

TEST_CASE("A group that is lost is told", "[unit]") {
  CHECK_THAT(refused(edited(kMsh, "2\n2 1 \"base\"\n", "3\n2 1 \"base\"\n2 5 \"lid\"\n")),
             Contains("a.msh: no element is in the physical groups 'lid', which $PhysicalNames lists"));
  const std::string no_entities =
      edited(kMsh, "$Entities\n0 0 1 1\n7 0 0 0 1 1 0 1 1 0\n9 0 0 0 1 1 1 1 2 1 7\n$EndEntities\n", "");
  CHECK_THAT(refused(no_entities), Contains("no element is in the physical groups 'base', 'soft body'"));
  CHECK_THAT(refused(std::string(kMsh) + "$Elements\n0 0 0 0\n$EndElements\n"),
             Contains("a.msh:37: found a second section $Elements, expected one"));
}

/// The two tetrahedra as Gmsh writes them where each is a partition: elements lie in the entities 17 to 19.
std::string partitioned(const std::string& volumes) {
  const std::string entities = "$EndEntities\n$PartitionedEntities\n2\n1\n4 1\n0 0 2 " + volumes +
                               "\n18 2 7 1 1 0 0 0 1 1 0 1 1 0\n19 3 9 2 1 2 0 0 0 1 1 0 1 2 0\n"
                               "17 3 9 1 1 0 0 0 1 1 1 1 2 1 18\n" +
                               (volumes == "2" ? "20 3 9 1 2 0 0 0 1 1 1 1 2 1 18\n" : "") +
                               "$EndPartitionedEntities\n";
  const std::string elements = volumes == "2"
                                   ? "4 4 1 4\n2 18 2 1\n1 10 11 12\n2 19 2 1\n4 10 11 12\n3 17 4 1\n"
                                     "2 10 11 12 13\n3 20 4 1\n3 10 12 11 14\n"
                                   : "2 2 1 2\n2 18 2 1\n1 10 11 12\n3 17 4 1\n2 10 11 12 13\n";
  return edited(edited(kMsh, "$EndEntities\n", entities),
                "2 3 1 3\n2 7 2 1\n1 10 11 12\n3 9 4 2\n2 10 11 12 13\n3 10 12 11 14\n", elements);
}

TEST_CASE("A partitioned file gives the mesh and the groups that it has undivided", "[unit]") {
  const Mesh whole = read_gmsh(kMsh, "a.msh");
  const Mesh mesh = read_gmsh(partitioned("2"), "a.msh");
  CHECK(mesh.tets == whole.tets);
  CHECK(mesh.regions == whole.regions);
  CHECK(mesh.volumes == whole.volumes);
}

TEST_CASE("A file with some of the partitions of a mesh is refused", "[unit]") {
  CHECK_THAT(refused(partitioned("1")),
             Contains("found 1 of the 2 partitions of the mesh, expected all in one "
                      "file; write them into one (Mesh.PartitionSplitMeshFiles = 0)"));
}

}  // namespace tendril::fem::gmsh_reader_test
