// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <catch2/catch.hpp>
#include <cstdint>
#include <functional>
#include <string>

#include "fem/mesh/mesh.h"

// Two tetrahedra on either side of a triangle in VTK's formats. The VTU files are what VTK 9.1 wrote.

namespace tendril::fem::testing {

inline void check_two_tets(const Mesh& mesh) {
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

struct VtuArray {
  const char *name, *type, *ascii, *packed, *big_endian;
  int appended, appended_raw;  // offsets
};
inline constexpr std::array kArrays = {
    VtuArray{"material", "Int32", "7 1 2",
             "AQAAACAAAAAMAAAAEQAAAA==eF5jZ2BgYARiJiAGAABwAAs=", "AAAADAAAAAcAAAABAAAAAg==", 0, 0},
    VtuArray{"Points", "Float32", "0 0 0 1000 0 0 0 1e3 0\n0 0 1000 0 0 -1000",
             "AgAAACAAAAAcAAAAEQAAABAAAAA=eF5jYEAGVS4oXCAfAA5wAX14XmNgQAZVLkjsIwAL9AH9",
             "AAAAPAAAAAAAAAAAAAAAAER6AAAAAAAAAAAAAAAAAABEegAAAAAAAAAAAAAAAAAARHoAAAAAAAAAAAAAxHoAAA==", 28,
             20},
    VtuArray{
        "connectivity", "Int64", "0 1 2 0 1 2 3 0 2 1 4",
        "AwAAACAAAAAYAAAAEQAAABEAAAAQAAAAeF5jYIAARijNxIAKAABYAAR4XmNkgAAmKM3MgAoAAKAAB3heY2KAAEYozQKlAQB4AA"
        "g=",
        "AAAAWAAAAAAAAAAAAAAAAAAAAAEAAAAAAAAAAgAAAAAAAAAAAAAAAAAAAAEAAAAAAAAAAgAAAAAAAAADAAAAAAAAAAAAAAAAAA"
        "AAAgAAAA"
        "AAAAABAAAAAAAAAAQ=",
        120, 88},
    VtuArray{"offsets", "Int64", "3 7 11", "AQAAACAAAAAYAAAAEAAAAA==eF5jZoAAdijNDaUBASgAFg==",
             "AAAAGAAAAAAAAAADAAAAAAAAAAcAAAAAAAAACw==", 248, 184},
    VtuArray{"types", "UInt8", "5 10 10", "AQAAACAAAAADAAAACwAAAA==eF5j5eICAAAwABo=", "AAAAAwUKCg==", 292,
             216}};

inline std::string vtu(const std::string& attributes,
                       const std::function<std::string(const VtuArray&)>& content,
                       const std::string& appended = "") {
  const auto data = [&](int k) {
    const VtuArray& a = kArrays[k];
    return fmt::format("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" {}</DataArray>\n",
                       a.type, a.name, k == 1 ? 3 : 1, content(a));
  };
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" {}><UnstructuredGrid>\n"
      "<Piece NumberOfPoints=\"5\" NumberOfCells=\"3\">\n<CellData>{}</CellData>\n<Points>{}</Points>\n"
      "<Cells>{}{}{}</Cells>\n</Piece></UnstructuredGrid>\n{}</VTKFile>\n",
      attributes, data(0), data(1), data(2), data(3), data(4), appended);
}

inline std::string ascii_vtu() {
  return vtu("byte_order=\"LittleEndian\"",
             [](const VtuArray& a) { return fmt::format("format=\"ascii\">\n{}\n", a.ascii); });
}

inline std::string packed_vtu() {
  return vtu("byte_order=\"LittleEndian\" header_type=\"UInt32\" compressor=\"vtkZLibDataCompressor\"",
             [](const VtuArray& a) { return fmt::format("format=\"binary\">\n  {}\n", a.packed); });
}

inline std::string big_endian_vtu() {
  return vtu("byte_order=\"BigEndian\" header_type=\"UInt32\"",
             [](const VtuArray& a) { return fmt::format("format=\"binary\">{}", a.big_endian); });
}

inline std::string appended_vtu() {
  return vtu(
      "byte_order=\"LittleEndian\" header_type=\"UInt64\"",
      [](const VtuArray& a) { return fmt::format("format=\"appended\" offset=\"{}\">", a.appended); },
      "<AppendedData encoding=\"base64\">\n   "
      "_DAAAAAAAAAAHAAAAAQAAAAIAAAA=PAAAAAAAAAAAAAAAAAAAAAAAAAAAAHpEAAAA"
      "AAAAAAAAAAAAAAB6RAAAAAAAAAAAAAAAAAAAekQAAAAAAAAAAAAAesQ="
      "WAAAAAAAAAAAAAAAAAAAAAEAAAAAAAAAAgAAAAAAAAAAAAAA"
      "AAAAAAEAAAAAAAAAAgAAAAAAAAADAAAAAAAAAAAAAAAAAAAAAgAAAAAAAAABAAAAAAAAAAQAAAAAAAAAGAAAAAAAAAADAAAAAAAAAA"
      "cA"
      "AAAAAAAACwAAAAAAAAA=AwAAAAAAAAAFCgo=\n  </AppendedData>\n");
}

template <typename T>
inline std::string bytes(std::initializer_list<T> values, bool big_endian) {
  std::string result;
  for (const T value : values) {
    auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (big_endian) std::reverse(raw.begin(), raw.end());
    for (const char c : raw) result.push_back(c);
  }
  return result;
}

inline std::string coordinates(bool big_endian) {
  return bytes<float>({0, 0, 0, 1000, 0, 0, 0, 1000, 0, 0, 0, 1000, 0, 0, -1000}, big_endian);
}

inline std::string raw_vtu() {
  std::string data;
  for (const std::string& block : {bytes<int32_t>({7, 1, 2}, false), coordinates(false),
                                   bytes<int64_t>({0, 1, 2, 0, 1, 2, 3, 0, 2, 1, 4}, false),
                                   bytes<int64_t>({3, 7, 11}, false), bytes<uint8_t>({5, 10, 10}, false)})
    data += bytes({static_cast<uint64_t>(block.size())}, false) + block;
  return vtu(
      "byte_order=\"LittleEndian\" header_type=\"UInt64\"",
      [](const VtuArray& a) { return fmt::format("format=\"appended\" offset=\"{}\">", a.appended_raw); },
      fmt::format("<AppendedData encoding=\"raw\">_{}</AppendedData>\n", data));
}

inline constexpr const char* kOldVtk = R"(# vtk DataFile Version 2.0
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

inline constexpr const char* kNewVtk = R"(# vtk DataFile Version 5.1
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

/// @param line_end  of what is text in it: bytes stay as they are
inline std::string binary_vtk(bool with_offsets, const std::string& line_end = "\n") {
  const auto text = [&](const std::string& lines) {
    std::string result;
    for (const char c : lines) result += c == '\n' ? line_end : std::string(1, c);
    return result;
  };
  const std::string cells =
      with_offsets ? text("CELLS 4 11\nOFFSETS vtktypeint64\n") + bytes<int64_t>({0, 3, 7, 11}, true) +
                         text("\nCONNECTIVITY vtktypeint64\n") +
                         bytes<int64_t>({0, 1, 2, 0, 1, 2, 3, 0, 2, 1, 4}, true) + line_end
                   : text("CELLS 3 14\n") + bytes<int32_t>({3, 0, 1, 2, 4, 0, 1, 2, 3, 4, 0, 2, 1, 4}, true) +
                         line_end;
  return text(fmt::format(
             "# vtk DataFile Version {}\ntwo\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n",
             with_offsets ? "5.1" : "4.2")) +
         coordinates(true) + line_end + cells + text("CELL_TYPES 3\n") + bytes<int32_t>({5, 10, 10}, true) +
         text("\nCELL_DATA 3\nFIELD FieldData 1\nmaterial 1 3 short\n") + bytes<int16_t>({7, 1, 2}, true) +
         text("\nMETADATA\nINFORMATION 0\n\n");
}

}  // namespace tendril::fem::testing
