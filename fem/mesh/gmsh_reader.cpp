// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <set>
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

// Groups of one entity: so many would not be drawn, and each costs memory for every element of the entity.
constexpr size_t kMostGroups = 100;

using Entity = std::pair<int, int>;  // dimension, tag
using Group = std::pair<int, long>;  // dimension, physical tag without its sign, which only turns normals
using Groups = std::map<Entity, std::set<Group>>;
using NodeIndices = std::unordered_map<long, int>;
using Sections = std::map<std::string, TextCursor, std::less<>>;

/// Where the line begins that closes a section; npos where none does.
size_t find_end(std::string_view text, size_t from, const std::string& name) {
  constexpr std::string_view kBlanks = " \t\r";
  const std::string end = "$End" + name;
  for (size_t at = text.find(end, from); at != text.npos; at = text.find(end, at + 1)) {
    const size_t before = text.find_last_not_of(kBlanks, at - 1), after = at + end.size();
    const bool starts_line = before == text.npos || text[before] == '\n';
    const bool ends_word =
        after == text.size() || kBlanks.find(text[after]) != kBlanks.npos || text[after] == '\n';
    if (starts_line && ends_word) return at;
  }
  return text.npos;
}

/// Cursors on what stands between $NAME and $EndNAME, by name. What other sections hold ($Comments for
/// instance) is not looked at.
Sections find_sections(TextCursor in) {
  static const std::set<std::string, std::less<>> kRead = {
      "MeshFormat", "PhysicalNames", "Entities", "PartitionedEntities", "Nodes", "Elements"};
  Sections sections;
  while (!in.at_end()) {
    const std::string_view line = in.line();
    if (!line.starts_with('$')) continue;
    const std::string name(line.substr(1, line.find_first_of(" \t") - 1));
    const size_t end = find_end(in.text(), in.position(), name);
    if (kRead.contains(name)) {
      if (end == in.text().npos)
        in.fail_with(fmt::format("section ${} has no end, expected $End{}", name, name));
      if (!sections.emplace(name, in.part(in.position(), end)).second)
        in.fail_with(fmt::format("found a second section ${}, expected one", name));
    }
    if (end != in.text().npos) in = in.part(end + 1, in.text().size()), in.line();
  }
  return sections;
}

TextCursor section(const Sections& sections, const TextCursor& file, const char* name) {
  const auto found = sections.find(name);
  return found == sections.end() ? file.part(0, 0) : found->second;
}

TextCursor required_section(const Sections& sections, const TextCursor& file, const char* name) {
  TextCursor in = section(sections, file, name);
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

std::array<size_t, 4> read_entity_counts(TextCursor& in) {
  std::array<size_t, 4> counts{};
  for (auto& count : counts) count = in.count("a number of entities");
  return counts;
}

long physical_tag(TextCursor& in) { return std::abs(long{in.number<int>("a physical tag")}); }

/// What follows an entity's tags: its extent (a point has one triple of coordinates, others have two), its
/// groups and its boundary.
/// @param group_dimension  of the groups
void read_extent_and_groups(TextCursor& in, const Entity& entity, int group_dimension, Groups& groups) {
  for (int c = 0; c < (entity.first == 0 ? 3 : 6); ++c) in.number<double>("a coordinate");
  const size_t physical = in.count("a number of physical groups");
  for (size_t p = 0; p < physical; ++p) groups[entity].emplace(group_dimension, physical_tag(in));
  if (physical > 0 && groups[entity].size() > kMostGroups)
    in.fail_with(
        fmt::format("found {} physical groups of one entity, expected {} at most", physical, kMostGroups));
  if (entity.first == 0) return;
  const size_t boundary = in.count("a number of bounding entities");
  for (size_t b = 0; b < boundary; ++b) in.number<int>("a bounding entity");
}

void read_entities(TextCursor in, Groups& groups) {
  if (in.at_end()) return;
  const auto counts = read_entity_counts(in);
  for (int dimension = 0; dimension < 4; ++dimension)
    for (size_t k = 0; k < counts[dimension]; ++k)
      read_extent_and_groups(in, {dimension, in.number<int>("an entity tag")}, dimension, groups);
}

/// The entities that a partitioned mesh is divided into, and their groups. Refuses a file that holds some of
/// the partitions only.
void read_partitioned_entities(TextCursor in, Groups& groups) {
  if (in.at_end()) return;
  const auto partitions = in.number<size_t>("a number of partitions");
  const size_t ghosts = in.count("a number of ghost entities");
  for (size_t k = 0; k < 2 * ghosts; ++k) in.number<int>("a ghost entity and its partition");
  const auto counts = read_entity_counts(in);
  std::set<int> present;  // what is on one partition only is in that one's file
  for (int dimension = 0; dimension < 4; ++dimension)
    for (size_t k = 0; k < counts[dimension]; ++k) {
      const int tag = in.number<int>("an entity tag");
      // A wall between partitions of a solid has the groups of the solid.
      const int parent = std::clamp(in.number<int>("a parent's dimension"), dimension, 3);
      in.number<int>("a parent's tag");
      const size_t of_entity = in.count("a number of partitions");
      for (size_t p = 0; p < of_entity; ++p) {
        const int partition = in.number<int>("a partition");
        if (of_entity == 1) present.insert(partition);
      }
      read_extent_and_groups(in, {dimension, tag}, parent, groups);
    }
  if (present.size() < partitions)
    in.fail_with(fmt::format(
        "found {} of the {} partitions of the mesh, expected all in one file; write them into one "
        "(Mesh.PartitionSplitMeshFiles = 0) or do not divide the mesh",
        present.size(), partitions));
}

std::map<Group, std::string> read_physical_names(TextCursor in) {
  std::map<Group, std::string> names;
  if (in.at_end()) return names;
  const size_t count = in.count("a number of names");
  for (size_t k = 0; k < count; ++k) {
    const int dimension = in.number<int>("a dimension");
    const long tag = physical_tag(in);
    const std::string_view line = in.line();
    const auto open = line.find('"'), close = line.rfind('"');
    if (open == line.npos || close == open) in.fail("a name in quotes");
    if (close > open + 1) names[{dimension, tag}] = line.substr(open + 1, close - open - 1);
  }
  return names;
}

/// Names the groups that have none after their tag: physical_3, or physical_surface_3 where another one of
/// that tag has another dimension.
void name_the_others(const Groups& groups, std::map<Group, std::string>& names) {
  static constexpr std::array kDimensions = {"point", "curve", "surface", "volume"};
  std::map<long, std::set<int>> dimensions;  // of the groups without names, by tag
  for (const auto& [entity, of_entity] : groups)
    for (const auto& [dimension, tag] : of_entity)
      if (!names.contains({dimension, tag})) dimensions[tag].insert(dimension);
  for (const auto& [tag, of_tag] : dimensions)
    for (const int dimension : of_tag)
      names[{dimension, tag}] = of_tag.size() == 1
                                    ? fmt::format("physical_{}", tag)
                                    : fmt::format("physical_{}_{}", kDimensions[dimension], tag);
}

/// Refuses names of groups that no element is in: the program that wrote the file lost what they name.
void check_none_is_lost(const std::string& file, const std::map<Group, std::string>& names,
                        const std::set<Group>& with_elements) {
  std::string lost;
  for (const auto& [group, name] : names)
    if (!with_elements.contains(group)) lost += fmt::format("{}'{}'", lost.empty() ? "" : ", ", name);
  if (!lost.empty())
    throw MeshError(fmt::format(
        "{}: no element is in the physical groups {}, which $PhysicalNames lists; define them anew after the "
        "last change of the geometry and write the file with Gmsh, or remove their names",
        file, lost));
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

/// @return  the groups that have elements
std::set<Group> read_elements(TextCursor in, const NodeIndices& index_of, const Groups& groups,
                              const std::map<Group, std::string>& names, MeshBuilder& builder) {
  std::set<Group> with_elements;
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
    const size_t in_block = in.count("a number of elements");
    std::set<int> group_numbers;
    if (const auto found = groups.find({dimension, entity}); found != groups.end() && in_block > 0)
      for (const Group& group : found->second) {
        group_numbers.insert(builder.group(names.at(group)));
        with_elements.insert(group);
      }
    const std::vector<int> of_block(group_numbers.begin(), group_numbers.end());
    std::vector<int> corners(type == kTet ? 4 : flat->second);
    for (size_t k = 0; k < in_block; ++k) {
      in.number<long>("an element tag");
      for (int& corner : corners) {
        const auto node = index_of.find(in.number<long>("a node tag"));
        if (node == index_of.end()) in.fail("the tag of a node in $Nodes");
        corner = node->second;
      }
      if (type == kTet)
        builder.add_tet({corners[0], corners[1], corners[2], corners[3]}, of_block);
      else
        builder.add_nodes(corners, of_block);
    }
  }
  return with_elements;
}

}  // namespace

Mesh read_gmsh(const std::string& text, const std::string& file) {
  const TextCursor whole(text, file);
  const Sections sections = find_sections(whole);
  check_version(required_section(sections, whole, "MeshFormat"));
  Groups groups;
  read_entities(section(sections, whole, "Entities"), groups);
  read_partitioned_entities(section(sections, whole, "PartitionedEntities"), groups);
  const auto listed = read_physical_names(section(sections, whole, "PhysicalNames"));
  std::map<Group, std::string> names = listed;
  name_the_others(groups, names);

  NodeIndices index_of;
  MeshBuilder builder(read_nodes(required_section(sections, whole, "Nodes"), index_of));
  const std::set<Group> with_elements =
      read_elements(required_section(sections, whole, "Elements"), index_of, groups, names, builder);
  check_none_is_lost(file, listed, with_elements);
  return std::move(builder).finish(LooseNodes::kKeptInGroups);
}

}  // namespace tendril::fem
