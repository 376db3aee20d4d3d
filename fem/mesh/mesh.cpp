// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/mesh.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <numeric>
#include <set>
#include <tuple>

#include "fem/mesh/format_point.h"

namespace tendril::fem {
namespace {

constexpr int kCulpritsNamed = 5;
// A tetrahedron is flat when its volume is below this share of the cube of its longest edge: an element of
// that shape cannot be integrated to useful accuracy in double precision.
constexpr double kFlat = 1e-9;
// Nodes nearer than this share of the body's diagonal are at one place: files round coordinates more
// coarsely.
constexpr double kCoincident = 1e-9;

/// Collects the first few of a kind of fault and counts the rest.
class Culprits {
 public:
  void add(const std::string& text) {
    if (count_++ < kCulpritsNamed) list_ += (list_.empty() ? "" : ", ") + text;
  }
  int count() const { return count_; }
  void refuse_if_any(const std::string& fault, const std::string& remedy) const {
    if (count_ == 0) return;
    const std::string more =
        count_ > kCulpritsNamed ? fmt::format(" and {} more", count_ - kCulpritsNamed) : "";
    throw MeshError(fmt::format("{} {}: {}{}; {}", count_, fault, list_, more, remedy));
  }

 private:
  int count_ = 0;
  std::string list_;
};

std::string tet_at(const Mesh& mesh, int tet) {
  return fmt::format("tetrahedron {} at {}", tet,
                     format_point_mm(mesh.nodes(Eigen::all, mesh.tets[tet]).rowwise().mean()));
}

/// Refuses coordinates that are not finite and node indices out of range.
void check_numbers(const Mesh& mesh) {
  Culprits not_finite, out_of_range;
  for (int i = 0; i < mesh.node_count(); ++i)
    if (!mesh.nodes.col(i).allFinite()) not_finite.add(fmt::format("node {}", i));
  not_finite.refuse_if_any("nodes have coordinates that are not finite", "repair the mesh file");
  for (int t = 0; t < mesh.tet_count(); ++t)
    for (int node : mesh.tets[t])
      if (node < 0 || node >= mesh.node_count())
        out_of_range.add(fmt::format("tetrahedron {} names node {}", t, node));
  for (const auto& [name, nodes] : mesh.regions)
    for (int node : nodes)
      if (node < 0 || node >= mesh.node_count())
        out_of_range.add(fmt::format("region {} names node {}", name, node));
  out_of_range.refuse_if_any(fmt::format("node indices are outside 0..{}", mesh.node_count() - 1),
                             "repair the mesh file");
}

/// Refuses tetrahedra that are inverted or flat.
void check_shapes(const Mesh& mesh) {
  Culprits inverted, flat;
  for (int t = 0; t < mesh.tet_count(); ++t) {
    const Eigen::Matrix<double, 3, 4> p = mesh.nodes(Eigen::all, mesh.tets[t]);
    const double volume = signed_volume(p.col(0), p.col(1), p.col(2), p.col(3));
    double longest = 0;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < i; ++j) longest = std::max(longest, (p.col(i) - p.col(j)).norm());
    if (std::abs(volume) <= kFlat * longest * longest * longest)
      flat.add(tet_at(mesh, t));
    else if (volume < 0)
      inverted.add(tet_at(mesh, t));
  }
  // Of a single tetrahedron there is no telling a habit from a mistake.
  if (mesh.tet_count() > 1 && inverted.count() == mesh.tet_count())
    throw MeshError(
        fmt::format("all {} tetrahedra are inverted: the file numbers their corners the other way round, "
                    "expected the fourth on the side from which the first three turn counter-clockwise; swap "
                    "two corners of each where the file is written",
                    mesh.tet_count()));
  inverted.refuse_if_any("tetrahedra are inverted", "swap two of their corners or mesh the body again");
  flat.refuse_if_any("tetrahedra are flat", "mesh the body again with a quality bound");
}

/// A face of a tetrahedron: its nodes in ascending order, whether these turn counter-clockwise as seen from
/// outside the tetrahedron, and which tetrahedron that is.
struct SortedFace {
  std::array<int, 3> nodes;
  bool counter_clockwise;
  int tet;
};

std::vector<SortedFace> sorted_faces(const Mesh& mesh) {
  constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};  // seen from outside
  std::vector<SortedFace> faces;
  for (int t = 0; t < mesh.tet_count(); ++t)
    for (const auto& corners : kFaces) {
      SortedFace face{
          {mesh.tets[t][corners[0]], mesh.tets[t][corners[1]], mesh.tets[t][corners[2]]}, true, t};
      for (const auto& [i, j] : {std::pair(0, 1), std::pair(1, 2), std::pair(0, 1)})
        if (face.nodes[i] > face.nodes[j]) {
          std::swap(face.nodes[i], face.nodes[j]);
          face.counter_clockwise = !face.counter_clockwise;
        }
      faces.push_back(face);
    }
  std::sort(faces.begin(), faces.end(), [](const SortedFace& a, const SortedFace& b) {
    return std::tie(a.nodes, a.tet) < std::tie(b.nodes, b.tet);
  });
  return faces;
}

/// Refuses tetrahedra that do not fill space side by side: a face parts two of them at most, one on each
/// side.
void check_neighbours(const Mesh& mesh) {
  Culprits twice, crowded, overlapping;
  std::set<std::array<int, 4>> known;
  for (int t = 0; t < mesh.tet_count(); ++t) {
    auto corners = mesh.tets[t];
    std::sort(corners.begin(), corners.end());
    if (!known.insert(corners).second) twice.add(tet_at(mesh, t));
  }
  twice.refuse_if_any("tetrahedra are in the mesh twice", "remove the second ones from the mesh file");

  const std::vector<SortedFace> faces = sorted_faces(mesh);
  for (size_t first = 0, end = 0; first < faces.size(); first = end) {
    while (end < faces.size() && faces[end].nodes == faces[first].nodes) ++end;
    const auto& nodes = faces[first].nodes;
    if (end - first > 2)
      crowded.add(fmt::format("the one of nodes {}, {}, {} at {}", nodes[0], nodes[1], nodes[2],
                              format_point_mm(mesh.nodes(Eigen::all, nodes).rowwise().mean())));
    else if (end - first == 2 && faces[first].counter_clockwise == faces[first + 1].counter_clockwise)
      overlapping.add(fmt::format("{} and {}", faces[first].tet, tet_at(mesh, faces[first + 1].tet)));
  }
  crowded.refuse_if_any("faces belong to more than two tetrahedra", "mesh the body again as one volume");
  overlapping.refuse_if_any("pairs of tetrahedra lie on the same side of their common face",
                            "mesh the body again as one volume");
}

/// Refuses nodes at one place: what is on either side of them looks joined and would fall apart.
void check_apart(const Mesh& mesh) {
  const Eigen::Vector3d size = mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff();
  const double least = kCoincident * size.norm();
  // Along a direction askew to all grids few nodes share a place, so that only neighbours need comparing.
  const Eigen::VectorXd along = mesh.nodes.transpose() * Eigen::Vector3d(0.7347, 0.5618, 0.3804);
  std::vector<int> order(mesh.node_count());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](int i, int j) { return std::tie(along[i], i) < std::tie(along[j], j); });
  Culprits pairs;
  for (size_t k = 0; k < order.size(); ++k)
    for (size_t l = k + 1; l < order.size() && along[order[l]] - along[order[k]] <= least; ++l)
      if ((mesh.nodes.col(order[l]) - mesh.nodes.col(order[k])).norm() <= least) {
        const auto [i, j] = std::minmax(order[k], order[l]);
        pairs.add(fmt::format("{} and {} at {}", i, j, format_point_mm(mesh.nodes.col(i))));
      }
  pairs.refuse_if_any("pairs of nodes coincide", "merge them (in Gmsh: Coherence Mesh)");
}

std::vector<char> used_nodes(const Mesh& mesh) {
  std::vector<char> used(mesh.node_count(), 0);
  for (const auto& tet : mesh.tets)
    for (int node : tet) used[node] = 1;
  return used;
}

bool contains(const Space& space, const Eigen::Vector3d& p) {
  if (const auto* box = std::get_if<Box>(&space))
    return (p.array() >= box->lower.array()).all() && (p.array() <= box->upper.array()).all();
  const auto& [centre, radius] = std::get<Sphere>(space);
  return (p - centre).norm() <= radius;
}

}  // namespace

double signed_volume(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                     const Eigen::Vector3d& d) {
  return (b - a).cross(c - a).dot(d - a) / 6.0;
}

void check(const Mesh& mesh) {
  if (mesh.tets.empty())
    throw MeshError("the mesh has no tetrahedra; export the volume mesh, not the surface");
  check_numbers(mesh);
  check_shapes(mesh);
  check_neighbours(mesh);
  Culprits unreferenced;
  const std::vector<char> used = used_nodes(mesh);
  for (int i = 0; i < mesh.node_count(); ++i)
    if (!used[i]) unreferenced.add(fmt::format("node {} at {}", i, format_point_mm(mesh.nodes.col(i))));
  unreferenced.refuse_if_any("nodes belong to no tetrahedron", "remove them from the mesh file");
  check_apart(mesh);
}

std::vector<int> nodes_in(const Mesh& mesh, const Space& space) {
  std::vector<int> inside;
  for (int i = 0; i < mesh.node_count(); ++i)
    if (contains(space, mesh.nodes.col(i))) inside.push_back(i);
  return inside;
}

std::vector<int> tets_in(const Mesh& mesh, const Space& space) {
  std::vector<int> inside;
  for (int t = 0; t < mesh.tet_count(); ++t)
    if (contains(space, mesh.nodes(Eigen::all, mesh.tets[t]).rowwise().mean())) inside.push_back(t);
  return inside;
}

}  // namespace tendril::fem
