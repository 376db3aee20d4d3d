// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <catch2/catch.hpp>
#include <functional>
#include <string>

#include "fem/mesh/mesh.h"

namespace tendril::fem::testing {

/// Two tetrahedra on either side of the triangle of their base, as Gmsh writes them.
inline constexpr const char* kMsh = R"($MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
2 1 "base"
3 2 "soft body"
$EndPhysicalNames
$Entities
0 0 1 1
7 0 0 0 1 1 0 1 1 0
9 0 0 0 1 1 1 1 2 1 7
$EndEntities
$Nodes
2 5 10 14
2 7 0 3
10
11
12
0 0 0
1000 0 0
0 1000 0
3 9 0 2
13
14
0 0 1000
0 0 -1e3
$EndNodes
$Elements
2 3 1 3
2 7 2 1
1 10 11 12
3 9 4 2
2 10 11 12 13
3 10 12 11 14
$EndElements
)";

/// What a MeshError says, or that there is none.
inline std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const MeshError& error) {
    return error.what();
  }
  return "no error";
}

/// The text with the first `from` in it replaced.
inline std::string edited(const std::string& text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  std::string result(text, 0, at);
  result += to;
  return result.append(text, at + from.size());
}

}  // namespace tendril::fem::testing
