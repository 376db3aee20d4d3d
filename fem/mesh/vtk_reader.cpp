// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <map>

#include "fem/mesh/mesh_formats.h"
#include "fem/mesh/text_cursor.h"
#include "fem/mesh/vtk_grid.h"
#include "fem/mesh/vtk_words.h"

// The format: "VTK file formats", section "Simple legacy formats", and for version 5.1 what VTK 9 writes:
// cells as an array of offsets and one of connectivity. Binary numbers are big-endian.

namespace tendril::fem {
namespace {

using enum NumberType::Kind;

class LegacyReader {
 public:
  LegacyReader(const std::string& text, const std::string& file) : in_(text, file) {}

  VtkGrid read() {
    read_header();
    while (!in_.at_end()) read_section(in_capitals(in_.word()));
    if (grid_.types.size() != grid_.offsets.size())
      in_.fail_with(fmt::format("found {} cells and {} cell types, expected as many of each",
                                grid_.offsets.size(), grid_.types.size()));
    return std::move(grid_);
  }

 private:
  void read_header() {
    constexpr std::string_view kMagic = "# VTK DATAFILE VERSION ";
    const std::string first = in_capitals(in_.line());
    if (!first.starts_with(kMagic)) in_.fail("'# vtk DataFile Version'");
    size_t version = 0;
    if (!parse_number(first.substr(kMagic.size(), first.find('.') - kMagic.size()), version))
      in_.fail("'# vtk DataFile Version' and a version");
    has_offsets_ = version >= 5;
    in_.line();  // the title
    const std::string encoding = in_capitals(in_.word());
    if (encoding != "ASCII" && encoding != "BINARY") in_.fail("ASCII or BINARY");
    binary_ = encoding == "BINARY";
    for (const char* expected : {"DATASET", "UNSTRUCTURED_GRID"})
      if (in_capitals(in_.word()) != expected) in_.fail(expected);
    if (binary_) in_.count_bytes();
  }

  void read_section(const std::string& keyword) {
    if (keyword == "POINTS") {
      const size_t count = in_.count("a number of points");
      const auto coordinates = read_numbers<double>(3 * count, number_type());
      grid_.points =
          Eigen::Map<const Eigen::Matrix3Xd>(coordinates.data(), 3, static_cast<Eigen::Index>(count));
    } else if (keyword == "CELLS") {
      read_cells();
    } else if (keyword == "CELL_TYPES") {
      grid_.types = read_numbers<int64_t>(in_.count("a number of cells"), kVtkInt);
    } else if (keyword == "CELL_DATA" || keyword == "POINT_DATA") {
      of_cells_ = keyword == "CELL_DATA";
      tuples_ = in_.count("a number of values");
      if (of_cells_ && tuples_ != grid_.types.size()) in_.fail(fmt::format("{} cells", grid_.types.size()));
    } else if (is_metadata(keyword)) {
      skip_metadata();
    } else {
      read_attribute(keyword);
    }
  }

  /// Parts that describe the array before them and end with an empty line.
  static bool is_metadata(std::string_view word) { return word == "METADATA" || word == "INFORMATION"; }

  void skip_metadata() {
    in_.line();
    std::string_view line = in_.line();
    if (line.starts_with("COMPONENT_NAMES")) {  // a line each, empty where a component has no name
      line = in_.line();
      for (size_t k = 0; k < components_ && !line.starts_with("INFORMATION") && !in_.at_text_end(); ++k)
        line = in_.line();
    }
    while (!line.empty()) line = in_.line();
  }

  void read_cells() {
    const size_t count = in_.count("a number of cells"), size = in_.count("a number of integers");
    grid_.offsets.clear(), grid_.connectivity.clear();
    if (has_offsets_) {
      grid_.offsets = read_named("OFFSETS", count);
      if (!grid_.offsets.empty()) grid_.offsets.erase(grid_.offsets.begin());
      grid_.connectivity = read_named("CONNECTIVITY", size);
      return;
    }
    const auto all = read_numbers<int64_t>(size, kVtkInt);  // of each cell: its number of nodes, its nodes
    size_t next = 0;
    for (size_t cell = 0; cell < count; ++cell) {
      if (next == size || static_cast<size_t>(all[next]) > size - next - 1)
        in_.fail_with(fmt::format("cell {} goes beyond the {} integers announced", cell, size));
      const int64_t nodes = all[next++];
      const auto first = all.begin() + static_cast<std::ptrdiff_t>(next);
      grid_.connectivity.insert(grid_.connectivity.end(), first, first + nodes);
      grid_.offsets.push_back(std::ssize(grid_.connectivity));
      next += nodes;
    }
  }

  std::vector<int64_t> read_named(const char* keyword, size_t count) {
    if (in_capitals(in_.word()) != keyword) in_.fail(keyword);
    const NumberType stored = number_type();
    if (!stored.whole())
      in_.fail_with(fmt::format("{} has numbers of floating point, expected whole ones", keyword));
    return read_numbers<int64_t>(count, stored);
  }

  /// One array of CELL_DATA or POINT_DATA, or a FIELD of several.
  void read_attribute(const std::string& keyword) {
    // Arrays that say nothing of the mesh, and how many components each has.
    static const std::map<std::string, size_t> kSkipped = {
        {"VECTORS", 3},    {"NORMALS", 3},      {"TENSORS", 9},   {"TENSORS6", 6},
        {"GLOBAL_IDS", 1}, {"PEDIGREE_IDS", 1}, {"EDGE_FLAGS", 1}};
    if (const auto skipped = kSkipped.find(keyword); skipped != kSkipped.end()) {
      in_.word();
      skip_array(skipped->second, tuples_, storage());
    } else if (keyword == "TEXTURE_COORDINATES") {
      in_.word();
      const size_t dimensions = in_.count("a number of dimensions");
      skip_array(dimensions, tuples_, storage());
    } else if (keyword == "LOOKUP_TABLE") {
      in_.word();
      skip_array(4, in_.count("a number of colours"), {.number = {kUnsigned, 1}});
    } else if (keyword == "FIELD") {
      in_.word();
      const size_t arrays = in_.count("a number of arrays");
      for (size_t k = 0; k < arrays; ++k) read_field_array();
    } else if (keyword == "SCALARS") {
      read_scalars();
    } else if (keyword == "COLOR_SCALARS") {
      read_color_scalars();
    } else {
      in_.fail(
          "POINTS, CELLS, CELL_TYPES, CELL_DATA, POINT_DATA, FIELD, SCALARS or another attribute of VTK");
    }
  }

  void read_field_array() {
    std::string_view name = in_.word();
    while (is_metadata(name)) {  // of the array before
      skip_metadata();
      name = in_.word();
    }
    if (name == "NULL_ARRAY") return;  // VTK's word for an array that it could not write
    const size_t components = in_.count("a number of components");
    const size_t tuples = in_.count("a number of values");
    read_data(decoded_name(name), components, tuples, storage());
  }

  void read_scalars() {
    const std::string name = decoded_name(in_.word());
    const VtkStorage stored = storage();
    size_t components = 1;
    std::string_view next = in_.word();
    if (in_capitals(next) != "LOOKUP_TABLE") {
      if (!parse_number(next, components) || components == 0)
        in_.fail("a number of components, or LOOKUP_TABLE");
      next = in_.word();
    }
    if (in_capitals(next) != "LOOKUP_TABLE") in_.fail("LOOKUP_TABLE");
    in_.word();
    read_data(name, components, tuples_, stored);
  }

  /// VTK writes an array of bytes so where it chose colours: as shares of 255, or as bytes.
  void read_color_scalars() {
    const std::string name = decoded_name(in_.word());
    const size_t components = in_.count("a number of components");
    const VtkStorage bytes{.number = {kUnsigned, 1}};
    if (components != 1 || binary_) return read_data(name, components, tuples_, bytes);
    std::vector<int64_t> values;
    for (size_t k = 0; k < tuples_; ++k) {
      const auto share = in_.number<double>("a colour from 0 to 1");
      if (!(share >= 0 && share <= 1)) in_.fail("a colour from 0 to 1");
      values.push_back(std::lround(255 * share));
    }
    if (of_cells_) grid_.labels[name] = std::move(values);
  }

  /// Reads an array to its end; keeps it where it says what the cells are.
  void read_data(const std::string& name, size_t components, size_t tuples, const VtkStorage& stored) {
    components_ = components;
    if (of_cells_ && stored.form == VtkStorage::Form::kNumbers && stored.number.whole() && components == 1 &&
        tuples == grid_.types.size())
      grid_.labels[name] = read_numbers<int64_t>(tuples, stored.number);
    else
      skip_array(components, tuples, stored);
  }

  void skip_array(size_t components, size_t tuples, const VtkStorage& stored) {
    components_ = components;
    // No value takes less than a bit. Compared by division: the product may be too large for its type.
    if (components > 0 && tuples > 8 * in_.text().size() / components)
      in_.fail("an array that is in the file");
    const size_t count = components * tuples;
    if (stored.form == VtkStorage::Form::kVariants ||
        (!binary_ && stored.form == VtkStorage::Form::kStrings)) {
      in_.line();
      for (size_t k = 0; k < count && !in_.at_text_end(); ++k) in_.line();
    } else if (!binary_) {
      in_.skip_words(count, "a number");
    } else if (stored.form == VtkStorage::Form::kStrings) {
      in_.line();
      for (size_t k = 0; k < count; ++k) skip_binary_string();
    } else {
      in_.line();
      in_.bytes(stored.form == VtkStorage::Form::kBits ? (count + 7) / 8 : count * stored.number.bytes,
                "numbers");
    }
  }

  /// A length, of which the first two bits say how many bytes it has, and as many characters.
  void skip_binary_string() {
    const std::string_view first = in_.bytes(1, "a string");
    const unsigned head = static_cast<unsigned char>(first[0]);
    size_t length = head & 0x3F;
    const size_t more = head >> 6 == 3 ? 0 : head >> 6 == 2 ? 1 : head >> 6 == 1 ? 3 : 7;
    for (const char c : in_.bytes(more, "a string")) length = length << 8 | static_cast<unsigned char>(c);
    in_.bytes(length, "a string");
  }

  VtkStorage storage() {
    const auto stored = vtk_storage(in_.word());
    if (!stored) in_.fail("a type of numbers: int, float, double or the like");
    return *stored;
  }

  NumberType number_type() {
    const VtkStorage stored = storage();
    if (stored.form != VtkStorage::Form::kNumbers)
      in_.fail("a type of numbers: int, float, double or the like");
    return stored.number;
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
  size_t components_ = 1;  // of the array read last
};

}  // namespace

Mesh read_vtk_legacy(const std::string& text, const std::string& file) {
  return to_mesh(LegacyReader(text, file).read(), file, text.size());
}

}  // namespace tendril::fem
