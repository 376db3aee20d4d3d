// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/vtk_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <set>

#include "fem/mesh/mesh_builder.h"

namespace tendril::fem {
namespace {

// VTK's cell types [vtkCellType.h]: the tetrahedron, and those without a volume.
constexpr int64_t kVtkTet = 10;
const std::set<int64_t> kCurvedTets = {24, 71, 78};
const std::set<int64_t> kVtkFlatTypes = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  21, 22,
                                         23, 28, 30, 34, 35, 36, 68, 69, 70, 75, 76, 77};
// An array with more values than this numbers the cells and does not sort them.
constexpr size_t kMostLabels = 64;

template <typename Stored, typename T>
std::vector<T> numbers_stored_as(std::string_view bytes, bool big_endian) {
  std::vector<T> result(bytes.size() / sizeof(Stored));
  for (size_t k = 0; k < result.size(); ++k) {
    std::array<char, sizeof(Stored)> raw{};
    bytes.copy(raw.data(), sizeof(Stored), k * sizeof(Stored));
    if (big_endian != (std::endian::native == std::endian::big)) std::reverse(raw.begin(), raw.end());
    result[k] = static_cast<T>(std::bit_cast<Stored>(raw));
  }
  return result;
}

/// The groups of the cells: one for each value of each label, called `label_value`.
/// @return  for each label that sorts the cells, the number of each cell's group
std::vector<std::vector<int>> add_groups(const VtkGrid& grid, MeshBuilder& builder) {
  std::vector<std::vector<int>> groups;
  for (const auto& [name, values] : grid.labels) {
    if (values.size() != grid.types.size()) continue;  // counted against other cells, if any
    std::map<int64_t, int> number_of;
    for (auto value = values.begin(); value != values.end() && number_of.size() <= kMostLabels; ++value)
      number_of[*value] = 0;
    if (number_of.size() > kMostLabels) continue;
    for (auto& [value, number] : number_of) number = builder.group(fmt::format("{}_{}", name, value));
    auto& of_cells = groups.emplace_back();
    for (const auto value : values) of_cells.push_back(number_of[value]);
  }
  return groups;
}

void check_tet(const VtkGrid& grid, size_t cell, int64_t nodes, const std::string& file) {
  const int64_t type = grid.types[cell];
  if (kCurvedTets.contains(type))
    throw MeshError(
        fmt::format("{}: cell {} is a second-order tetrahedron (type {}), expected linear ones (type "
                    "{}); export with element order 1",
                    file, cell, type, kVtkTet));
  if (type != kVtkTet)
    throw MeshError(
        fmt::format("{}: cell {} is a solid of type {}, expected linear tetrahedra (type {}); divide it "
                    "into such (ParaView: Tetrahedralize)",
                    file, cell, type, kVtkTet));
  if (nodes != 4)
    throw MeshError(fmt::format("{}: cell {} is a tetrahedron with {} nodes, expected 4", file, cell, nodes));
}

}  // namespace

Mesh to_mesh(VtkGrid grid, const std::string& file, size_t file_bytes) {
  MeshBuilder builder(std::move(grid.points));
  const auto groups = add_groups(grid, builder);
  if (!groups.empty() && grid.connectivity.size() > 4 * most_numbers(file_bytes) / groups.size())
    throw MeshError(
        fmt::format("{}: {} labels of cells, each for {} nodes of theirs, are more than a file of {} bytes "
                    "should ask for; leave out labels that no group is made of",
                    file, groups.size(), grid.connectivity.size(), file_bytes));
  std::vector<int> nodes, of_cell(groups.size());
  int64_t begin = 0;
  for (size_t cell = 0; cell < grid.types.size(); ++cell) {
    const int64_t end = grid.offsets[cell];
    if (end < begin || end > std::ssize(grid.connectivity))
      throw MeshError(fmt::format("{}: cell {} ends at place {} of the connectivity, expected {} to {}", file,
                                  cell, end, begin, grid.connectivity.size()));
    nodes.clear();
    for (; begin < end; ++begin) {
      const int64_t node = grid.connectivity[begin];
      if (node < 0 || node >= builder.node_count())
        throw MeshError(fmt::format("{}: cell {} names point {}, expected 0 to {}", file, cell, node,
                                    builder.node_count() - 1));
      nodes.push_back(static_cast<int>(node));
    }
    for (size_t k = 0; k < groups.size(); ++k) of_cell[k] = groups[k][cell];
    if (kVtkFlatTypes.contains(grid.types[cell])) {
      builder.add_nodes(nodes, of_cell);
    } else {
      check_tet(grid, cell, std::ssize(nodes), file);
      builder.add_tet({nodes[0], nodes[1], nodes[2], nodes[3]}, of_cell);
    }
  }
  return std::move(builder).finish(LooseNodes::kDropped);
}

template <typename T>
std::vector<T> numbers(std::string_view bytes, NumberType type, bool big_endian) {
  using enum NumberType::Kind;
  if (type.kind == kFloat)
    return type.bytes == 4 ? numbers_stored_as<float, T>(bytes, big_endian)
                           : numbers_stored_as<double, T>(bytes, big_endian);
  const bool is_signed = type.kind == kSigned;
  switch (type.bytes) {
    case 1:
      return is_signed ? numbers_stored_as<int8_t, T>(bytes, big_endian)
                       : numbers_stored_as<uint8_t, T>(bytes, big_endian);
    case 2:
      return is_signed ? numbers_stored_as<int16_t, T>(bytes, big_endian)
                       : numbers_stored_as<uint16_t, T>(bytes, big_endian);
    case 4:
      return is_signed ? numbers_stored_as<int32_t, T>(bytes, big_endian)
                       : numbers_stored_as<uint32_t, T>(bytes, big_endian);
    default:
      return is_signed ? numbers_stored_as<int64_t, T>(bytes, big_endian)
                       : numbers_stored_as<uint64_t, T>(bytes, big_endian);
  }
}

template std::vector<double> numbers(std::string_view, NumberType, bool);
template std::vector<int64_t> numbers(std::string_view, NumberType, bool);
template std::vector<uint64_t> numbers(std::string_view, NumberType, bool);

}  // namespace tendril::fem
