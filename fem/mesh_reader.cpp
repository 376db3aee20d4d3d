#include "fem/mesh_reader.h"

#include <fmt/format.h>

#include <charconv>
#include <fstream>
#include <pugixml.hpp>
#include <set>
#include <sstream>
#include <unordered_map>

namespace tendril::fem {
namespace {

constexpr int kGmshTet4 = 4;
constexpr int kVtkTet4 = 10;

/// Numbers of one text block, in order, with the place of the first one that does not parse.
class Numbers {
 public:
  Numbers(std::string_view text, std::string where) : rest_(text), where_(std::move(where)) {}

  template <typename T>
  T next(const char* what) {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
    T value{};
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    if (error != std::errc{})
      throw MeshError(fmt::format("{}: found '{}' where {} is expected", where_, rest_.substr(0, 20), what));
    rest_.remove_prefix(static_cast<size_t>(end - rest_.data()));
    return value;
  }

  std::string_view line() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
    const std::string_view line = rest_.substr(0, rest_.find('\n'));
    rest_.remove_prefix(line.size());
    return line;
  }

 private:
  std::string_view rest_;
  std::string where_;
};

/// The text between $name and $Endname; throws where the section must exist and does not.
std::string_view section(std::string_view text, const std::string& name, const std::string& file,
                         bool required) {
  const auto begin = text.find("$" + name + "\n");
  const auto end = text.find("$End" + name);
  if (begin == std::string_view::npos || end == std::string_view::npos) {
    if (!required) return {};
    throw MeshError(fmt::format("{}: section ${} is missing; expected Gmsh 4.1 ASCII", file, name));
  }
  const auto start = begin + name.size() + 2;
  return text.substr(start, end - start);
}

using Entity = std::pair<int, int>;  // dimension, tag

/// Physical groups of each entity, from $Entities (MSH 4.1: points have one coordinate triple, others two).
std::map<Entity, std::vector<int>> read_entities(std::string_view text, const std::string& file) {
  std::map<Entity, std::vector<int>> groups;
  if (text.empty()) return groups;
  Numbers in(text, file + ": $Entities");
  std::array<long, 4> counts{};
  for (auto& count : counts) count = in.next<long>("a number of entities");
  for (int dimension = 0; dimension < 4; ++dimension)
    for (long k = 0; k < counts[dimension]; ++k) {
      const int tag = in.next<int>("an entity tag");
      for (int c = 0; c < (dimension == 0 ? 3 : 6); ++c) in.next<double>("a coordinate");
      const long physical = in.next<long>("a number of physical groups");
      for (long p = 0; p < physical; ++p)
        groups[{dimension, tag}].push_back(in.next<int>("a physical group"));
      if (dimension == 0) continue;
      const long boundary = in.next<long>("a number of bounding entities");
      for (long b = 0; b < boundary; ++b) in.next<int>("a bounding entity");
    }
  return groups;
}

std::map<Entity, std::string> read_physical_names(std::string_view text, const std::string& file) {
  std::map<Entity, std::string> names;
  if (text.empty()) return names;
  Numbers in(text, file + ": $PhysicalNames");
  const long count = in.next<long>("a number of names");
  for (long k = 0; k < count; ++k) {
    const int dimension = in.next<int>("a dimension");
    const int tag = in.next<int>("a physical tag");
    const std::string_view line = in.line();
    const auto open = line.find('"'), close = line.rfind('"');
    if (open == std::string_view::npos || close == open)
      throw MeshError(fmt::format("{}: $PhysicalNames: found '{}', expected a name in quotes", file, line));
    names[{dimension, tag}] = line.substr(open + 1, close - open - 1);
  }
  return names;
}

Mesh read_msh(const std::string& text, const std::string& file, double unit) {
  Numbers format(section(text, "MeshFormat", file, true), file + ": $MeshFormat");
  const double version = format.next<double>("the version");
  const int binary = format.next<int>("the file type");
  if (version != 4.1 || binary != 0)
    throw MeshError(fmt::format("{}: found MSH {} {}, expected MSH 4.1 ASCII (gmsh -format msh41 -bin 0)",
                                file, version, binary ? "binary" : "ASCII"));
  const auto names = read_physical_names(section(text, "PhysicalNames", file, false), file);
  const auto groups = read_entities(section(text, "Entities", file, false), file);

  Mesh mesh;
  std::unordered_map<long, int> index_of;
  Numbers nodes(section(text, "Nodes", file, true), file + ": $Nodes");
  const long node_blocks = nodes.next<long>("a number of blocks");
  const long node_count = nodes.next<long>("a number of nodes");
  nodes.next<long>("the smallest tag"), nodes.next<long>("the largest tag");
  mesh.nodes.resize(3, node_count);
  int filled = 0;
  for (long b = 0; b < node_blocks; ++b) {
    const int dimension = nodes.next<int>("a dimension");
    nodes.next<int>("an entity tag");
    const bool parametric = nodes.next<int>("the parametric flag") != 0;
    const long in_block = nodes.next<long>("a number of nodes");
    if (filled + in_block > node_count)
      throw MeshError(fmt::format("{}: $Nodes: more nodes than the {} announced", file, node_count));
    for (long k = 0; k < in_block; ++k)
      index_of[nodes.next<long>("a node tag")] = filled + static_cast<int>(k);
    for (long k = 0; k < in_block; ++k, ++filled) {
      for (int c = 0; c < 3; ++c) mesh.nodes(c, filled) = unit * nodes.next<double>("a coordinate");
      for (int c = 0; parametric && c < dimension; ++c) nodes.next<double>("a parameter");
    }
  }

  std::map<std::string, std::set<int>> regions;
  Numbers elements(section(text, "Elements", file, true), file + ": $Elements");
  const long element_blocks = elements.next<long>("a number of blocks");
  for (int skip = 0; skip < 3; ++skip) elements.next<long>("a count or tag");
  for (long b = 0; b < element_blocks; ++b) {
    const int dimension = elements.next<int>("a dimension");
    const int entity = elements.next<int>("an entity tag");
    const int type = elements.next<int>("an element type");
    const long in_block = elements.next<long>("a number of elements");
    static const std::map<int, int> kNodesOf = {{15, 1}, {1, 2}, {2, 3}, {3, 4}, {kGmshTet4, 4}};
    const auto size = kNodesOf.find(type);
    if (size == kNodesOf.end())
      throw MeshError(
          fmt::format("{}: $Elements: element type {} is not supported; expected linear tetrahedra "
                      "(type 4) and linear faces of them",
                      file, type));
    std::vector<std::set<int>*> members;
    if (const auto found = groups.find({dimension, entity}); found != groups.end())
      for (int group : found->second)
        if (const auto name = names.find({dimension, group}); name != names.end())
          members.push_back(&regions[name->second]);
    for (long k = 0; k < in_block; ++k) {
      elements.next<long>("an element tag");
      std::array<int, 4> corner{};
      for (int c = 0; c < size->second; ++c) {
        const long tag = elements.next<long>("a node tag");
        const auto found = index_of.find(tag);
        if (found == index_of.end())
          throw MeshError(fmt::format("{}: $Elements: node {} does not exist", file, tag));
        corner[c] = found->second;
        for (auto* member : members) member->insert(corner[c]);
      }
      if (type == kGmshTet4) mesh.tets.push_back(corner);
    }
  }
  for (const auto& [name, set] : regions) mesh.regions[name].assign(set.begin(), set.end());
  return mesh;
}

Mesh read_vtu(const std::string& text, const std::string& file, double unit) {
  pugi::xml_document document;
  const auto parsed = document.load_buffer(text.data(), text.size());
  if (!parsed)
    throw MeshError(fmt::format("{}: not XML: {} at byte {}", file, parsed.description(), parsed.offset));
  const auto piece = document.child("VTKFile").child("UnstructuredGrid").child("Piece");
  if (!piece) throw MeshError(fmt::format("{}: expected VTKFile/UnstructuredGrid/Piece", file));

  const auto array = [&](const pugi::xml_node& parent, const char* name) {
    for (const auto& node : parent.children("DataArray")) {
      if (name && std::string_view(node.attribute("Name").value()) != name) continue;
      if (std::string_view(node.attribute("format").value()) != "ascii")
        throw MeshError(fmt::format("{}: array '{}' is {}, expected ascii (ParaView: Data Mode Ascii)", file,
                                    name ? name : "Points", node.attribute("format").value()));
      return Numbers(node.text().get(), fmt::format("{}: {}", file, name ? name : "Points"));
    }
    throw MeshError(fmt::format("{}: array '{}' is missing", file, name ? name : "Points"));
  };

  Mesh mesh;
  const long node_count = piece.attribute("NumberOfPoints").as_llong();
  const long cell_count = piece.attribute("NumberOfCells").as_llong();
  mesh.nodes.resize(3, node_count);
  Numbers points = array(piece.child("Points"), nullptr);
  for (long i = 0; i < node_count; ++i)
    for (int c = 0; c < 3; ++c) mesh.nodes(c, i) = unit * points.next<double>("a coordinate");

  Numbers types = array(piece.child("Cells"), "types");
  Numbers offsets = array(piece.child("Cells"), "offsets");
  Numbers connectivity = array(piece.child("Cells"), "connectivity");
  long before = 0;
  for (long k = 0; k < cell_count; ++k) {
    const int type = types.next<int>("a cell type");
    const long offset = offsets.next<long>("an offset");
    if (type == kVtkTet4 && offset - before != 4)
      throw MeshError(fmt::format("{}: cell {} is a tetrahedron with {} nodes", file, k, offset - before));
    std::array<int, 4> corner{};
    for (long c = before; c < offset; ++c) {
      const int node = connectivity.next<int>("a node index");
      if (type == kVtkTet4) corner[c - before] = node;
    }
    if (type == kVtkTet4) mesh.tets.push_back(corner);
    before = offset;
  }
  return mesh;
}

}  // namespace

Mesh read_mesh(const std::filesystem::path& file, double unit) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw MeshError(fmt::format("{}: cannot be opened", file.string()));
  std::ostringstream buffer;
  buffer << in.rdbuf();
  if (file.extension() == ".msh") return read_msh(buffer.str(), file.string(), unit);
  if (file.extension() == ".vtu") return read_vtu(buffer.str(), file.string(), unit);
  throw MeshError(
      fmt::format("{}: mesh format '{}' is not known; expected .msh (Gmsh 4.1 ASCII) or .vtu (ASCII)",
                  file.string(), file.extension().string()));
}

}  // namespace tendril::fem
