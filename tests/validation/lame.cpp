#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <numeric>

#include "tests/validation/cases.h"
#include "tests/validation/convergence.h"
#include "tests/validation/hollow_sphere.h"
#include "tests/validation/statics.h"

// A hollow sphere whose outer surface is held, under a small pressure inside, against Lamé's solution
// u(r) = A r + B/r².

namespace tendril::validation {
namespace {

constexpr ConvergenceLimits kShort{1.7, 2.2, 10, 3}, kFull{1.8, 2.2, 2.5, 0.5};

constexpr double kInner = 0.01, kOuter = 0.02;  // m
constexpr double kYoung = 100e3, kPoisson = 0.3;
constexpr double kPressure = 1.0;  // Pa: strains of 1e-5

/// From u(b) = 0 and σ_rr(a) = 3 K A − 4 μ B/a³ = −p.
double lame_displacement(const fem::Material& material, double r) {
  const double bulk3 = kYoung / (1 - 2 * material.poisson_ratio), ratio3 = std::pow(kOuter / kInner, 3);
  const double A = -kPressure / (bulk3 + 4 * material.lame_mu() * ratio3);
  return A * (r - std::pow(kOuter, 3) / (r * r));
}

std::vector<double> layers(int count) {
  std::vector<double> radii;
  for (int k = 0; k <= count; ++k) radii.push_back(kInner + (kOuter - kInner) * k / count);
  return radii;
}

/// Mean radial displacement of each layer of nodes, m.
std::vector<double> inflate(const fem::Material& material, int frequency) {
  const HollowSphere sphere = hollow_sphere(layers(frequency), frequency);
  const fem::Mesh& mesh = sphere.mesh;
  std::vector<int> fixed(sphere.nodes_a_layer);
  std::iota(fixed.begin(), fixed.end(), mesh.node_count() - sphere.nodes_a_layer);
  fem::Model model(mesh, material, fem::Mass{1}, fixed, Eigen::Vector3d::Zero());
  std::vector<NodalLoad> loads;
  for (const auto& [a, b, c] : sphere.triangles) {
    const Eigen::Vector3d p = mesh.nodes.col(a), q = mesh.nodes.col(b), r = mesh.nodes.col(c);
    for (int node : {a, b, c}) loads.push_back({node, kPressure / 6 * (q - p).cross(r - p)});
  }
  const Eigen::VectorXd x = settle(model, model.rest(), loads);
  std::vector<double> mean(sphere.radii.size(), 0.0);
  for (int node = 0; node < mesh.node_count(); ++node)
    mean[node / sphere.nodes_a_layer] +=
        displacement(model, x, node).dot(mesh.nodes.col(node).normalized()) / sphere.nodes_a_layer;
  return mean;
}

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

}  // namespace

void lame(Report& report, Extent extent) {
  const bool full = extent == Extent::kFull;
  std::vector<std::vector<double>> profiles;
  const auto materials = laws(kYoung, kPoisson);
  const int finest = full ? 8 : 4;
  report.picture({"A hollow sphere's stiffness: error", "thickness of a layer, mm", "error, %", true});
  for (const auto& [name, material] : materials) {
    Convergence found;
    for (int n = 2; n <= finest; n *= 2) {
      profiles.push_back(inflate(material, n));
      found.sizes.push_back(1e3 * (kOuter - kInner) / n);
      found.errors.push_back(100 * (lame_displacement(material, kInner) / profiles.back()[0] - 1));
    }
    report_convergence(report, name + ": error of pressure over displacement", found, full ? kFull : kShort);
  }
  report.picture({"Radial displacement through the wall", "radius, mm", "displacement, nm"});
  std::vector<double> r, u;
  for (int k = 0; k <= 100; ++k) {
    r.push_back(kInner + (kOuter - kInner) * k / 100);
    u.push_back(1e9 * lame_displacement(materials[0].material, r.back()));
  }
  report.series("Lamé", Style::kLine, scaled(r, 1e3), u);
  report.series("on the finest mesh", Style::kMarks, scaled(layers(finest), 1e3),
                scaled(profiles.back(), 1e9));
}

}  // namespace tendril::validation
