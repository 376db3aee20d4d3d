// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/joined_grid.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <map>

namespace tendril::fem {
namespace {

using Position = std::array<uint64_t, 3>;  // the bits, which have an order even where they are no number

/// The points of all pieces, those at one position once.
class Points {
 public:
  /// @return  the number that each point of a piece gets
  std::vector<int64_t> add(const Eigen::Matrix3Xd& points) {
    std::vector<int64_t> numbers;
    std::vector<Position> positions;
    for (Eigen::Index k = 0; k < points.cols(); ++k) {
      const Eigen::Vector3d p = points.col(k).array() + 0.0;  // -0 becomes 0
      positions.push_back(
          {std::bit_cast<uint64_t>(p.x()), std::bit_cast<uint64_t>(p.y()), std::bit_cast<uint64_t>(p.z())});
      const auto known = number_at_.find(positions.back());
      numbers.push_back(known != number_at_.end() ? known->second : std::ssize(coordinates_) / 3);
      if (known == number_at_.end()) coordinates_.insert(coordinates_.end(), p.begin(), p.end());
    }
    for (size_t k = 0; k < numbers.size(); ++k) number_at_.emplace(positions[k], numbers[k]);
    return numbers;
  }

  Eigen::Matrix3Xd all() const {
    return Eigen::Map<const Eigen::Matrix3Xd>(coordinates_.data(), 3, std::ssize(coordinates_) / 3);
  }

 private:
  std::vector<double> coordinates_;
  std::map<Position, int64_t> number_at_;  // of the points of the pieces before
};

void append_labels(VtkGrid& whole, const VtkGrid& piece, const std::string& file) {
  if (whole.types.empty()) {
    whole.labels = piece.labels;
    return;
  }
  for (const auto& [name, values] : piece.labels)
    if (!whole.labels.contains(name))
      throw MeshError(
          fmt::format("{}: cell array '{}' is in some pieces only, expected it in all", file, name));
  for (auto& [name, values] : whole.labels) {
    const auto more = piece.labels.find(name);
    if (more == piece.labels.end())
      throw MeshError(
          fmt::format("{}: cell array '{}' is in some pieces only, expected it in all", file, name));
    values.insert(values.end(), more->second.begin(), more->second.end());
  }
}

}  // namespace

VtkGrid joined(std::vector<VtkGrid> pieces, const std::string& file) {
  if (pieces.size() == 1) return std::move(pieces.front());
  VtkGrid whole;
  Points points;
  for (const VtkGrid& piece : pieces) {
    const std::vector<int64_t> numbers = points.add(piece.points);
    const int64_t before = std::ssize(whole.connectivity);
    for (const int64_t end : piece.offsets) whole.offsets.push_back(before + end);
    for (const int64_t node : piece.connectivity) {
      if (node < 0 || node >= std::ssize(numbers))
        throw MeshError(
            fmt::format("{}: a piece names point {}, expected 0 to {}", file, node, std::ssize(numbers) - 1));
      whole.connectivity.push_back(numbers[node]);
    }
    if (!piece.types.empty()) append_labels(whole, piece, file);
    whole.types.insert(whole.types.end(), piece.types.begin(), piece.types.end());
  }
  whole.points = points.all();
  return whole;
}

}  // namespace tendril::fem
