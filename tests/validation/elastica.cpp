// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/validation/beam.h"
#include "tests/validation/cases.h"

// A slender cantilever that a dead load at its end bends far, against the elastica: the inextensible line
// whose moment is E I times its curvature. The linear tetrahedron is too stiff in bending, by an amount that
// goes as the square of the cell; the limit therefore holds for the value extrapolated from two meshes.

namespace tendril::validation {
namespace {

constexpr double kTableError = 1e-5;        // of the length: the elastica below against published values
constexpr double kExtrapolated = 0.5;       // % of the length
constexpr double kShortExtrapolated = 2.5;  // % of the length, from coarser meshes

constexpr double kElasticaLength = 0.2, kElasticaHeight = 0.01;  // m
constexpr double kElasticaYoung = 1e6;                           // Pa

Beam beam_of(int cells_high) {
  const int along = static_cast<int>(std::lround(kElasticaLength / kElasticaHeight)) * cells_high;
  return {kElasticaLength, kElasticaHeight, kElasticaHeight, along, cells_high, 2};
}

/// The bent line, points along it in shares of the length; z is down, along the load.
struct Elastica {
  std::vector<double> x, z;
};

/// θ'' = −α cos θ along the unit length, θ(0) = 0 and θ'(1) = 0, with α = P L²/(E I); found by shooting with
/// the curvature at the clamp. θ'(1) grows with it.
Elastica solve_elastica(double alpha) {
  constexpr int kArcSteps = 2000;
  constexpr double h = 1.0 / kArcSteps;
  using State = std::array<double, 4>;  // θ, θ', x, z
  const auto slope = [&](const State& s) {
    return State{s[1], -alpha * std::cos(s[0]), std::cos(s[0]), std::sin(s[0])};
  };
  const auto at = [](const State& s, double step, const State& d) {
    return State{s[0] + step * d[0], s[1] + step * d[1], s[2] + step * d[2], s[3] + step * d[3]};
  };
  const auto shoot = [&](double curvature, Elastica* line) {
    State s{0, curvature, 0, 0};
    for (int i = 0; i <= kArcSteps; ++i) {
      if (line) line->x.push_back(s[2]), line->z.push_back(s[3]);
      if (i == kArcSteps) break;
      const State a = slope(s), b = slope(at(s, h / 2, a)), c = slope(at(s, h / 2, b)),
                  d = slope(at(s, h, c));
      for (int k = 0; k < 4; ++k) s[k] += h / 6 * (a[k] + 2 * b[k] + 2 * c[k] + d[k]);
    }
    return s[1];
  };
  double low = 0, high = std::sqrt(2 * alpha);  // θ'(0)² = 2 α sin θ(1)
  for (int k = 0; k < 60; ++k) {
    const double middle = (low + high) / 2;
    (shoot(middle, nullptr) < 0 ? low : high) = middle;
  }
  Elastica line;
  shoot(low, &line);
  return line;
}

/// Tip of the elastica from elliptic integrals: (1 − x, z) at the end in shares of the length [Mattiasson,
/// "Numerical results from large deflection beam and frame problems analysed by means of elliptic integrals",
/// 1981].
struct Tabulated {
  double alpha, shortening, deflection;
};
constexpr Tabulated kTable[] = {
    {1, 0.05643, 0.30172}, {2, 0.16064, 0.49346}, {5, 0.38763, 0.71379}, {10, 0.55500, 0.81061}};

void check_theory(Report& report) {
  double worst = 0;
  for (const Tabulated& row : kTable) {
    const Elastica line = solve_elastica(row.alpha);
    worst = std::max(
        {worst, std::abs(1 - line.x.back() - row.shortening), std::abs(line.z.back() - row.deflection)});
  }
  report.at_most("the elastica solved here against tabulated values, of the length", worst, "", kTableError);
}

/// The body's middle line at equilibrium under the load α, for each α in turn.
std::vector<Elastica> bend(const fem::Material& material, const Beam& beam,
                           const std::vector<double>& alphas) {
  const fem::Mesh mesh = beam.mesh();
  fem::Model model(mesh, material, fem::Mass{1}, mesh.regions.at("base"), Eigen::Vector3d::Zero());
  const double unit = kElasticaYoung * beam.second_moment() / (kElasticaLength * kElasticaLength);  // N
  std::vector<Elastica> lines;
  Eigen::VectorXd x = model.rest();
  double reached = 0;
  for (double alpha : alphas) {
    const int steps = static_cast<int>(std::ceil(alpha - reached));
    x = settle(model, x, beam.end_load({0, 0, -(alpha - reached) * unit}), steps);
    reached = alpha;
    lines.emplace_back();
    for (int i = 0; i <= beam.cells_along; ++i) {
      const int node = beam.node(i, beam.cells_wide / 2, beam.cells_high / 2);
      const Eigen::Vector3d p = mesh.nodes.col(node) + displacement(model, x, node);
      lines.back().x.push_back(p.x() / kElasticaLength);
      lines.back().z.push_back((kElasticaHeight / 2 - p.z()) / kElasticaLength);
    }
  }
  return lines;
}

std::vector<double> downward(std::vector<double> z) {
  for (double& value : z) value = -value;
  return z;
}

}  // namespace

void elastica(Report& report, Extent extent) {
  check_theory(report);
  const bool full = extent == Extent::kFull;
  const std::vector<double> alphas = full ? std::vector<double>{1, 2, 5, 10} : std::vector<double>{1, 5};
  const Beam coarse = beam_of(full ? 4 : 2), fine = beam_of(full ? 8 : 4);
  report.picture({"The bent line and the nodes of the finest mesh", "x / length", "z / length"});
  for (double alpha : alphas) {
    const Elastica theory = solve_elastica(alpha);
    report.series(fmt::format("elastica, PL²/EI = {}", alpha), Style::kLine, theory.x, downward(theory.z));
  }
  for (const auto& [name, material] : laws(kElasticaYoung, 0)) {
    const auto rough = bend(material, coarse, alphas), good = bend(material, fine, alphas);
    for (size_t k = 0; k < alphas.size(); ++k) {
      const Elastica theory = solve_elastica(alphas[k]);
      // The error goes as h² and the meshes' h are as 2 to 1.
      const auto limit_of = [](double h, double half) { return half + (half - h) / 3; };
      const double dx = limit_of(rough[k].x.back(), good[k].x.back()) - theory.x.back();
      const double dz = limit_of(rough[k].z.back(), good[k].z.back()) - theory.z.back();
      const double finest =
          std::hypot(good[k].x.back() - theory.x.back(), good[k].z.back() - theory.z.back());
      report.note(fmt::format("{}, PL²/EI = {}: tip on the finest mesh, of the length", name, alphas[k]),
                  100 * finest, "%");
      report.at_most(fmt::format("{}, PL²/EI = {}: tip extrapolated, of the length", name, alphas[k]),
                     100 * std::hypot(dx, dz), "%", full ? kExtrapolated : kShortExtrapolated);
      std::vector<double> x, z;
      for (size_t i = 0; i < good[k].x.size(); i += 4) x.push_back(good[k].x[i]), z.push_back(good[k].z[i]);
      report.series(k == 0 ? name : "", Style::kMarks, x, downward(z));
    }
  }
}

}  // namespace tendril::validation
