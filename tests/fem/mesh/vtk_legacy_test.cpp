// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#include "fem/mesh/mesh_formats.h"
#include "tests/fem/mesh/mesh_files.h"
#include "tests/fem/mesh/vtk_files.h"

namespace tendril::fem::vtk_legacy_test {

using Catch::Matchers::Contains;
using testing::check_two_tets;
using testing::edited;
using testing::kNewVtk;
using testing::kOldVtk;

/// All that VTK writes of cells beside numbers of materials, and what follows an array.
constexpr const char* kAttributes = R"(CELL_DATA 3
COLOR_SCALARS rgb 3
0 0 0 1 1 0.5 0 0 0
LOOKUP_TABLE colours 2
0 0 0 1
1 1 1 1
TEXTURE_COORDINATES where 2 float
0 0 nan 1 inf 1
TENSORS stress float
1 2 3 4 5 6 7 8 9 1 2 3 4 5 6 7 8 9 1 2 3 4 5 6 7 8 9
METADATA
COMPONENT_NAMES
xx

xz
yx
yy
yz
zx
zy
zz

TENSORS6 strain float
1 2 3 4 5 6 1 2 3 4 5 6 1 2 3 4 5 6
NORMALS outward float
0 0 1 0 0 1 0 0 1
GLOBAL_IDS ids vtkIdType
101 102 103
PEDIGREE_IDS origin string
first
CELLS

EDGE_FLAGS flags bit
1 0 1
FIELD FieldData 5
names 2 1 string
a%20b
c
kinds 1 2 variant
13 text%20here
6 2
switched 1 9 bit
1 0 0 0 0 0 0 1
1
NULL_ARRAY
small 1 3 signed_char
1 -2 3
)";

TEST_CASE("Whatever VTK writes of the cells beside numbers of materials is passed over", "[unit]") {
  const Mesh mesh = read_vtk_legacy(edited(kOldVtk, "CELL_DATA 3\n", kAttributes), "a.vtk");
  CHECK(mesh.tets.size() == 2);
  CHECK(mesh.volumes.at("material_1") == std::vector<int>{0});
  CHECK(mesh.regions.at("material_7") == std::vector<int>{0, 1, 2});
  CHECK(mesh.volumes.at("small_-2") == std::vector<int>{0});
  CHECK(mesh.volumes.size() == 4);  // numbers of cells and flags of edges sort none
  const std::string field =
      edited(kOldVtk, "POINTS", "FIELD FieldData 1\nnote 1 1 string\n{\"a\":%201}\nPOINTS");
  check_two_tets(read_vtk_legacy(field, "a.vtk"));
}

TEST_CASE("Whatever VTK writes of the cells is passed over in a binary file too", "[unit]") {
  const std::string bits("\x81\x80", 2), colours("\1\2\3\4\5\6\7\10\11", 9), table("\1\1\1\1", 4);
  const std::string length_of_100("\x80\x64", 2), length_of_3("\xC3", 1);
  const std::string attributes =
      "CELL_DATA 3\nCOLOR_SCALARS rgb 3\n" + colours + "\nLOOKUP_TABLE t 1\n" + table +
      "\nEDGE_FLAGS flags bit\n" + bits.substr(0, 1) + "\nPEDIGREE_IDS origin string\n" + length_of_3 +
      "abc" + length_of_100 + std::string(100, '\n') + length_of_3 +
      "\n\n\n\nTEXTURE_COORDINATES where 1 short\nabcdef\n" + "FIELD FieldData 3\nswitched 1 9 bit\n" + bits +
      "\nkinds 1 1 variant\n13 text\n";
  check_two_tets(read_vtk_legacy(
      edited(testing::binary_vtk(true), "CELL_DATA 3\nFIELD FieldData 1\n", attributes), "a.vtk"));
}

TEST_CASE("Materials that VTK took for colours are materials", "[unit]") {
  const char* as_colours = "COLOR_SCALARS material 1\n0.0274509803922 0.00392156862745\n0.00784313725\n";
  check_two_tets(read_vtk_legacy(
      edited(kOldVtk, "SCALARS material int 1\nLOOKUP_TABLE default\n7 1 2\n", as_colours), "a.vtk"));
  check_two_tets(read_vtk_legacy(
      edited(testing::binary_vtk(false), "CELL_DATA 3\n", "CELL_DATA 3\nCOLOR_SCALARS material 1\n\7\1\2\n"),
      "a.vtk"));
}

TEST_CASE("Keywords and types may be in any case", "[unit]") {
  std::string small = kOldVtk, capitals = kNewVtk;
  for (char& c : small) c = static_cast<char>(std::tolower(c));
  check_two_tets(read_vtk_legacy(small, "a.vtk"));
  for (const char* type : {"vtktypeint64", "float", "double", "int"}) {
    std::string upper = type;
    for (char& c : upper) c = static_cast<char>(std::toupper(c));
    capitals = edited(capitals, std::string(" ") + type + "\n", " " + upper + "\n");
  }
  check_two_tets(read_vtk_legacy(capitals, "a.vtk"));
}

TEST_CASE("A name is what VTK encoded", "[unit]") {
  const auto named = [](const std::string& name) {
    return read_vtk_legacy(edited(kOldVtk, "SCALARS material", "SCALARS " + name), "a.vtk")
        .volumes.begin()
        ->first;
  };
  CHECK(named("my%20part") == "my part_1");
  CHECK(named("100%25%22") == "100%\"_1");
  CHECK(named("%C3%a4") == "\xC3\xA4_1");
  CHECK(named("50%") == "50%_1");
  CHECK(named("50%2") == "50%2_1");
  CHECK(named("%zz%+5") == "%zz%+5_1");
  const Mesh field = read_vtk_legacy(edited(kNewVtk, "material 1 3", "my%20part 1 3"), "a.vtk");
  CHECK(field.volumes.contains("my part_2"));
}

TEST_CASE("Nodes that no tetrahedron uses are left out of VTK's regions too", "[unit]") {
  // Gmsh writes a cell for each point of a drawing, the centre of a circle included.
  const std::string centre = edited(
      edited(edited(kOldVtk, "POINTS 5", "POINTS 6"), "0 0 1000 0 0 -1000", "0 0 1000 0 0 -1000\n5 5 5"),
      "CELLS 3 14\n3 0 1 2\n", "CELLS 4 16\n1 5\n3 0 1 2\n");
  const std::string text = edited(
      edited(edited(edited(centre, "TYPES 3\n5 10 10", "TYPES 4\n1 5 10 10"), "CELL_DATA 3", "CELL_DATA 4"),
             "7 1 2", "8 7 1 2"),
      "0 0 0 0 0 0 0 0 0", "0 0 0 0 0 0 0 0 0 0 0 0");
  check_two_tets(read_vtk_legacy(
      edited(edited(text, "POINT_DATA 5", "POINT_DATA 6"), "1 2 3 4 5\n", "1 2 3 4 5 6\n"), "a.vtk"));
}

TEST_CASE("An array that is longer than the file is refused", "[unit]") {
  for (const char* attribute : {"COLOR_SCALARS rgb 1000\n0 0\n", "TEXTURE_COORDINATES t 99999999 float\n0\n",
                                "VECTORS v float\n0 0 0\n", "FIELD f 1\na 4000000000 4000000000 float\n0\n",
                                "LOOKUP_TABLE t 90000\n0\n"}) {
    CAPTURE(attribute);
    CHECK_THAT(testing::refusal([&] {
                 read_vtk_legacy(edited(testing::binary_vtk(true), "CELL_DATA 3\n",
                                        "CELL_DATA 3\n" + std::string(attribute)),
                                 "a.vtk");
               }),
               Contains("a.vtk: byte"));
  }
}

}  // namespace tendril::fem::vtk_legacy_test
