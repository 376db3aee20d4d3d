// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "fem/mesh/mesh.h"

namespace tendril::fem {

/// An unstructured grid as both of VTK's file formats hold it.
struct VtkGrid {
  Eigen::Matrix3Xd points;                             ///< 3 × n
  std::vector<int64_t> types;                          ///< VTK's cell type of each cell
  std::vector<int64_t> offsets;                        ///< where each cell's nodes end in connectivity
  std::vector<int64_t> connectivity;                   ///< node indices, cell after cell
  std::map<std::string, std::vector<int64_t>> labels;  ///< cell arrays of whole numbers, by name
};

/// How many numbers a file of so many bytes can hold, packed or not, if they describe a mesh. It bounds the
/// memory that any file can ask for.
constexpr size_t most_numbers(size_t file_bytes) {
  constexpr size_t kPerByte = 8;            // of whole meshes with their labels, packed with zlib
  constexpr size_t kOfSmallOnes = 1 << 17;  // which may pack better by chance
  return std::max(kOfSmallOnes, kPerByte * file_bytes);
}

/// The mesh of the grid's tetrahedra, with a region and a volume for each value of each label.
/// @param file_bytes  size of the file: each label names all nodes of a cell, and those are counted
/// @throws MeshError naming the file and the cell
Mesh to_mesh(VtkGrid grid, const std::string& file, size_t file_bytes);

/// How a number is stored.
struct NumberType {
  enum class Kind { kSigned, kUnsigned, kFloat };
  Kind kind;
  size_t bytes;
  bool whole() const { return kind != Kind::kFloat; }
};

/// The numbers in `bytes`, whose length is a multiple of the type's.
template <typename T>
std::vector<T> numbers(std::string_view bytes, NumberType type, bool big_endian);

}  // namespace tendril::fem
