// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <pugixml.hpp>

#include "fem/mesh/joined_grid.h"
#include "fem/mesh/mesh_formats.h"
#include "fem/mesh/vtu_array.h"

// The format: "VTK file formats", https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html

namespace tendril::fem {
namespace {

/// Parses all but the appended data, which may be bytes that are no XML; notes where these begin.
pugi::xml_document parse(VtuFile& file) {
  pugi::xml_document document;
  const size_t tag = file.text.find("<AppendedData");
  const auto parsed =
      tag == std::string::npos
          ? document.load_buffer(file.text.data(), file.text.size(), pugi::parse_default,
                                 pugi::encoding_utf8)  // or offsets would not be those in the file
          : document.load_string((file.text.substr(0, tag) + "</VTKFile>").c_str());
  if (!parsed)
    throw MeshError(fmt::format("{}: byte {}: not XML: {}", file.name, parsed.offset, parsed.description()));
  if (tag == std::string::npos) return document;
  const size_t end = file.text.find('>', tag), underscore = file.text.find('_', end);
  if (underscore == std::string::npos)
    throw MeshError(
        fmt::format("{}: byte {}: found no '_', expected one before the appended data", file.name, tag));
  file.appended = underscore + 1;
  file.appended_raw = file.text.substr(tag, end - tag).find("raw") != std::string::npos;
  return document;
}

void read_header(const pugi::xml_node& root, VtuFile& file) {
  file.big_endian = std::string_view(root.attribute("byte_order").value()) == "BigEndian";
  if (std::string_view(root.attribute("header_type").value()) == "UInt64") file.header_bytes = 8;
  const std::string_view compressor = root.attribute("compressor").value();
  file.zlib = compressor == "vtkZLibDataCompressor";
  if (!compressor.empty() && !file.zlib)
    throw MeshError(
        fmt::format("{}: found compressor '{}', expected none or vtkZLibDataCompressor; save it again "
                    "(ParaView: Compressor Type)",
                    file.name, compressor));
}

size_t count(const VtuFile& file, const pugi::xml_node& piece, const char* attribute) {
  const auto value = piece.attribute(attribute).as_llong(-1);
  if (value < 0 || static_cast<size_t>(value) > file.numbers_left)
    throw MeshError(fmt::format("{}: byte {}: found {} '{}', expected a number of items that are there",
                                file.name, piece.offset_debug(), attribute,
                                piece.attribute(attribute).value()));
  return value;
}

pugi::xml_node array(const VtuFile& file, const pugi::xml_node& parent, const char* name) {
  const auto found = parent.find_child_by_attribute("DataArray", "Name", name);
  if (!found) throw MeshError(fmt::format("{}: array '{}' is missing in Cells", file.name, name));
  return found;
}

/// Reads the arrays of a piece.
VtkGrid read_piece(VtuFile& file, const pugi::xml_node& piece) {
  const size_t points = count(file, piece, "NumberOfPoints"), cells = count(file, piece, "NumberOfCells");
  VtkGrid grid;
  if (points == 0 && cells == 0) return grid;  // then there may be no arrays
  const auto coordinates = piece.child("Points").child("DataArray");
  if (!coordinates) throw MeshError(fmt::format("{}: the array of Points is missing", file.name));
  grid.points = Eigen::Map<const Eigen::Matrix3Xd>(read_array<double>(file, coordinates, 3 * points).data(),
                                                   3, static_cast<Eigen::Index>(points));
  const auto cells_node = piece.child("Cells");
  grid.types = read_array<int64_t>(file, array(file, cells_node, "types"), cells);
  grid.offsets = read_array<int64_t>(file, array(file, cells_node, "offsets"), cells);
  const int64_t nodes = grid.offsets.empty() ? 0 : std::max<int64_t>(grid.offsets.back(), 0);
  grid.connectivity = read_array<int64_t>(file, array(file, cells_node, "connectivity"), nodes);
  const auto cell_data = piece.child("CellData");
  for (const auto& data : cell_data.children("DataArray")) {
    const std::string name = data.attribute("Name").value();
    const bool numbers_cells = name == cell_data.attribute("GlobalIds").value() ||
                               name == cell_data.attribute("PedigreeIds").value();
    if (is_label(data) && !numbers_cells) grid.labels[name] = read_array<int64_t>(file, data, cells);
  }
  return grid;
}

}  // namespace

Mesh read_vtu(const std::string& text, const std::string& name) {
  VtuFile file{.text = text, .name = name};
  file.numbers_left = most_numbers(text.size());
  const pugi::xml_document document = parse(file);
  const auto root = document.child("VTKFile");
  const std::string_view type = root.attribute("type").value();
  if (!type.empty() && type != "UnstructuredGrid")
    throw MeshError(fmt::format(
        "{}: found a VTKFile of type {}, expected UnstructuredGrid: tetrahedra, not a surface, an "
        "image or a list of other files; save the grid as one .vtu file",
        name, type));
  const auto grid_node = root.child("UnstructuredGrid");
  if (!grid_node.child("Piece"))
    throw MeshError(fmt::format("{}: expected VTKFile/UnstructuredGrid/Piece", name));
  read_header(root, file);
  std::vector<VtkGrid> pieces;
  for (const auto& piece : grid_node.children("Piece")) {
    VtkGrid grid = read_piece(file, piece);
    if (grid.points.cols() > 0 || pieces.empty()) pieces.push_back(std::move(grid));
  }
  return to_mesh(joined(std::move(pieces), name), name, text.size());
}

}  // namespace tendril::fem
