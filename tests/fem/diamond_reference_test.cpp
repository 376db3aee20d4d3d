#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "fem/equilibrium.h"
#include "fem/mesh_reader.h"

// Static cases of the robot of Largilliere et al. (2015) on its published mesh, computed elsewhere: by an
// independent program with the same element (polar decomposition), and by SOFA with another corotational
// frame. The data live outside the project; see TENDRIL_SHARED_DATA.

namespace tendril::fem {
namespace {

struct Limits {
  const char* file;
  double position_mm;
  double tension_share;  // of the largest tension of the case
};
constexpr Limits kPolar{"forward_polar.csv", 0.005, 0.0005};
constexpr Limits kSofa{"forward_sofa.csv", 0.8, 0.08};

const std::filesystem::path kFolder = std::filesystem::path(TENDRIL_SHARED_DATA) / "diamond";

/// Rows of a CSV file as numbers; "none" becomes NaN.
std::vector<std::vector<double>> read_csv(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line, cell;
  std::getline(in, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    while (std::getline(cells, cell, ',')) rows.back().push_back(cell == "none" ? NAN : std::stod(cell));
  }
  return rows;
}

Mesh diamond() {
  Mesh mesh = read_mesh(kFolder / "diamond.vtu", 1e-3);
  for (auto p : mesh.nodes.colwise()) p = Eigen::Vector3d(p.x(), -p.z(), p.y() + 0.035);
  return mesh;
}

TEST_CASE("The paper's robot under given cable lengths rests where the references do", "[law]") {
  if (!std::filesystem::exists(kFolder)) {
    WARN("skipped: no reference data at " << kFolder.string() << " (CMake: TENDRIL_SHARED_DATA)");
    return;
  }
  const Mesh mesh = diamond();
  REQUIRE(mesh.node_count() == 1628);
  REQUIRE(mesh.tet_count() == 4147);
  const auto fixed = nodes_in(mesh, Box{{-0.015, -0.015, -0.040}, {0.015, 0.015, 0.010}});
  REQUIRE(fixed.size() == 58);
  const Model model(mesh, {180e3, 0.45}, Mass{0.5, true}, fixed, {0, 0, -9.81});
  REQUIRE(model.unknowns() == 4710);

  const auto at_node = [&](int node) { return attach(model.mesh(), mesh.nodes.col(node), 1e-9); };
  const auto cable = [&](int node, const Eigen::Vector3d& guide) { return Cable{{at_node(node), guide}}; };
  const PointEffector tip{{at_node(198)}};
  const Constraints pulled(model,
                           {cable(483, {0, 0.010, 0.030}), cable(729, {-0.010, 0, 0.030}),
                            cable(726, {0, -0.010, 0.030}), cable(139, {0.010, 0, 0.030})},
                           {tip});
  const Constraints bare(model, {}, {tip});

  const Limits limits = GENERATE(kPolar, kSofa);
  const auto rows = read_csv(kFolder / limits.file);
  REQUIRE(rows.size() == 9);
  for (const auto& row : rows) {
    const bool cables = !std::isnan(row[1]);
    INFO(limits.file << " case " << row[0]);
    const Constraints& constraints = cables ? pulled : bare;
    Eigen::VectorXd delta_a(constraints.actuators());
    for (int a = 0; a < delta_a.size(); ++a) delta_a[a] = 1e-3 * row[1 + a];

    Equilibrium equilibrium(model, constraints);
    const Settled settled = equilibrium.settle_at_lengths(delta_a, Sign::kBilateral, 1e-10);
    INFO(settled.iterations << " iterations, last move " << settled.last_move << " m");
    REQUIRE(settled.converged);

    const Eigen::Vector3d p_mm = 1e3 * constraints.effector_position(equilibrium.x());
    const Eigen::Vector3d expected_mm(row[5], row[6], row[7]);
    INFO("found " << p_mm.transpose() << ", expected " << expected_mm.transpose() << " mm");
    CHECK((p_mm - expected_mm).norm() < limits.position_mm);
    if (!cables) continue;
    const Eigen::VectorXd expected_N = 1e-3 * Eigen::Map<const Eigen::VectorXd>(&row[8], 4);
    INFO("found " << settled.lambda.transpose() << ", expected " << expected_N.transpose() << " N");
    CHECK((settled.lambda - expected_N).cwiseAbs().maxCoeff() <
          limits.tension_share * expected_N.cwiseAbs().maxCoeff());
  }
}

}  // namespace
}  // namespace tendril::fem
