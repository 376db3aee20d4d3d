// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/hinges.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "fem/mesh/connected_parts.h"
#include "fem/mesh/format_point.h"

namespace tendril::fem {
namespace {

constexpr std::size_t kMostText = 300;  // characters, after which no further place is named

/// For each tetrahedron a number of its part; tetrahedra with a common face are in one part.
std::vector<int> parts_by_faces(const Mesh& mesh) {
  std::vector<std::pair<std::array<int, 3>, int>> faces;
  for (int t = 0; t < mesh.tet_count(); ++t) {
    auto tet = mesh.tets[t];
    std::sort(tet.begin(), tet.end());
    for (const auto& [a, b, c] : {std::array{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}})
      faces.push_back({{tet[a], tet[b], tet[c]}, t});
  }
  std::sort(faces.begin(), faces.end());
  std::vector<std::array<int, 2>> neighbours;
  for (size_t k = 1; k < faces.size(); ++k)
    if (faces[k].first == faces[k - 1].first) neighbours.push_back({faces[k - 1].second, faces[k].second});
  return connected_parts(mesh.tet_count(), neighbours);
}

/// Whether points do not lie on one line.
bool span_a_plane(const Mesh& mesh, const std::vector<int>& nodes) {
  if (nodes.size() < 3) return false;
  const Eigen::Matrix3Xd points = mesh.nodes(Eigen::all, nodes);
  const Eigen::Matrix3Xd spread = points.colwise() - points.rowwise().mean();
  const Eigen::Vector3d sizes =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread * spread.transpose()).eigenvalues();  // ascending
  return sizes[1] > 1e-12 * sizes[2];
}

/// The parts of a body, of which those that hold each other become one. The ground, to which the fixed nodes
/// belong, is one of them.
class Parts {
 public:
  Parts(const Mesh& mesh, std::span<const int> fixed) : mesh_(mesh), parts_of_node_(mesh.node_count()) {
    const std::vector<int> part_of_tet = parts_by_faces(mesh);
    holder_.resize(mesh.tet_count() + 1);
    std::iota(holder_.begin(), holder_.end(), 0);
    for (int t = 0; t < mesh.tet_count(); ++t)
      for (int node : mesh.tets[t]) parts_of_node_[node].insert(part_of_tet[t]);
    for (int node : fixed) parts_of_node_[node].insert(ground());
  }

  /// The nodes that pairs of parts have in common, after all that hold each other became one. Of a pair, the
  /// first is not the ground; parts are named by one of their tetrahedra.
  std::map<std::pair<int, int>, std::vector<int>> hinges() {
    for (;;) {
      std::map<std::pair<int, int>, std::vector<int>> common;
      for (int node = 0; node < mesh_.node_count(); ++node) {
        if (parts_of_node_[node].size() < 2) continue;
        std::set<int> holders;
        for (int part : parts_of_node_[node]) holders.insert(holder(part));
        for (auto i = holders.begin(); i != holders.end(); ++i)
          for (auto j = std::next(i); j != holders.end(); ++j) common[{*i, *j}].push_back(node);
      }
      bool joined = false;
      for (const auto& [pair, nodes] : common)
        if (span_a_plane(mesh_, nodes)) {
          const auto [one, other] = std::minmax({holder(pair.first), holder(pair.second)});
          holder_[one] = other;  // the ground, whose number is the largest, stays
          joined = true;
        }
      if (!joined) return common;
    }
  }

 private:
  int ground() const { return mesh_.tet_count(); }
  int holder(int part) {
    while (holder_[part] != part) part = holder_[part] = holder_[holder_[part]];
    return part;
  }

  const Mesh& mesh_;
  std::vector<std::set<int>> parts_of_node_;
  std::vector<int> holder_;  // the part that a part became one with
};

/// The node, or the ends of the edge, at which nodes on one line lie.
std::string hinge_at(const Mesh& mesh, const std::vector<int>& nodes) {
  const Eigen::Vector3d first = mesh.nodes.col(nodes[0]);
  if (nodes.size() == 1) return fmt::format("the node at {}", format_point_mm(first));
  const auto farthest = [&](const Eigen::Vector3d& from) -> Eigen::Vector3d {
    return mesh.nodes.col(*std::max_element(nodes.begin(), nodes.end(), [&](int i, int j) {
      return (mesh.nodes.col(i) - from).norm() < (mesh.nodes.col(j) - from).norm();
    }));
  };
  const Eigen::Vector3d end = farthest(first);
  return fmt::format("the edge from {} to {}", format_point_mm(farthest(end)), format_point_mm(end));
}

}  // namespace

void check_hinges(const Mesh& mesh, std::span<const int> fixed) {
  const auto hinges = Parts(mesh, fixed).hinges();
  if (hinges.empty()) return;
  const int part = hinges.begin()->first.first;
  // A part of a ring hangs on both of its neighbours.
  std::string places;
  int more = 0;
  for (const auto& [pair, nodes] : hinges)
    if (pair.first == part || pair.second == part) {
      if (places.size() < kMostText)
        places += (places.empty() ? "" : " and ") + hinge_at(mesh, nodes);
      else
        ++more;
    }
  if (more > 0) places += fmt::format(" and {} more", more);
  throw MeshError(
      fmt::format("the part of the body with tetrahedron {} at {} hangs on the rest by {} only, and can turn "
                  "there{}; let "
                  "the parts share faces, or fix nodes of each",
                  part, format_point_mm(mesh.nodes(Eigen::all, mesh.tets[part]).rowwise().mean()), places,
                  hinges.size() == 1 ? "" : fmt::format(" (the body has {} such places)", hinges.size())));
}

}  // namespace tendril::fem
