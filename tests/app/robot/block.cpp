// SPDX-License-Identifier: Apache-2.0
#include "tests/app/robot/block.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>

#include "app/config/load_config.h"

namespace tendril::app {
namespace {

constexpr int kAcross = 3, kHigh = 6, kCube_mm = 10;

bool hollow(int i, int j, int k) { return i == 1 && j == 1 && k >= 1 && k <= 4; }

int node(int i, int j, int k) { return 1 + i + (kAcross + 1) * (j + (kAcross + 1) * k); }

/// The six tetrahedra of a cube along its diagonal, one for each order in which the axes are gone along.
void write_cube(std::ostream& out, int i, int j, int k, int& tets) {
  for (std::array<int, 3> order = {0, 1, 2};;) {
    std::array<int, 3> at = {i, j, k};
    std::array<int, 4> corners = {node(i, j, k)};
    for (int c = 0; c < 3; ++c) {
      ++at[order[c]];
      corners[c + 1] = node(at[0], at[1], at[2]);
    }
    const bool even = (order[1] - order[0] + 3) % 3 == 1;
    if (!even) std::swap(corners[2], corners[3]);
    out << ++tets;
    for (const int corner : corners) out << ' ' << corner;
    out << '\n';
    if (!std::next_permutation(order.begin(), order.end())) break;
  }
}

std::string mesh() {
  std::ostringstream nodes, numbers, elements;
  int count = 0, tets = 0;
  for (int k = 0; k <= kHigh; ++k)
    for (int j = 0; j <= kAcross; ++j)
      for (int i = 0; i <= kAcross; ++i) {
        numbers << ++count << '\n';
        nodes << i * kCube_mm - 15 << ' ' << j * kCube_mm - 15 << ' ' << k * kCube_mm << '\n';
      }
  for (int k = 0; k < kHigh; ++k)
    for (int j = 0; j < kAcross; ++j)
      for (int i = 0; i < kAcross; ++i)
        if (!hollow(i, j, k)) write_cube(elements, i, j, k, tets);
  std::ostringstream file;
  file << "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
       << "$Entities\n0 0 0 1\n1 -15 -15 0 15 15 60 0 0\n$EndEntities\n"
       << "$Nodes\n1 " << count << " 1 " << count << "\n3 1 0 " << count << '\n'
       << numbers.str() << nodes.str() << "$EndNodes\n"
       << "$Elements\n1 " << tets << " 1 " << tets << "\n3 1 4 " << tets << '\n'
       << elements.str() << "$EndElements\n";
  return file.str();
}

const std::string kBlock = R"(robot: block
mesh: {file: block.msh}
material:
  young_modulus: 200 kPa
  poisson_ratio: 0.4
  mass: 60 g
  regions:
    - where: {box: [-15 -15 0 mm, 15 15 10 mm]}
      young_modulus: 1 MPa
      poisson_ratio: 0.4
      mass: 12 g
loads:
  - {at: 0 0 60 mm, force: 0 0 -0.1 N}
fixed: {box: [-15 -15 0 mm, 15 15 0 mm]}
effectors:
  - {name: top, points: [-5 -5 60 mm, 5 -5 60 mm, 5 5 60 mm, -5 5 60 mm]}
  - {name: volume, cavity: {box: [-5 -5 10 mm, 5 5 50 mm]}, weight: 100}
actuators:
  - name: air
    cavity: {box: [-5 -5 10 mm, 5 5 50 mm]}
    pressure: -20 60 kPa
    growth: -1 2 ml
    top_flow: 5 ml/s
    drive: {node: 1, counts_per_turn: 10000, volume_per_turn: 0.5 ml}
  - name: string
    cable: [body 15 0 60 mm, guide 60 0 60 mm]
    tension: 0 4 N
    stroke: -10 10 mm
    top_speed: 50 mm/s
    drive: {node: 2, counts_per_turn: 65536, pulley_radius: 10 mm}
  - name: strut
    rod: [guide 0 60 40 mm, body 0 15 40 mm]
    force: -4 4 N
    stroke: -5 5 mm
    top_speed: 20 mm/s
    drive: {node: 3, counts_per_turn: 4096, lead: 2 mm, reversed: true}
  - name: thumb
    push: -15 0 50 mm
    direction: 0 0 2
    force: -3 3 N
    stroke: -5 5 mm
    top_speed: 20 mm/s
    drive: {node: 4, counts_per_turn: 4096, lead: 5 mm}
control:
  workspace: [-10 -10 50 mm, 10 10 70 mm]
bus: {name: vcan0}
sensors:
  - name: camera
    id: 0x1F0
    rate: 100 Hz
    timeout: 100 ms
    signals:
      - {effector: top, coordinate: x, start: 0, length: 16, type: signed, scale: 0.01 mm}
      - {effector: top, coordinate: y, start: 16, length: 16, type: signed, scale: 0.01 mm}
      - {effector: top, coordinate: z, start: 32, length: 16, type: signed, scale: 0.01 mm}
    age: {start: 48, length: 16, scale: 0.01 ms}
motion:
  origin: 0 0 60 mm
  waypoints: [2 1 1 mm, 1 -1 0.5 mm]
  speed: 5 mm/s
plant:
  young_modulus: 220 kPa
  poisson_ratio: 0.4
  mass: 63 g
  damping_mass: 2 1/s
  damping_stiffness: 10 ms
  time_step: 5 ms
)";

std::string changed(const Changes& changes) {
  std::string text = kBlock;
  for (const auto& [from, to] : changes) text.replace(text.find(from), from.size(), to);
  return text;
}

}  // namespace

Block::Block(const Changes& changes) : file(changed(changes), "block.msh"), config(load_config(file.path())) {
  std::ofstream(config.mesh.file) << mesh();
}

Config block_at(double rate_hz) {
  Config config = Block().config;
  config.control.rate_hz = rate_hz;
  return config;
}

}  // namespace tendril::app
