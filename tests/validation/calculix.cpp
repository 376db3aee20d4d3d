// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "fem/body/equilibrium.h"
#include "fem/mesh/mesh_reader.h"
#include "tests/validation/beam.h"
#include "tests/validation/calculix_job.h"
#include "tests/validation/cases.h"

// The same meshes, loads and supports in CalculiX, displacements compared node by node. Its elements are the
// same linear tetrahedra, its laws are not: *ELASTIC with large displacements is St Venant and Kirchhoff's,
// held against our corotational one; its NEO HOOKE divides shear and volume in another way than ours. All
// have E and ν in common, so that the difference must vanish with the strain.

namespace tendril::validation {
namespace {

constexpr int kLoadSteps = 5;  // each load is twice the one before

/// Largest difference of a node, % of the largest displacement.
struct Limits {
  double corotational, neo_hookean;  ///< at the full load
  double no_load;  ///< extrapolated to no load from the two smallest, where the difference goes as the load
};
constexpr Limits kBent{0.5, 0.2, 0.01}, kStretched{15, 6, 0.3}, kDiamond{15, 1, 0.05};

/// Displacements of all nodes in two programs.
struct Comparison {
  std::string what;
  std::vector<double> largest_mm;  ///< displacement, at every load
  std::vector<double> share;       ///< largest difference of a node, % of that, at every load
  std::vector<double> apart_mm;    ///< of all nodes at the full load, ascending
};

double largest(const Eigen::VectorXd& u) {
  return std::sqrt(u.reshaped(3, u.size() / 3).colwise().squaredNorm().maxCoeff());
}

/// @param ours  displacements under each load of the job, 3N, m
Comparison compare(const std::string& what, const CalculixJob& job,
                   const std::vector<Eigen::VectorXd>& ours) {
  Comparison result{what, {}, {}, {}};
  const auto theirs = job.run();
  for (size_t k = 0; k < ours.size(); ++k) {
    result.largest_mm.push_back(1e3 * largest(ours[k]));
    result.share.push_back(100 * largest(ours[k] - theirs[k]) / largest(ours[k]));
  }
  const Eigen::VectorXd apart = ours.back() - theirs.back();
  for (Eigen::Index i = 0; i < apart.size(); i += 3)
    result.apart_mm.push_back(1e3 * apart.segment<3>(i).norm());
  std::sort(result.apart_mm.begin(), result.apart_mm.end());
  return result;
}

/// A body under dead loads on nodes.
Comparison under_loads(const std::string& what, const fem::Mesh& mesh, const std::vector<int>& fixed,
                       const fem::Material& material, const std::vector<NodalLoad>& full) {
  fem::Model model(mesh, material, fem::Mass{1}, fixed, Eigen::Vector3d::Zero());
  CalculixJob job{model, material, {}};
  std::vector<Eigen::VectorXd> ours;
  Eigen::VectorXd x = model.rest();
  double reached = 0;
  for (int k = 1; k <= kLoadSteps; ++k) {
    const double share = std::ldexp(1, k - kLoadSteps);
    std::vector<NodalLoad> more = full;
    for (NodalLoad& load : more) load.force *= share - reached;
    x = settle(model, x, more, 4);
    reached = share;
    ours.push_back(x - model.rest());
    job.loads.push_back(model.external_forces());
  }
  return compare(what, job, ours);
}

/// The demo's robot under gravity and cables. An equilibrium under cables is one under the same forces held
/// dead.
Comparison diamond(const std::string& what, const fem::Material& material) {
  const fem::Mesh mesh =
      fem::read_mesh(std::filesystem::path(TENDRIL_SOURCE_DIR) / "config/diamond.msh", 1e-3);
  const Eigen::Vector4d tensions(2, 1, 0.5, 1);  // N
  const auto model_under = [&](double gravity) {
    return fem::Model(mesh, material, fem::Mass{0.5}, mesh.regions.at("base"), {0, 0, -gravity});
  };
  const fem::Model resting = model_under(0);
  CalculixJob job{resting, material, {}};
  std::vector<Eigen::VectorXd> ours;
  Eigen::VectorXd x = resting.rest();
  for (int k = 1; k <= kLoadSteps; ++k) {
    const double share = std::ldexp(1, k - kLoadSteps);
    const fem::Model model = model_under(9.81 * share);
    const auto knee = [&](double east, double north) {
      return fem::attach(model.mesh(), {east, north, 0.045}, 1e-3);
    };
    const auto guide = [](double east, double north) { return Eigen::Vector3d(east, north, 0.03); };
    const fem::Constraints cables(
        model,
        {fem::Cable{{knee(0, 0.097), guide(0, 0.01)}}, fem::Cable{{knee(-0.097, 0), guide(-0.01, 0)}},
         fem::Cable{{knee(0, -0.097), guide(0, -0.01)}}, fem::Cable{{knee(0.097, 0), guide(0.01, 0)}}},
        {});
    fem::Equilibrium body(model, cables);
    body.set_x(x);
    if (!body.settle_under_efforts(share * tensions, 1e-9).converged)
      throw std::runtime_error("the diamond did not come to rest under its cables");
    x = body.x();
    Eigen::MatrixXd J_aT(model.unknowns(), cables.actuators());
    cables.actuator_directions(x, J_aT);
    ours.push_back(x - model.rest());
    job.loads.push_back(model.external_forces() + J_aT * (share * tensions));
  }
  return compare(what, job, ours);
}

void report_comparison(Report& report, const Comparison& found, fem::Law law, const Limits& limits) {
  const double size = found.largest_mm.back(), median = found.apart_mm[found.apart_mm.size() / 2];
  report.note(found.what + ": largest displacement", size, "mm");
  report.note(found.what + ": median difference of a node", median, "mm");
  report.note(found.what + ": largest difference of a node", found.apart_mm.back(), "mm");
  report.note(found.what + ": median difference, of the largest displacement", 100 * median / size, "%");
  report.at_most(found.what + ": largest difference, of the largest displacement", found.share.back(), "%",
                 law == fem::Law::of<fem::CorotationalElement>() ? limits.corotational : limits.neo_hookean);
  report.note(fmt::format("{}: the same at 1/{} of the load", found.what, 1 << (kLoadSteps - 1)),
              found.share[0], "%");
  report.at_most(found.what + ": the same extrapolated to no load",
                 std::abs(2 * found.share[0] - found.share[1]), "%", limits.no_load);
}

void draw(Report& report, const std::vector<Comparison>& all) {
  report.picture(
      {"Largest difference from CalculiX", "largest displacement, mm", "of the displacement, %", true});
  for (const Comparison& one : all) report.series(one.what, Style::kBoth, one.largest_mm, one.share);
  report.picture(
      {"Differences of the nodes at the full load", "difference, mm", "share of the nodes below, %"});
  for (const Comparison& one : all) {
    std::vector<double> share;
    for (size_t i = 0; i < one.apart_mm.size(); ++i)
      share.push_back(100 * static_cast<double>(i + 1) / static_cast<double>(one.apart_mm.size()));
    report.series(one.what, Style::kLine, one.apart_mm, share);
  }
}

}  // namespace

void calculix(Report& report, Extent extent) {
  if (extent == Extent::kShort) return report.skipped("the short form does without CalculiX");
  if (!calculix_is_here())
    return report.skipped("ccx is not installed; tools/setup --validation installs it");
  const Beam beam{0.1, 0.01, 0.01, 40, 4, 4}, block{0.03, 0.03, 0.03, 6, 6, 6};
  std::vector<Comparison> all;
  for (const auto& [law, material] : laws(100e3, 0.3)) {
    const double bend = 2 * 100e3 * beam.second_moment() / (beam.length * beam.length);  // N: PL²/EI = 2
    all.push_back(under_loads("bent cantilever, " + law, beam.mesh(), beam.clamped(), material,
                              beam.end_load({0, 0, -bend})));
    report_comparison(report, all.back(), material.law, kBent);
    const double stretch = 0.1 * 100e3 * block.area();  // N
    all.push_back(under_loads("stretched and sheared block, " + law, block.mesh(), block.clamped(), material,
                              block.end_load({stretch, 0, -0.3 * stretch})));
    report_comparison(report, all.back(), material.law, kStretched);
  }
  for (const auto& [law, material] : laws(150e3, 0.45)) {
    all.push_back(diamond("diamond under cables and gravity, " + law, material));
    report_comparison(report, all.back(), material.law, kDiamond);
  }
  draw(report, all);
}

}  // namespace tendril::validation
