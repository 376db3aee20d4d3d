#include <cmath>

#include "tests/validation/cases.h"
#include "tests/validation/convergence.h"
#include "tests/validation/statics.h"

// A cantilever under an end load so small that it bends linearly, against Timoshenko's beam. Poisson's ratio
// is zero, so that the clamp hinders nothing that the beam theory leaves free. Linear tetrahedra are too
// stiff in bending: the error of the stiffness, load over deflection, goes as the square of the cell.

namespace tendril::validation {
namespace {

constexpr ConvergenceLimits kShort{1.8, 2.2, 25, 2}, kFull{1.8, 2.2, 6, 0.5};

constexpr double kLength = 0.1, kHeight = 0.01;  // m
constexpr double kYoung = 1e6;                   // Pa
constexpr double kDeflection = 1e-3 * kLength;   // m, of Timoshenko's beam

Beam beam_of(int cells_high) { return {kLength, kHeight, kHeight, 10 * cells_high, cells_high, cells_high}; }

/// Stiffness of Timoshenko's beam, 1/k = L³/(3 E I) + L/(κ G A), N/m; κ = 5/6 for a rectangle without lateral
/// contraction [Cowper, "The shear coefficient in Timoshenko's beam theory", 1966].
double theory(const Beam& beam) {
  const double bending = std::pow(kLength, 3) / (3 * kYoung * beam.second_moment());
  const double shear = kLength / (5.0 / 6 * kYoung / 2 * beam.area());
  return 1 / (bending + shear);
}

double stiffness(const Beam& beam, const fem::Material& material) {
  fem::Model model(beam.mesh(), material, fem::Mass{1}, beam.clamped(), Eigen::Vector3d::Zero());
  const double force = theory(beam) * kDeflection;
  const auto x = settle(model, model.rest(), beam.end_load({0, 0, -force}));
  return -force / beam.end_displacement(model, x).z();
}

}  // namespace

void cantilever(Report& report, Extent extent) {
  const bool full = extent == Extent::kFull;
  report.picture({"A cantilever's stiffness: error", "edge of a cell, mm", "error, %", true});
  for (const auto& [name, material] : laws(kYoung, 0)) {
    Convergence found;
    for (int n : full ? std::vector{1, 2, 4, 8} : std::vector{1, 2, 4}) {
      found.sizes.push_back(1e3 * kHeight / n);
      found.errors.push_back(100 * (stiffness(beam_of(n), material) / theory(beam_of(n)) - 1));
    }
    report_convergence(report, name + ": error of the stiffness", found, full ? kFull : kShort);
  }
}

}  // namespace tendril::validation
