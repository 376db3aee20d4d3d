#include <fmt/format.h>

#include <array>
#include <bit>
#include <catch2/catch.hpp>
#include <cstdint>
#include <random>

#include "fem/mesh/mesh_formats.h"
#include "tests/fem/mesh/mesh_files.h"

// The VTU files are what VTK 9.1 wrote for two tetrahedra on either side of a triangle.

namespace tendril::fem::vtk_reader_test {

using Catch::Matchers::Contains;
using testing::edited;
using testing::refusal;

void check_two_tets(const Mesh& mesh) {
  CHECK_NOTHROW(check(mesh));
  REQUIRE(mesh.node_count() == 5);
  CHECK(mesh.nodes.col(1) == Eigen::Vector3d(1000, 0, 0));
  CHECK(mesh.nodes.col(4) == Eigen::Vector3d(0, 0, -1000));
  CHECK(mesh.tets == std::vector<std::array<int, 4>>{{0, 1, 2, 3}, {0, 2, 1, 4}});
  CHECK(mesh.volumes == std::map<std::string, std::vector<int>>{{"material_1", {0}}, {"material_2", {1}}});
  CHECK(mesh.regions == std::map<std::string, std::vector<int>>{{"material_1", {0, 1, 2, 3}},
                                                                {"material_2", {0, 1, 2, 4}},
                                                                {"material_7", {0, 1, 2}}});
}

struct Array {
  const char *name, *type, *ascii, *packed, *big_endian;
  int appended, appended_raw;  // offsets
};
constexpr std::array kArrays = {
    Array{"material", "Int32", "7 1 2",
          "AQAAACAAAAAMAAAAEQAAAA==eF5jZ2BgYARiJiAGAABwAAs=", "AAAADAAAAAcAAAABAAAAAg==", 0, 0},
    Array{"Points", "Float32", "0 0 0 1000 0 0 0 1e3 0\n0 0 1000 0 0 -1000",
          "AgAAACAAAAAcAAAAEQAAABAAAAA=eF5jYEAGVS4oXCAfAA5wAX14XmNgQAZVLkjsIwAL9AH9",
          "AAAAPAAAAAAAAAAAAAAAAER6AAAAAAAAAAAAAAAAAABEegAAAAAAAAAAAAAAAAAARHoAAAAAAAAAAAAAxHoAAA==", 28, 20},
    Array{"connectivity", "Int64", "0 1 2 0 1 2 3 0 2 1 4",
          "AwAAACAAAAAYAAAAEQAAABEAAAAQAAAAeF5jYIAARijNxIAKAABYAAR4XmNkgAAmKM3MgAoAAKAAB3heY2KAAEYozQKlAQB4AA"
          "g=",
          "AAAAWAAAAAAAAAAAAAAAAAAAAAEAAAAAAAAAAgAAAAAAAAAAAAAAAAAAAAEAAAAAAAAAAgAAAAAAAAADAAAAAAAAAAAAAAAAAA"
          "AAAgAAAA"
          "AAAAABAAAAAAAAAAQ=",
          120, 88},
    Array{"offsets", "Int64", "3 7 11", "AQAAACAAAAAYAAAAEAAAAA==eF5jZoAAdijNDaUBASgAFg==",
          "AAAAGAAAAAAAAAADAAAAAAAAAAcAAAAAAAAACw==", 248, 184},
    Array{"types", "UInt8", "5 10 10", "AQAAACAAAAADAAAACwAAAA==eF5j5eICAAAwABo=", "AAAAAwUKCg==", 292, 216}};

std::string vtu(const std::string& attributes, const std::function<std::string(const Array&)>& content,
                const std::string& appended = "") {
  const auto data = [&](int k) {
    const Array& a = kArrays[k];
    return fmt::format("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" {}</DataArray>\n",
                       a.type, a.name, k == 1 ? 3 : 1, content(a));
  };
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" {}><UnstructuredGrid>\n"
      "<Piece NumberOfPoints=\"5\" NumberOfCells=\"3\">\n<CellData>{}</CellData>\n<Points>{}</Points>\n"
      "<Cells>{}{}{}</Cells>\n</Piece></UnstructuredGrid>\n{}</VTKFile>\n",
      attributes, data(0), data(1), data(2), data(3), data(4), appended);
}

std::string ascii_vtu() {
  return vtu("byte_order=\"LittleEndian\"",
             [](const Array& a) { return fmt::format("format=\"ascii\">\n{}\n", a.ascii); });
}

std::string packed_vtu() {
  return vtu("byte_order=\"LittleEndian\" header_type=\"UInt32\" compressor=\"vtkZLibDataCompressor\"",
             [](const Array& a) { return fmt::format("format=\"binary\">\n  {}\n", a.packed); });
}

std::string big_endian_vtu() {
  return vtu("byte_order=\"BigEndian\" header_type=\"UInt32\"",
             [](const Array& a) { return fmt::format("format=\"binary\">{}", a.big_endian); });
}

std::string appended_vtu() {
  return vtu(
      "byte_order=\"LittleEndian\" header_type=\"UInt64\"",
      [](const Array& a) { return fmt::format("format=\"appended\" offset=\"{}\">", a.appended); },
      "<AppendedData encoding=\"base64\">\n   "
      "_DAAAAAAAAAAHAAAAAQAAAAIAAAA=PAAAAAAAAAAAAAAAAAAAAAAAAAAAAHpEAAAA"
      "AAAAAAAAAAAAAAB6RAAAAAAAAAAAAAAAAAAAekQAAAAAAAAAAAAAesQ="
      "WAAAAAAAAAAAAAAAAAAAAAEAAAAAAAAAAgAAAAAAAAAAAAAA"
      "AAAAAAEAAAAAAAAAAgAAAAAAAAADAAAAAAAAAAAAAAAAAAAAAgAAAAAAAAABAAAAAAAAAAQAAAAAAAAAGAAAAAAAAAADAAAAAAAAAA"
      "cA"
      "AAAAAAAACwAAAAAAAAA=AwAAAAAAAAAFCgo=\n  </AppendedData>\n");
}

template <typename T>
std::string bytes(std::initializer_list<T> values, bool big_endian) {
  std::string result;
  for (const T value : values) {
    auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (big_endian) std::reverse(raw.begin(), raw.end());
    for (const char c : raw) result.push_back(c);
  }
  return result;
}

std::string coordinates(bool big_endian) {
  return bytes<float>({0, 0, 0, 1000, 0, 0, 0, 1000, 0, 0, 0, 1000, 0, 0, -1000}, big_endian);
}

std::string raw_vtu() {
  std::string data;
  for (const std::string& block :
       {bytes<std::int32_t>({7, 1, 2}, false), coordinates(false),
        bytes<std::int64_t>({0, 1, 2, 0, 1, 2, 3, 0, 2, 1, 4}, false), bytes<std::int64_t>({3, 7, 11}, false),
        bytes<std::uint8_t>({5, 10, 10}, false)})
    data += bytes({static_cast<std::uint64_t>(block.size())}, false) + block;
  return vtu(
      "byte_order=\"LittleEndian\" header_type=\"UInt64\"",
      [](const Array& a) { return fmt::format("format=\"appended\" offset=\"{}\">", a.appended_raw); },
      fmt::format("<AppendedData encoding=\"raw\">_{}</AppendedData>\n", data));
}

constexpr const char* kOldVtk = R"(# vtk DataFile Version 2.0
two tetrahedra
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 5 double
0 0 0 1000 0 0 0 1e3 0
0 0 1000 0 0 -1000
CELLS 3 14
3 0 1 2
4 0 1 2 3
4 0 2 1 4
CELL_TYPES 3
5 10 10
POINT_DATA 5
SCALARS heat float
LOOKUP_TABLE default
1 2 3 4 5
CELL_DATA 3
SCALARS material int 1
LOOKUP_TABLE default
7 1 2
VECTORS pull double
0 0 0 0 0 0 0 0 0
)";

constexpr const char* kNewVtk = R"(# vtk DataFile Version 5.1
vtk output
ASCII
DATASET UNSTRUCTURED_GRID
FIELD FieldData 1
TIME 1 1 double
1.5
POINTS 5 float
0 0 0 1000 0 0 0 1000 0 
0 0 1000 0 0 -1000 
METADATA
INFORMATION 1
NAME L2_NORM_RANGE LOCATION vtkDataArray
DATA 2 0 1000 

CELLS 4 11
OFFSETS vtktypeint64
0 3 7 11 
CONNECTIVITY vtktypeint64
0 1 2 0 1 2 3 0 2 
1 4 
CELL_TYPES 3
5
10
10

CELL_DATA 3
FIELD FieldData 2
stress 6 3 double
1 2 3 4 5 6 1 2 3 4 5 6 1 2 3 4 5 6 
METADATA
COMPONENT_NAMES
xx


INFORMATION 0

material 1 3 int
7 1 2 
METADATA
INFORMATION 0

)";

std::string binary_vtk(bool with_offsets) {
  const std::string cells =
      with_offsets ? fmt::format("CELLS 4 11\nOFFSETS vtktypeint64\n{}\nCONNECTIVITY vtktypeint64\n{}\n",
                                 bytes<std::int64_t>({0, 3, 7, 11}, true),
                                 bytes<std::int64_t>({0, 1, 2, 0, 1, 2, 3, 0, 2, 1, 4}, true))
                   : fmt::format("CELLS 3 14\n{}\n",
                                 bytes<std::int32_t>({3, 0, 1, 2, 4, 0, 1, 2, 3, 4, 0, 2, 1, 4}, true));
  return fmt::format(
      "# vtk DataFile Version {}\ntwo\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n{}\n{}"
      "CELL_TYPES 3\n{}\nCELL_DATA 3\nFIELD FieldData 1\nmaterial 1 3 short\n{}\n"
      "METADATA\nINFORMATION 0\n\n",
      with_offsets ? "5.1" : "4.2", coordinates(true), cells, bytes<std::int32_t>({5, 10, 10}, true),
      bytes<std::int16_t>({7, 1, 2}, true));
}

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
