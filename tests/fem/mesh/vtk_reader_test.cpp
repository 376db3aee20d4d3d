// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <random>

#include "fem/mesh/mesh_formats.h"
#include "tests/fem/mesh/mesh_files.h"
#include "tests/fem/mesh/vtk_files.h"

namespace tendril::fem::vtk_reader_test {

using Catch::Matchers::Contains;
using namespace testing;

TEST_CASE("A VTU file gives the same mesh in whichever way its arrays are written", "[unit]") {
  SECTION("ASCII") { check_two_tets(read_vtu(ascii_vtu(), "a.vtu")); }
  SECTION("binary inline, several blocks packed with zlib") {
    check_two_tets(read_vtu(packed_vtu(), "a.vtu"));
  }
  SECTION("binary inline, big-endian") { check_two_tets(read_vtu(big_endian_vtu(), "a.vtu")); }
  SECTION("appended in base64, long headers") { check_two_tets(read_vtu(appended_vtu(), "a.vtu")); }
  SECTION("appended as bytes") { check_two_tets(read_vtu(raw_vtu(), "a.vtu")); }
}

TEST_CASE("A legacy VTK file gives the same mesh in either version, as text or bytes", "[unit]") {
  SECTION("version 2, text") { check_two_tets(read_vtk_legacy(kOldVtk, "a.vtk")); }
  SECTION("version 5.1, text") { check_two_tets(read_vtk_legacy(kNewVtk, "a.vtk")); }
  SECTION("version 4.2, bytes") { check_two_tets(read_vtk_legacy(binary_vtk(false), "a.vtk")); }
  SECTION("version 4.2, bytes, written on Windows") {
    check_two_tets(read_vtk_legacy(binary_vtk(false, "\r\n"), "a.vtk"));
  }
  SECTION("version 5.1, bytes, written on Windows") {
    check_two_tets(read_vtk_legacy(binary_vtk(true, "\r\n"), "a.vtk"));
  }
  SECTION("version 5.1, bytes") { check_two_tets(read_vtk_legacy(binary_vtk(true), "a.vtk")); }
}

TEST_CASE("An array with a value of its own for each of many cells is no list of materials", "[unit]") {
  std::string cells, types, numbers_of_cells;
  for (int k = 0; k < 65; ++k) {
    cells += "4 0 1 2 3\n";
    types += "10 ";
    numbers_of_cells += fmt::format("{} ", k);
  }
  const std::string text = fmt::format(
      "# vtk DataFile Version 2.0\nmany\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 int\n0 0 0 1 0 0 0 1 0 0 "
      "0 1\n"
      "CELLS 65 325\n{}CELL_TYPES 65\n{}\nCELL_DATA 65\nSCALARS number int\nLOOKUP_TABLE default\n{}\n",
      cells, types, numbers_of_cells);
  CHECK(read_vtk_legacy(text, "many.vtk").volumes.empty());
}

TEST_CASE("A VTU file that cannot be used says what is wrong and where", "[unit]") {
  const auto reading = [](const std::string& text, const std::string& from, const std::string& to) {
    return refusal([&] { read_vtu(edited(text, from, to), "a.vtu"); });
  };
  CHECK_THAT(refusal([] { read_vtu("<VTKFile>", "a.vtu"); }), Contains("a.vtu: byte") && Contains("not XML"));
  CHECK_THAT(refusal([] { read_vtu("<VTKFile/>", "a.vtu"); }),
             Contains("a.vtu: expected VTKFile/UnstructuredGrid/Piece"));
  CHECK_THAT(reading(ascii_vtu(), "1000 0 0", "1000 zero 0"),
             Contains("a.vtu:9: found 'zero', expected a number"));
  CHECK_THAT(reading(ascii_vtu(), "7 1 2", "7 1 2 3"),
             Contains("a.vtu:5: found '3', expected the end of 3 numbers"));
  CHECK_THAT(reading(ascii_vtu(), "Name=\"types\"", "Name=\"kinds\""), Contains("array 'types' is missing"));
  CHECK_THAT(reading(ascii_vtu(), "NumberOfPoints=\"5\"", "NumberOfPoints=\"-5\""),
             Contains("NumberOfPoints '-5'"));
  CHECK_THAT(reading(ascii_vtu(), "0 2 1 4", "0 2 1 5"), Contains("cell 2 names point 5, expected 0 to 4"));
  CHECK_THAT(reading(ascii_vtu(), "3 7 11", "3 7 10"), Contains("expected the end of 10 numbers"));
  CHECK_THAT(reading(ascii_vtu(), "3 7 11", "7 3 11"), Contains("cell 1 ends at place 3"));
  CHECK_THAT(reading(ascii_vtu(), "5 10 10", "5 10 12"),
             Contains("cell 2 is a solid of type 12, expected linear"));
  CHECK_THAT(reading(ascii_vtu(), "5 10 10", "5 24 10"), Contains("cell 1 is a second-order tetrahedron"));
  CHECK_THAT(reading(packed_vtu(), "vtkZLib", "vtkLZ4"), Contains("found compressor 'vtkLZ4DataCompressor'"));
  CHECK_THAT(reading(packed_vtu(), "eF5jYEAGVS", "eF5jYEAGVT"),
             Contains("block 0 does not unpack with zlib"));
  CHECK_THAT(reading(packed_vtu(), "AgAAACAAAAAc", "AgAAACAAAAAb"),
             Contains("array 'Points': found 2 blocks of 32"));
  CHECK_THAT(reading(packed_vtu(), "eF5jYEAGVS", "eF5j*EAGVS"), Contains("found '*', expected base64"));
  CHECK_THAT(reading(big_endian_vtu(), "AAAADAAAAAcA", "AAAADQAAAAcA"),
             Contains("found 13 bytes, expected 12"));
  CHECK_THAT(reading(appended_vtu(), "offset=\"292\"", "offset=\"9292\""),
             Contains("found the end of the file"));
  CHECK_THAT(reading(appended_vtu(), "<AppendedData", "<Appendix"), Contains("byte"));
}

TEST_CASE("A legacy VTK file that cannot be used says what is wrong and where", "[unit]") {
  const auto reading = [](const std::string& text, const std::string& from, const std::string& to) {
    return refusal([&] { read_vtk_legacy(edited(text, from, to), "a.vtk"); });
  };
  CHECK_THAT(reading(kOldVtk, "# vtk", "# vkt"), Contains("a.vtk:1: found '# vkt DataFile"));
  CHECK_THAT(reading(kOldVtk, "UNSTRUCTURED_GRID", "POLYDATA"),
             Contains("a.vtk:4: found 'POLYDATA', expected UNSTR"));
  CHECK_THAT(reading(kOldVtk, "5 double", "5 string"),
             Contains("a.vtk:5: found 'string', expected a type of numbers"));
  CHECK_THAT(reading(kOldVtk, "1000 0 0", "1000 zero 0"),
             Contains("a.vtk:6: found 'zero', expected a number"));
  CHECK_THAT(reading(kOldVtk, "4 0 1 2 3", "8 0 1 2 3"), Contains("cell 2 goes beyond the 14 integers"));
  CHECK_THAT(reading(kOldVtk, "CELLS 3 14", "CELLS 4 14"), Contains("cell 3 goes beyond the 14 integers"));
  CHECK_THAT(reading(kNewVtk, "OFFSETS vtktypeint64", "OFFSETS float"), Contains("floating point"));
  CHECK_THAT(reading(kOldVtk, "4 0 1 2 3", "3 0 1 2 3"), Contains("a.vtk"));
  CHECK_THAT(reading(kOldVtk, "TYPES 3\n5 10 10", "TYPES 2\n5 10"), Contains("found '3', expected 2 cells"));
  CHECK_THAT(reading(kOldVtk, "CELL_TYPES", "CELL_KINDS"),
             Contains("a.vtk:12: found 'CELL_KINDS', expected POINTS"));
  CHECK_THAT(reading(kNewVtk, "CONNECTIVITY", "CONNECTIONS"),
             Contains("found 'CONNECTIONS', expected CONNECTIVITY"));
  CHECK_THAT(reading(binary_vtk(true), "POINTS 5", "POINTS 99"), Contains("a.vtk: byte"));
}

TEST_CASE("Values counted against other cells than the file's are no list of materials", "[unit]") {
  const std::string early = "CELL_DATA 0\nSCALARS part int\nLOOKUP_TABLE default\nCELLS 3 14";
  const Mesh mesh = read_vtk_legacy(edited(kOldVtk, "CELLS 3 14", early), "a.vtk");
  CHECK(mesh.tet_count() == 2);
  for (const auto& [name, tets] : mesh.volumes) CHECK(name.starts_with("material"));
}

TEST_CASE("Whatever happens to a mesh file, it is read or refused", "[law]") {
  const unsigned seed = 11;
  std::mt19937 random(seed);
  CAPTURE(seed);
  struct Sample {
    Mesh (*read)(const std::string&, const std::string&);
    std::string text;
  };
  const std::vector<Sample> samples = {
      {read_gmsh, testing::kMsh},          {read_vtu, ascii_vtu()},    {read_vtu, packed_vtu()},
      {read_vtu, big_endian_vtu()},        {read_vtu, appended_vtu()}, {read_vtu, raw_vtu()},
      {read_vtk_legacy, kOldVtk},          {read_vtk_legacy, kNewVtk}, {read_vtk_legacy, binary_vtk(false)},
      {read_vtk_legacy, binary_vtk(true)},
  };
  int refused = 0;
  const auto try_reading = [&](const Sample& sample, const std::string& text) {
    try {
      sample.read(text, "hurt");
    } catch (const MeshError&) {
      ++refused;
    }
  };
  for (const Sample& sample : samples) {
    for (size_t length = 0; length < sample.text.size(); length += 7)
      REQUIRE_NOTHROW(try_reading(sample, sample.text.substr(0, length)));
    for (int k = 0; k < 300; ++k) {
      std::string text = sample.text;
      for (int bites = 0; bites < 1 + k % 3; ++bites)
        text[random() % text.size()] = k % 2 ? "0123456789"[random() % 10] : static_cast<char>(random());
      REQUIRE_NOTHROW(try_reading(sample, text));
    }
  }
  CHECK(refused > 1000);
}

}  // namespace tendril::fem::vtk_reader_test
