#include <fmt/format.h>

#include <pugixml.hpp>

#include "fem/mesh/mesh_formats.h"
#include "fem/mesh/vtu_array.h"

// The format: "VTK file formats", https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html

namespace tendril::fem {
namespace {

/// Parses all but the appended data, which may be bytes that are no XML; notes where these begin.
pugi::xml_document parse(VtuFile& file) {
  pugi::xml_document document;
  const size_t tag = file.text.find("<AppendedData");
  const auto parsed = tag == std::string::npos
                          ? document.load_buffer(file.text.data(), file.text.size())
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
  // No format stores a cell or point in less than a bit; a wrong number must not ask for absurd memory.
  if (value < 0 || value > 8 * std::ssize(file.text) * 1032)
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

}  // namespace

Mesh read_vtu(const std::string& text, const std::string& name) {
  VtuFile file{.text = text, .name = name};
  const pugi::xml_document document = parse(file);
  const auto root = document.child("VTKFile");
  const auto grid_node = root.child("UnstructuredGrid");
  const auto piece = grid_node.child("Piece");
  if (!piece) throw MeshError(fmt::format("{}: expected VTKFile/UnstructuredGrid/Piece", name));
  if (piece.next_sibling("Piece"))
    throw MeshError(
        fmt::format("{}: byte {}: found a second Piece, expected one; merge them (ParaView: Merge Blocks)",
                    name, piece.next_sibling("Piece").offset_debug()));
  read_header(root, file);

  const size_t points = count(file, piece, "NumberOfPoints"), cells = count(file, piece, "NumberOfCells");
  const auto coordinates = piece.child("Points").child("DataArray");
  if (!coordinates) throw MeshError(fmt::format("{}: the array of Points is missing", name));
  VtkGrid grid;
  grid.points = Eigen::Map<const Eigen::Matrix3Xd>(read_array<double>(file, coordinates, 3 * points).data(),
                                                   3, static_cast<Eigen::Index>(points));
  const auto cells_node = piece.child("Cells");
  grid.types = read_array<std::int64_t>(file, array(file, cells_node, "types"), cells);
  grid.offsets = read_array<std::int64_t>(file, array(file, cells_node, "offsets"), cells);
  const std::int64_t nodes = grid.offsets.empty() ? 0 : std::max<std::int64_t>(grid.offsets.back(), 0);
  grid.connectivity = read_array<std::int64_t>(file, array(file, cells_node, "connectivity"), nodes);
  for (const auto& data : piece.child("CellData").children("DataArray"))
    if (is_label(data))
      grid.labels[data.attribute("Name").value()] = read_array<std::int64_t>(file, data, cells);
  return to_mesh(std::move(grid), name);
}

}  // namespace tendril::fem
