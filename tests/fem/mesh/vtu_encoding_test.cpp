// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <zlib.h>

#include <catch2/catch.hpp>

#include "fem/mesh/mesh_formats.h"
#include "tests/fem/mesh/mesh_files.h"
#include "tests/fem/mesh/vtk_files.h"

namespace tendril::fem::vtu_encoding_test {

using Catch::Matchers::Contains;
using testing::bytes;
using testing::check_two_tets;
using testing::edited;
using testing::vtu;
using testing::VtuArray;

std::string base64(const std::string& data) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (size_t k = 0; k < data.size(); k += 3) {
    unsigned bits = 0;
    for (size_t l = 0; l < 3; ++l)
      bits = bits << 8 | (k + l < data.size() ? static_cast<unsigned char>(data[k + l]) : 0);
    for (size_t l = 0; l < 4; ++l) text += k + l > data.size() ? '=' : kDigits[bits >> (18 - 6 * l) & 63];
  }
  return text;
}

std::string wrapped(const std::string& text, size_t width) {
  std::string lines;
  for (size_t k = 0; k < text.size(); k += width) lines += "\n    " + text.substr(k, width);
  return lines + "\n";
}

/// The bytes of an array of the two tetrahedra.
std::string content(const VtuArray& array) {
  const std::string name = array.name;
  if (name == "material") return bytes<int32_t>({7, 1, 2}, false);
  if (name == "Points") return testing::coordinates(false);
  if (name == "connectivity") return bytes<int64_t>({0, 1, 2, 0, 1, 2, 3, 0, 2, 1, 4}, false);
  if (name == "offsets") return bytes<int64_t>({3, 7, 11}, false);
  return bytes<uint8_t>({5, 10, 10}, false);
}

std::string size(size_t number) { return bytes<uint32_t>({static_cast<uint32_t>(number)}, false); }

/// The header of blocks packed with zlib, and the bytes packed in one block.
std::pair<std::string, std::string> packed(const std::string& data) {
  uLongf length = compressBound(data.size());
  std::string result(length, '\0');
  compress(reinterpret_cast<Bytef*>(result.data()), &length, reinterpret_cast<const Bytef*>(data.data()),
           data.size());
  result.resize(length);
  return {size(1) + size(data.size()) + size(0) + size(length), result};
}

std::string binary(const std::function<std::string(const std::string&)>& encoded) {
  return vtu("byte_order=\"LittleEndian\" header_type=\"UInt32\"",
             [&](const VtuArray& array) { return "format=\"binary\">" + encoded(content(array)); });
}

std::string packed_binary(const std::function<std::string(const std::string&)>& encoded) {
  return edited(binary(encoded), "header_type", "compressor=\"vtkZLibDataCompressor\" header_type");
}

Mesh read(const std::string& text) { return read_vtu(text, "a.vtu"); }

std::string refused(const std::string& text) {
  return testing::refusal([&] { read(text); });
}

TEST_CASE("Base64 is read with the header joined or by itself, in one line or many", "[unit]") {
  const auto joined = [](const std::string& data) { return base64(size(data.size()) + data); };
  const auto apart = [](const std::string& data) { return base64(size(data.size())) + base64(data); };
  check_two_tets(read(binary(joined)));
  check_two_tets(read(binary(apart)));
  for (const size_t width : {1, 3, 76}) {
    check_two_tets(read(binary([&](const std::string& data) { return wrapped(joined(data), width); })));
    check_two_tets(read(binary([&](const std::string& data) { return wrapped(apart(data), width); })));
  }
  const auto packed_apart = [](const std::string& data) {
    return base64(packed(data).first) + base64(packed(data).second);
  };
  const auto packed_joined = [](const std::string& data) {
    return base64(packed(data).first + packed(data).second);
  };
  check_two_tets(read(packed_binary(packed_apart)));
  check_two_tets(read(packed_binary(packed_joined)));
  check_two_tets(
      read(packed_binary([&](const std::string& data) { return wrapped(packed_apart(data), 76); })));
}

TEST_CASE("Appended base64 may have its headers by themselves", "[unit]") {
  std::string appended;
  const std::string text = vtu("header_type=\"UInt32\"", [&](const VtuArray& array) {
    const std::string start = fmt::format("format=\"appended\" offset=\"{}\">", appended.size());
    appended += base64(size(content(array).size())) + base64(content(array));
    return start;
  });
  check_two_tets(
      read(edited(text, "</VTKFile>", "<AppendedData>_" + appended + "</AppendedData></VTKFile>")));
}

TEST_CASE("Appended base64 may fill the file to its end", "[unit]") {
  constexpr size_t kMore = 500;  // points that no cell names
  const auto of = [](const VtuArray& array) {
    const bool points = std::string(array.name) == "Points";
    return content(array) + std::string(points ? kMore * 3 * sizeof(float) : 0, '\0');
  };
  const auto encode = [&](const VtuArray& array) { return base64(size(of(array).size()) + of(array)); };
  std::string appended;
  const std::string text = vtu("header_type=\"UInt32\"", [&](const VtuArray& array) {
    const std::string encoded = encode(array), last = "@@@@";
    const std::string start = fmt::format("format=\"appended\" offset=\"{}\">",
                                          encoded.size() > kMore ? last : std::to_string(appended.size()));
    if (encoded.size() <= kMore) appended += encoded;
    return start;
  });
  std::string whole = edited(text, "@@@@", std::to_string(appended.size()));
  whole = edited(whole, "NumberOfPoints=\"5\"", fmt::format("NumberOfPoints=\"{}\"", 5 + kMore));
  for (const VtuArray& array : testing::kArrays)
    if (encode(array).size() > kMore) appended += encode(array);
  whole = edited(whole, "</VTKFile>", "<AppendedData>_" + appended + "</AppendedData></VTKFile>");
  check_two_tets(read(whole));
}

TEST_CASE("An array without a format is ASCII", "[unit]") {
  check_two_tets(read(vtu("", [](const VtuArray& array) { return fmt::format(">\n{}\n", array.ascii); })));
  check_two_tets(read(vtu("", [](const VtuArray& array) {
    return fmt::format("format=\"ascii\"><!-- a comment -->\n{}\n<InformationKey name=\"RANGE\"/>",
                       array.ascii);
  })));
}

/// The two tetrahedra in a piece each, and their triangle in the first: the pieces have three points in
/// common.
std::string in_pieces(const std::string& second_label) {
  const auto piece = [](const char* points, int count, const char* connectivity, const char* offsets,
                        const char* types, const std::string& label) {
    return fmt::format(
        "<Piece NumberOfPoints=\"4\" NumberOfCells=\"{}\"><CellData><DataArray type=\"Int32\" {}</DataArray>"
        "</CellData><Points><DataArray type=\"Float64\" "
        "NumberOfComponents=\"3\">{}</DataArray></Points><Cells>"
        "<DataArray type=\"Int64\" Name=\"connectivity\">{}</DataArray><DataArray type=\"Int64\" "
        "Name=\"offsets\">{}</DataArray><DataArray type=\"UInt8\" "
        "Name=\"types\">{}</DataArray></Cells></Piece>",
        count, label, points, connectivity, offsets, types);
  };
  return "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"0\" "
         "NumberOfCells=\"0\"/>" +
         piece("0 0 0 1000 0 0 0 1000 0 0 0 1000", 2, "0 1 2 0 1 2 3", "3 7", "5 10",
               "Name=\"material\">7 1") +
         piece("0 0 -1000 0 1000 0 -0 0 0 1000 0 0", 1, "2 1 3 0", "4", "10", second_label) +
         "</UnstructuredGrid></VTKFile>";
}

TEST_CASE("The pieces of a grid are one mesh, joined where they have points in common", "[unit]") {
  check_two_tets(read(in_pieces("Name=\"material\">2")));
  CHECK_THAT(refused(in_pieces("Name=\"other\">2")),
             Contains("a.vtu: cell array 'other' is in some pieces only, expected it in all"));
  CHECK_THAT(refused(edited(in_pieces("Name=\"material\">2"), "2 1 3 0", "2 1 3 4")),
             Contains("a.vtu: a piece names point 4, expected 0 to 3"));
}

TEST_CASE("Numbers of cells and points sort no cells", "[unit]") {
  const std::string text = edited(testing::ascii_vtu(), "<CellData>", "<CellData GlobalIds=\"material\">");
  CHECK(read(text).volumes.empty());
}

TEST_CASE("A VTK file of something else says what it is", "[unit]") {
  CHECK_THAT(refused("<VTKFile type=\"PUnstructuredGrid\"/>"),
             Contains("found a VTKFile of type PUnstructuredGrid, expected UnstructuredGrid"));
}

TEST_CASE("Sizes of packed blocks that do not fit are refused before anything is unpacked", "[unit]") {
  // Of an array of 12 bytes: number of blocks, their size unpacked, that of the last, and sizes packed.
  const auto header = [](std::initializer_list<uint32_t> sizes) {
    return packed_binary([&](const std::string& data) {
      return data.size() == 12 ? base64(bytes(sizes, false)) + base64(packed(data).second)
                               : base64(packed(data).first) + base64(packed(data).second);
    });
  };
  const auto length = static_cast<uint32_t>(packed(content(testing::kArrays[0])).second.size());
  check_two_tets(read(header({1, 12, 0, length})));
  check_two_tets(read(header({1, 0, 12, length})));
  for (const auto& sizes :
       std::initializer_list<std::initializer_list<uint32_t>>{{0, 12, 0},
                                                              {1, 13, 0, length},
                                                              {1, 12, 24, length},
                                                              {2, 12, 0, length, 0},
                                                              {2, 0, 12, length, 0},
                                                              {3, 0x80000000, 12, length, 0, 0},
                                                              {2, 0xFFFFFFFF, 0, length, 0},
                                                              {1, 12, 0, 0xFFFFFFFF},
                                                              {0xFFFFFFFF, 12, 0},
                                                              {0x100000, 0x1000, 12}}) {
    CHECK_THAT(refused(header(sizes)), Contains("a.vtu: byte ") && Contains("array 'material': found "));
    // Where there are no cells, no size fits.
    const std::string no_cells = edited(header(sizes), "NumberOfCells=\"3\"", "NumberOfCells=\"0\"");
    CHECK_THAT(refused(no_cells), Contains("a.vtu: byte ") && Contains("': found "));
  }
}

TEST_CASE("A small file asks for little memory, whatever counts it names", "[unit]") {
  // A hundred million points at one place pack into 1.2 MB, and the cells that name them.
  for (const char* count : {"NumberOfPoints", "NumberOfCells"}) {
    const std::string text =
        edited(testing::packed_vtu(), fmt::format("{}=\"{}\"", count, count[8] == 'P' ? 5 : 3),
               fmt::format("{}=\"100000000\"", count));
    CHECK_THAT(refused(text),
               Contains(fmt::format("found {} '100000000', expected a number of items", count)));
  }
  const std::string zeros(std::size_t{1} << 23, '\0');
  const std::string many =
      edited(edited(packed_binary([&](const std::string& data) {
                      const auto [head, body] = packed(data.size() == 12 || data.size() == 3 ? zeros : data);
                      return base64(head) + base64(body);
                    }),
                    "NumberOfCells=\"3\"", fmt::format("NumberOfCells=\"{}\"", zeros.size())),
             "type=\"Int32\" Name=\"material\"", "type=\"UInt8\" Name=\"material\"");
  CHECK(many.size() < 50000);
  CHECK_THAT(refused(many), Contains("NumberOfCells '8388608', expected a number of items that are there"));
}

TEST_CASE("Bytes that end with the file are all there, and one less is told", "[unit]") {
  const std::string whole = testing::raw_vtu();
  const std::string last = whole.substr(0, whole.find("</AppendedData>"));
  check_two_tets(read_vtu(last, "a.vtu"));
  CHECK_THAT(refused(last.substr(0, last.size() - 1)), Contains("found the end of the file, expected"));
}

TEST_CASE("Labels of one cell with many nodes ask for little memory", "[unit]") {
  // One polygon; each label would name all its nodes again. In either of the formats, text.
  const auto zeros = [](int count) {
    std::string text;
    for (int k = 0; k < count; ++k) text += "0 ";
    return text;
  };
  const auto vtu = [&](int nodes, int labels) {
    std::string text =
        "<VTKFile><UnstructuredGrid><Piece NumberOfPoints=\"1\" NumberOfCells=\"1\"><Points><DataArray>0 0 "
        "0</DataArray></Points><Cells><DataArray Name=\"types\">7</DataArray>";
    text += fmt::format("<DataArray Name=\"offsets\">{}</DataArray><DataArray Name=\"connectivity\">{}",
                        nodes, zeros(nodes));
    text += "</DataArray></Cells><CellData>";
    for (int k = 0; k < labels; ++k)
      text += fmt::format("<DataArray type=\"Int8\" Name=\"{}\">1</DataArray>", k);
    return text + "</CellData></Piece></UnstructuredGrid></VTKFile>";
  };
  const auto vtk = [&](int nodes, int labels) {
    std::string text = fmt::format(
        "# vtk DataFile Version 4.2\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 1 float\n0 0 0\nCELLS 1 "
        "{}\n{} "
        "{}\nCELL_TYPES 1\n7\nCELL_DATA 1\nFIELD f {}\n",
        nodes + 1, nodes, zeros(nodes), labels);
    for (int k = 0; k < labels; ++k) text += fmt::format("{} 1 1 int\n1\n", k);
    return text;
  };
  const std::string said = "labels of cells, each for 50000 nodes of theirs, are more than a file of";
  CHECK_THAT(testing::refusal([&] { read_vtu(vtu(50000, 1000), "a.vtu"); }), Contains("1000 " + said));
  CHECK_THAT(testing::refusal([&] { read_vtk_legacy(vtk(50000, 1000), "a.vtk"); }), Contains("1000 " + said));
  CHECK(testing::refusal([&] { read_vtu(vtu(50000, 5), "a.vtu"); }) == "no error");
  CHECK(testing::refusal([&] { read_vtk_legacy(vtk(50000, 5), "a.vtk"); }) == "no error");
}

}  // namespace tendril::fem::vtu_encoding_test
