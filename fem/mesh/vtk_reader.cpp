#include <fmt/format.h>

#include "fem/mesh/mesh_formats.h"
#include "fem/mesh/text_cursor.h"
#include "fem/mesh/vtk_grid.h"

// The format: "VTK file formats", section "Simple legacy formats", and for version 5.1 what VTK 9 writes:
// cells as an array of offsets and one of connectivity. Binary numbers are big-endian.

namespace tendril::fem {
namespace {

using enum NumberType::Kind;
constexpr NumberType kInt = {kSigned, 4};

class LegacyReader {
 public:
  LegacyReader(const std::string& text, const std::string& file) : in_(text, file) {}

  VtkGrid read() {
    read_header();
    while (!in_.at_end()) read_section(in_.word());
    if (grid_.types.size() != grid_.offsets.size())
      in_.fail_with(fmt::format("found {} cells and {} cell types, expected as many of each",
                                grid_.offsets.size(), grid_.types.size()));
    return std::move(grid_);
  }

 private:
  void read_header() {
    constexpr std::string_view kMagic = "# vtk DataFile Version ";
    const std::string_view first = in_.line();
    if (!first.starts_with(kMagic) || first.size() == kMagic.size()) in_.fail("'# vtk DataFile Version'");
    has_offsets_ = first[kMagic.size()] >= '5';
    in_.line();  // the title
    const std::string_view encoding = in_.word();
    if (encoding != "ASCII" && encoding != "BINARY") in_.fail("ASCII or BINARY");
    binary_ = encoding == "BINARY";
    for (const char* expected : {"DATASET", "UNSTRUCTURED_GRID"})
      if (in_.word() != expected) in_.fail(expected);
    if (binary_) in_.count_bytes();
  }

  void read_section(std::string_view keyword) {
    if (keyword == "POINTS") {
      const size_t count = in_.count("a number of points");
      const auto coordinates = read_numbers<double>(3 * count, type());
      grid_.points =
          Eigen::Map<const Eigen::Matrix3Xd>(coordinates.data(), 3, static_cast<Eigen::Index>(count));
    } else if (keyword == "CELLS") {
      read_cells();
    } else if (keyword == "CELL_TYPES") {
      grid_.types = read_numbers<std::int64_t>(in_.count("a number of cells"), kInt);
    } else if (keyword == "CELL_DATA" || keyword == "POINT_DATA") {
      of_cells_ = keyword == "CELL_DATA";
      tuples_ = in_.count("a number of values");
      if (of_cells_ && tuples_ != grid_.types.size()) in_.fail(fmt::format("{} cells", grid_.types.size()));
    } else if (is_metadata(keyword)) {
      for (in_.line(); !in_.line().empty();) continue;
    } else {
      read_attribute(keyword);
    }
  }

  /// Parts that describe the array before them and end with an empty line.
  static bool is_metadata(std::string_view word) { return word == "METADATA" || word == "INFORMATION"; }

  void read_cells() {
    const size_t count = in_.count("a number of cells"), size = in_.count("a number of integers");
    if (has_offsets_) {
      grid_.offsets = read_named("OFFSETS", count);
      if (!grid_.offsets.empty()) grid_.offsets.erase(grid_.offsets.begin());
      grid_.connectivity = read_named("CONNECTIVITY", size);
      return;
    }
    const auto all = read_numbers<std::int64_t>(size, kInt);  // of each cell: its number of nodes, its nodes
    size_t next = 0;
    for (size_t cell = 0; cell < count; ++cell) {
      if (next == size || static_cast<size_t>(all[next]) > size - next - 1)
        in_.fail_with(fmt::format("cell {} goes beyond the {} integers announced", cell, size));
      const std::int64_t nodes = all[next++];
      const auto first = all.begin() + static_cast<std::ptrdiff_t>(next);
      grid_.connectivity.insert(grid_.connectivity.end(), first, first + nodes);
      grid_.offsets.push_back(std::ssize(grid_.connectivity));
      next += nodes;
    }
  }

  std::vector<std::int64_t> read_named(const char* keyword, size_t count) {
    if (in_.word() != keyword) in_.fail(keyword);
    const NumberType stored = type();
    if (!stored.whole())
      in_.fail_with(fmt::format("{} has numbers of floating point, expected whole ones", keyword));
    return read_numbers<std::int64_t>(count, stored);
  }

  /// One array of CELL_DATA or POINT_DATA, or a FIELD of several.
  void read_attribute(std::string_view keyword) {
    if (keyword == "LOOKUP_TABLE") {
      in_.word();
      const size_t colours = in_.count("a number of colours");
      read_numbers<double>(4 * colours, binary_ ? NumberType{kUnsigned, 1} : NumberType{kFloat, 4});
    } else if (keyword == "FIELD") {
      in_.word();
      const size_t arrays = in_.count("a number of arrays");
      for (size_t k = 0; k < arrays; ++k) read_field_array();
    } else if (keyword == "SCALARS") {
      read_scalars();
    } else if (keyword == "VECTORS" || keyword == "NORMALS" || keyword == "TENSORS") {
      in_.word();
      read_numbers<double>((keyword == "TENSORS" ? 9 : 3) * tuples_, type());
    } else {
      in_.fail(
          "POINTS, CELLS, CELL_TYPES, CELL_DATA, POINT_DATA, FIELD, SCALARS, VECTORS, NORMALS or TENSORS");
    }
  }

  void read_field_array() {
    std::string_view name = in_.word();
    while (is_metadata(name)) {  // of the array before
      read_section(name);
      name = in_.word();
    }
    const size_t components = in_.count("a number of components");
    const size_t tuples = in_.count("a number of values");
    read_data(std::string(name), components, tuples, type());
  }

  void read_scalars() {
    const std::string name(in_.word());
    const NumberType stored = type();
    size_t components = 1;
    std::string_view next = in_.word();
    if (next != "LOOKUP_TABLE") {
      components = next.size() == 1 && next >= "1" && next <= "4" ? next[0] - '0' : 0;
      if (components == 0) in_.fail("a number of components from 1 to 4, or LOOKUP_TABLE");
      next = in_.word();
    }
    if (next != "LOOKUP_TABLE") in_.fail("LOOKUP_TABLE");
    in_.word();
    read_data(name, components, tuples_, stored);
  }

  /// Reads an array to its end; keeps it where it says what the cells are.
  void read_data(const std::string& name, size_t components, size_t tuples, NumberType stored) {
    if (components > 0 && tuples > in_.text().size() / components) in_.fail("an array that is in the file");
    if (of_cells_ && stored.whole() && components == 1 && tuples == grid_.types.size())
      grid_.labels[name] = read_numbers<std::int64_t>(tuples, stored);
    else
      read_numbers<double>(components * tuples, stored);
  }

  NumberType type() {
    static const std::map<std::string_view, NumberType> kTypes = {{"char", {kSigned, 1}},
                                                                  {"unsigned_char", {kUnsigned, 1}},
                                                                  {"short", {kSigned, 2}},
                                                                  {"unsigned_short", {kUnsigned, 2}},
                                                                  {"int", kInt},
                                                                  {"unsigned_int", {kUnsigned, 4}},
                                                                  {"long", {kSigned, 8}},
                                                                  {"unsigned_long", {kUnsigned, 8}},
                                                                  {"float", {kFloat, 4}},
                                                                  {"double", {kFloat, 8}},
                                                                  {"vtkIdType", kInt},
                                                                  {"vtktypeint64", {kSigned, 8}},
                                                                  {"vtktypeuint64", {kUnsigned, 8}}};
    const auto found = kTypes.find(in_.word());
    if (found == kTypes.end()) in_.fail("a type of numbers: int, float, double or the like");
    return found->second;
  }

  /// Numbers as words, or as bytes that begin on the next line.
  template <typename T>
  std::vector<T> read_numbers(size_t count, NumberType stored) {
    if (binary_) {
      in_.line();
      return numbers<T>(in_.bytes(count * stored.bytes, "numbers"), stored, true);
    }
    std::vector<T> result;
    for (size_t k = 0; k < count; ++k) result.push_back(in_.number<T>("a number"));
    return result;
  }

  TextCursor in_;
  VtkGrid grid_;
  bool has_offsets_ = false, binary_ = false, of_cells_ = false;
  size_t tuples_ = 0;
};

}  // namespace

Mesh read_vtk_legacy(const std::string& text, const std::string& file) {
  return to_mesh(LegacyReader(text, file).read(), file);
}

}  // namespace tendril::fem
