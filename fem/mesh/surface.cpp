// SPDX-License-Identifier: Apache-2.0
#include "fem/mesh/surface.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <map>
#include <utility>

#include "fem/mesh/connected_parts.h"
#include "fem/mesh/format_point.h"

namespace tendril::fem {
namespace {

/// Volume under each connected piece of a surface, by a node of the piece; negative for a cavity of the body.
std::map<int, double> volumes_under_pieces(const Mesh& mesh, const std::vector<Face>& surface) {
  const std::vector<int> piece = connected_parts(mesh.node_count(), surface);
  std::map<int, double> volumes;
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  for (const auto& [a, b, c] : surface)
    volumes[piece[a]] += signed_volume(mesh.nodes.col(a), mesh.nodes.col(c), mesh.nodes.col(b), origin);
  return volumes;
}

}  // namespace

std::vector<Face> boundary(const Mesh& mesh) {
  constexpr std::array<Face, 4> kOutward{{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
  std::map<Face, std::pair<Face, int>>
      faces;  // by ascending nodes: the face, and how many tetrahedra have it
  for (const auto& tet : mesh.tets)
    for (const auto& [a, b, c] : kOutward) {
      const Face face{tet[a], tet[b], tet[c]};
      Face key = face;
      std::sort(key.begin(), key.end());
      ++faces.try_emplace(key, face, 0).first->second.second;
    }
  std::vector<Face> result;
  for (const auto& [key, face] : faces)
    if (face.second == 1) result.push_back(face.first);
  return result;
}

double enclosed_volume(const Mesh& mesh, const std::vector<Face>& wall) {
  double volume = 0;
  for (const auto& [node, under] : volumes_under_pieces(mesh, wall)) volume -= under;
  return volume;
}

void check_closed(const Mesh& mesh, const std::vector<Face>& surface) {
  if (surface.empty()) throw MeshError("the surface has no faces");
  std::map<std::pair<int, int>, int> passes;  // of an edge, upward less downward
  for (const Face& face : surface)
    for (int k = 0; k < 3; ++k) {
      const int i = face[k], j = face[(k + 1) % 3];
      passes[std::minmax(i, j)] += i < j ? 1 : -1;
    }
  const auto is_open = [](const auto& edge) { return edge.second != 0; };
  const auto open = std::find_if(passes.begin(), passes.end(), is_open);
  if (open == passes.end()) return;
  const auto [i, j] = open->first;
  throw MeshError(fmt::format(
      "the surface is open at {} of its edges, one of them near {}; a cavity has no opening: close its "
      "air inlet in the drawing, or let the nodes of all its walls be in the region",
      std::count_if(passes.begin(), passes.end(), is_open),
      format_point_mm(0.5 * (mesh.nodes.col(i) + mesh.nodes.col(j)))));
}

std::vector<int> nodes_of(const std::vector<Face>& faces) {
  int last = -1;
  for (const Face& face : faces) last = std::max(last, *std::ranges::max_element(face));
  std::vector<bool> seen(static_cast<std::size_t>(last + 1), false);
  std::vector<int> nodes;
  for (const Face& face : faces)
    for (const int node : face) {
      if (seen[static_cast<std::size_t>(node)]) continue;
      seen[static_cast<std::size_t>(node)] = true;
      nodes.push_back(node);
    }
  return nodes;
}

std::vector<Face> closed_surface(const Mesh& mesh, const std::vector<int>& nodes) {
  std::vector<char> named(mesh.node_count(), 0);
  for (int node : nodes) named.at(node) = 1;
  std::vector<Face> surface = boundary(mesh);
  std::erase_if(surface, [&](const Face& f) { return !named[f[0]] || !named[f[1]] || !named[f[2]]; });
  if (surface.empty())
    throw MeshError(
        fmt::format("no face of the body's surface has all its corners among the {} nodes", nodes.size()));
  check_closed(mesh, surface);
  for (const auto& [node, volume] : volumes_under_pieces(mesh, surface))
    if (volume >= 0)
      throw MeshError(fmt::format("the surface through {} is the outside of the body, not a cavity's wall",
                                  format_point_mm(mesh.nodes.col(node))));
  return surface;
}

}  // namespace tendril::fem
