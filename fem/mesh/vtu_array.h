// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "fem/mesh/vtk_grid.h"

namespace tendril::fem {

/// What all arrays of a .vtu file share.
struct VtuFile {
  const std::string& text;  ///< the whole file
  const std::string& name;  ///< for errors
  bool big_endian = false;
  bool zlib = false;          ///< blocks are packed with zlib
  size_t header_bytes = 4;    ///< of each number in the header before an array's bytes
  size_t appended = 0;        ///< where the appended data begin in text; 0 where there are none
  bool appended_raw = false;  ///< as bytes, not in base64
  /// How many numbers may still be read: packed, a small file could ask for absurd memory.
  size_t numbers_left = 0;
};

/// The numbers of a DataArray, in whichever of the formats it has them [VTK file formats, "XML file
/// formats"].
/// @param file   its numbers_left go down
/// @param count  how many numbers there must be
/// @throws MeshError
template <typename T>
std::vector<T> read_array(VtuFile& file, const pugi::xml_node& array, size_t count);

/// Whether the array holds whole numbers, one a cell.
bool is_label(const pugi::xml_node& array);

}  // namespace tendril::fem
