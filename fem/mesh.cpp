#include "fem/mesh.h"

#include <fmt/format.h>

#include <Eigen/Dense>

namespace tendril::fem {
namespace {

constexpr int kCulpritsNamed = 5;
// A tetrahedron is flat when its volume is below this share of the cube of its longest edge: an element of
// that shape cannot be integrated to useful accuracy in double precision.
constexpr double kFlat = 1e-9;

/// Collects the first few of a kind of fault and counts the rest.
class Culprits {
 public:
  void add(const std::string& text) {
    if (count_++ < kCulpritsNamed) list_ += (list_.empty() ? "" : ", ") + text;
  }
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

std::string place(const Eigen::Vector3d& p) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g}) mm", 1e3 * p.x(), 1e3 * p.y(), 1e3 * p.z());
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

  Culprits not_finite, out_of_range, inverted, flat, unreferenced;
  for (int i = 0; i < mesh.node_count(); ++i)
    if (!mesh.nodes.col(i).allFinite()) not_finite.add(fmt::format("node {}", i));
  not_finite.refuse_if_any("nodes have coordinates that are not finite", "repair the mesh file");

  std::vector<char> used(mesh.node_count(), 0);
  for (int t = 0; t < mesh.tet_count(); ++t)
    for (int node : mesh.tets[t]) {
      if (node < 0 || node >= mesh.node_count())
        out_of_range.add(fmt::format("tetrahedron {} names node {}", t, node));
      else
        used[node] = 1;
    }
  out_of_range.refuse_if_any(fmt::format("node indices are outside 0..{}", mesh.node_count() - 1),
                             "repair the mesh file");

  for (int t = 0; t < mesh.tet_count(); ++t) {
    const auto& [a, b, c, d] = mesh.tets[t];
    const Eigen::Matrix<double, 3, 4> p = mesh.nodes(Eigen::all, std::array{a, b, c, d});
    const double volume = signed_volume(p.col(0), p.col(1), p.col(2), p.col(3));
    double longest = 0;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < i; ++j) longest = std::max(longest, (p.col(i) - p.col(j)).norm());
    const Eigen::Vector3d centre = p.rowwise().mean();
    if (std::abs(volume) <= kFlat * longest * longest * longest)
      flat.add(fmt::format("tetrahedron {} at {}", t, place(centre)));
    else if (volume < 0)
      inverted.add(fmt::format("tetrahedron {} at {}", t, place(centre)));
  }
  inverted.refuse_if_any("tetrahedra are inverted", "swap two of their corners or mesh the body again");
  flat.refuse_if_any("tetrahedra are flat", "mesh the body again with a quality bound");

  for (int i = 0; i < mesh.node_count(); ++i)
    if (!used[i]) unreferenced.add(fmt::format("node {} at {}", i, place(mesh.nodes.col(i))));
  unreferenced.refuse_if_any("nodes belong to no tetrahedron", "remove them from the mesh file");
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
