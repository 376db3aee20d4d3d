// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "app/robot/inverse_statics.h"
#include "fem/body/equilibrium.h"
#include "fem/mesh/mesh_reader.h"
#include "tests/scenario/paper_diamond.h"
#include "tests/validation/cases.h"

// The robot of Largilliere et al. (2015) on its published mesh: static cases computed elsewhere, by an
// independent program with the same element (polar decomposition), by SOFA, whose elements turn with another
// frame, and by SOFA's inverse model, whose mapping of points outside the mesh differs from ours too. The
// data live outside the project; see TENDRIL_SHARED_DATA.

namespace tendril::validation {
namespace {

struct ForwardLimits {
  const char* who;
  const char* file;
  double position_mm;
  double tension;  ///< % of the largest tension of the case
};
constexpr ForwardLimits kPolar{"independent program, same element", "forward_polar.csv", 0.005, 0.05};
constexpr ForwardLimits kSofa{"SOFA, other frame", "forward_sofa.csv", 0.8, 8};
constexpr double kInversePosition_mm = 0.1, kInverseLength_mm = 1.0;
constexpr int kForwardCases = 9, kInverseGoals = 7;

const std::filesystem::path kFolder = std::filesystem::path(TENDRIL_SHARED_DATA) / "diamond";

/// Rows of a CSV file as numbers; "none" becomes NaN.
std::vector<std::vector<double>> read_csv(const std::filesystem::path& file, size_t expected) {
  std::ifstream in(file);
  std::string line, cell;
  std::getline(in, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    while (std::getline(cells, cell, ',')) rows.back().push_back(cell == "none" ? NAN : std::stod(cell));
  }
  if (rows.size() != expected)
    throw std::runtime_error(
        fmt::format("{} holds {} cases, expected {}", file.string(), rows.size(), expected));
  return rows;
}

/// Not a number where one of them is none.
double largest(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::ArrayXd>(values.data(), static_cast<Eigen::Index>(values.size()))
      .maxCoeff<Eigen::PropagateNaN>();
}

struct Found {
  Eigen::Vector3d tip_mm;
  Eigen::VectorXd tensions;  ///< N
};

/// The robot with its cables shortened (mm; NaN: no cables at all), negative tensions allowed.
Found rest_at(const Eigen::Vector4d& shortening_mm) {
  fem::Mesh mesh = fem::read_mesh(kFolder / "diamond.vtu", 1e-3);
  for (auto p : mesh.nodes.colwise()) p = Eigen::Vector3d(p.x(), -p.z(), p.y() + 0.035);
  const auto fixed = fem::nodes_in(mesh, fem::Box{{-0.015, -0.015, -0.040}, {0.015, 0.015, 0.010}});
  const fem::Model model(mesh, {180e3, 0.45}, fem::Mass{0.5, true}, fixed, {0, 0, -9.81});
  const auto at_node = [&](int node) { return fem::attach(model.mesh(), mesh.nodes.col(node), 1e-9); };
  const auto cable = [&](int node, const Eigen::Vector3d& guide) {
    return fem::Cable{{at_node(node), guide}};
  };
  std::vector<fem::Actuator> cables = {cable(483, {0, 0.010, 0.030}), cable(729, {-0.010, 0, 0.030}),
                                       cable(726, {0, -0.010, 0.030}), cable(139, {0.010, 0, 0.030})};
  if (shortening_mm.hasNaN()) cables.clear();
  const fem::Constraints constraints(model, cables, {fem::PointEffector{{at_node(198)}}});
  fem::Equilibrium body(model, constraints);
  const Eigen::VectorXd delta_a = 1e-3 * shortening_mm.head(constraints.actuators());
  const fem::EquilibriumResult settled =
      body.settle_at_displacements(delta_a, fem::EffortSign::kBilateral, 1e-10);
  if (!settled.converged) throw std::runtime_error("the paper's robot did not come to rest");
  return {1e3 * constraints.effector_position(body.x()), settled.lambda};
}

void forward(Report& report, const ForwardLimits& limits) {
  std::vector<double> numbers, distances, tensions;
  for (const auto& row : read_csv(kFolder / limits.file, kForwardCases)) {
    const Found found = rest_at(Eigen::Map<const Eigen::Vector4d>(&row[1]));
    numbers.push_back(row[0]);
    distances.push_back((found.tip_mm - Eigen::Map<const Eigen::Vector3d>(&row[5])).norm());
    if (found.tensions.size() == 0) continue;
    const Eigen::Vector4d expected = 1e-3 * Eigen::Map<const Eigen::Vector4d>(&row[8]);
    const double apart = (found.tensions - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
    tensions.push_back(100 * apart);
  }
  const std::string who = limits.who;
  report.at_most(who + ": largest distance of the tip", largest(distances), "mm", limits.position_mm);
  report.at_most(who + ": largest difference of a tension, of the case's largest", largest(tensions), "%",
                 limits.tension);
  report.series(who, Style::kMarks, numbers, distances);
}

void inverse(Report& report) {
  const app::Config config = app::testing::paper_diamond(kFolder);
  const auto robot = app::build_model(config);
  std::vector<double> tips, lengths;
  for (const auto& row : read_csv(kFolder / "inverse_sofa.csv", kInverseGoals)) {
    const Eigen::Map<const Eigen::Vector3d> goal(&row[0]), effector(&row[3]);
    const Eigen::Map<const Eigen::Vector4d> expected(&row[10]);
    const app::StaticSolution reached =
        app::solve_inverse_statics(*robot, config, rt::EffectorVector(1e-3 * goal));
    if (!reached.converged) throw std::runtime_error("a goal of SOFA's inverse model is not reached");
    tips.push_back((1e3 * reached.p_e - effector).norm());
    lengths.push_back((1e3 * reached.delta_a - expected).cwiseAbs().maxCoeff());
  }
  report.at_most("SOFA's inverse model: largest distance of the tip", largest(tips), "mm",
                 kInversePosition_mm);
  report.at_most("SOFA's inverse model: largest difference of a cable's length", largest(lengths), "mm",
                 kInverseLength_mm);
}

}  // namespace

void references(Report& report, Extent) {
  if (!std::filesystem::exists(kFolder / "diamond.vtu"))
    return report.skipped("no reference data at " + kFolder.string() + " (CMake: TENDRIL_SHARED_DATA)");
  report.picture({"Distance of the tip from the references'", "number of the case", "distance, mm"});
  forward(report, kPolar);
  forward(report, kSofa);
  inverse(report);
}

}  // namespace tendril::validation
