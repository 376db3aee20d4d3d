#include <fmt/format.h>

#include <unordered_map>

#include "fem/mesh/mesh_builder.h"
#include "fem/mesh/mesh_formats.h"
#include "fem/mesh/text_cursor.h"

// The format: Gmsh reference manual, "MSH file format", version 4.1.

namespace tendril::fem {
namespace {

constexpr int kTet = 4, kCurvedTet = 11;
// Element types that may stand beside tetrahedra, and their numbers of nodes: points, lines and faces.
const std::map<int, int> kFlatTypes = {{15, 1}, {1, 2}, {8, 3}, {2, 3}, {9, 6}, {3, 4}, {16, 8}, {10, 9}};

using Entity = std::pair<int, int>;  // dimension, tag
using NodeIndices = std::unordered_map<long, int>;

/// A cursor on what stands between $name and $Endname, or on nothing where there is no such section.
TextCursor section(const TextCursor& file, const std::string& name) {
  const std::string_view text = file.text();
  for (size_t begin = text.find("$" + name); begin != text.npos; begin = text.find("$" + name, begin + 1)) {
    TextCursor in = file.part(begin, text.size());
    if (in.word() != "$" + name) continue;  // another name that starts alike
    const auto end = text.find("$End" + name, begin);
    if (end == text.npos) in.fail_with(fmt::format("section ${} has no end, expected $End{}", name, name));
    return file.part(in.position(), end);
  }
  return file.part(0, 0);
}

TextCursor required_section(const TextCursor& file, const std::string& name) {
  TextCursor in = section(file, name);
  if (in.at_end())
    throw MeshError(
        fmt::format("{}: section ${} is missing or empty; expected Gmsh 4.1 ASCII", file.file(), name));
  return in;
}

void check_version(TextCursor in) {
  const auto version = in.number<double>("the version");
  const int binary = in.number<int>("the file type");
  if (version != 4.1 || binary != 0)
    in.fail_with(
        fmt::format("found MSH {} {}, expected MSH 4.1 ASCII; convert with: gmsh IN -save -format "
                    "msh41 -bin 0 -o OUT.msh",
                    version, binary ? "binary" : "ASCII"));
}

/// Physical groups of each entity; points have one triple of coordinates, the others two.
std::map<Entity, std::vector<int>> read_entities(TextCursor in) {
  std::map<Entity, std::vector<int>> groups;
  if (in.at_end()) return groups;
  std::array<size_t, 4> counts{};
  for (auto& count : counts) count = in.count("a number of entities");
  for (int dimension = 0; dimension < 4; ++dimension)
    for (size_t k = 0; k < counts[dimension]; ++k) {
      const int tag = in.number<int>("an entity tag");
      for (int c = 0; c < (dimension == 0 ? 3 : 6); ++c) in.number<double>("a coordinate");
      const size_t physical = in.count("a number of physical groups");
      for (size_t p = 0; p < physical; ++p)
        groups[{dimension, tag}].push_back(in.number<int>("a physical group"));
      if (dimension == 0) continue;
      const size_t boundary = in.count("a number of bounding entities");
      for (size_t b = 0; b < boundary; ++b) in.number<int>("a bounding entity");
    }
  return groups;
}

std::map<Entity, std::string> read_physical_names(TextCursor in) {
  std::map<Entity, std::string> names;
  if (in.at_end()) return names;
  const size_t count = in.count("a number of names");
  for (size_t k = 0; k < count; ++k) {
    const int dimension = in.number<int>("a dimension");
    const int tag = in.number<int>("a physical tag");
    const std::string_view line = in.line();
    const auto open = line.find('"'), close = line.rfind('"');
    if (open == line.npos || close == open) in.fail("a name in quotes");
    names[{dimension, tag}] = line.substr(open + 1, close - open - 1);
  }
  return names;
}

Eigen::Matrix3Xd read_nodes(TextCursor in, NodeIndices& index_of) {
  const size_t blocks = in.count("a number of blocks");
  const size_t count = in.count("a number of nodes");
  in.number<long>("the smallest tag"), in.number<long>("the largest tag");
  Eigen::Matrix3Xd nodes(3, count);
  int filled = 0;
  for (size_t b = 0; b < blocks; ++b) {
    const int dimension = in.number<int>("a dimension");
    in.number<int>("an entity tag");
    const bool parametric = in.number<int>("the parametric flag") != 0;
    const size_t in_block = in.count("a number of nodes");
    if (filled + in_block > count) in.fail(fmt::format("no more than the {} nodes announced", count));
    for (size_t k = 0; k < in_block; ++k)
      if (!index_of.emplace(in.number<long>("a node tag"), filled + static_cast<int>(k)).second)
        in.fail("a node tag that no other node has");
    for (size_t k = 0; k < in_block; ++k, ++filled) {
      for (int c = 0; c < 3; ++c) nodes(c, filled) = in.number<double>("a coordinate");
      for (int c = 0; parametric && c < dimension; ++c) in.number<double>("a parameter");
    }
  }
  if (filled != nodes.cols()) in.fail_with(fmt::format("found {} nodes, expected {}", filled, count));
  return nodes;
}

void read_elements(TextCursor in, const NodeIndices& index_of,
                   const std::map<Entity, std::vector<std::string>>& groups, MeshBuilder& builder) {
  const size_t blocks = in.count("a number of blocks");
  for (int skip = 0; skip < 3; ++skip) in.number<long>("a count or tag");
  for (size_t b = 0; b < blocks; ++b) {
    const int dimension = in.number<int>("a dimension");
    const int entity = in.number<int>("an entity tag");
    const int type = in.number<int>("an element type");
    const auto flat = kFlatTypes.find(type);
    if (type == kCurvedTet)
      in.fail_with(
          fmt::format("found second-order tetrahedra (type {}), expected linear ones (type {}); export with "
                      "element order 1 (Mesh.ElementOrder = 1)",
                      kCurvedTet, kTet));
    if (type != kTet && flat == kFlatTypes.end())
      in.fail("element type 4, the linear tetrahedron, or faces, lines and points (Mesh.ElementOrder = 1)");
    const auto found = groups.find({dimension, entity});
    const std::vector<std::string> names = found == groups.end() ? std::vector<std::string>{} : found->second;
    const size_t in_block = in.count("a number of elements");
    std::vector<int> corners(type == kTet ? 4 : flat->second);
    for (size_t k = 0; k < in_block; ++k) {
      in.number<long>("an element tag");
      for (int& corner : corners) {
        const auto node = index_of.find(in.number<long>("a node tag"));
        if (node == index_of.end()) in.fail("the tag of a node in $Nodes");
        corner = node->second;
      }
      if (type == kTet)
        builder.add_tet({corners[0], corners[1], corners[2], corners[3]}, names);
      else
        builder.add_nodes(corners, names);
    }
  }
}

}  // namespace

Mesh read_gmsh(const std::string& text, const std::string& file) {
  const TextCursor whole(text, file);
  check_version(required_section(whole, "MeshFormat"));
  const auto name_of = read_physical_names(section(whole, "PhysicalNames"));
  std::map<Entity, std::vector<std::string>> groups;
  for (const auto& [entity, tags] : read_entities(section(whole, "Entities")))
    for (const int tag : tags)
      if (const auto name = name_of.find({entity.first, tag}); name != name_of.end())
        groups[entity].push_back(name->second);

  NodeIndices index_of;
  MeshBuilder builder(read_nodes(required_section(whole, "Nodes"), index_of));
  read_elements(required_section(whole, "Elements"), index_of, groups, builder);
  return std::move(builder).finish();
}

}  // namespace tendril::fem
