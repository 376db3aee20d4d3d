// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "tests/validation/beam.h"
#include "tests/validation/cases.h"
#include "tests/validation/convergence.h"
#include "tests/validation/pressed_sphere.h"

// Rubber hardly changes its volume. Linear tetrahedra that each keep their own volume then lock: they are far
// too stiff where the body is confined, as in a wall under pressure, and somewhat too stiff in bending.
// Tetrahedra that share the change of volume in patches must come near the theory all the same.

namespace tendril::validation {
namespace {

struct LockingLimits {
  double patches;  ///< error of the stiffness with patches on the finest mesh, %
  double gain;     ///< least factor by which the elements' error is larger
};
constexpr LockingLimits kShortSphere{10, 4}, kFullSphere{3, 6};
constexpr LockingLimits kShortBeam{30, 5}, kFullBeam{15, 5};

constexpr double kLockingYoung = 100e3, kLockingPoisson = 0.49;
constexpr double kLockingLength = 0.1, kLockingHeight = 0.01;  // m

double sphere_error(const fem::Material& material, int n) {
  const PressedSphere sphere{material, n};
  return 100 * (sphere.theory(sphere.kInner) / sphere.inflate().displacement[0] - 1);
}

double beam_error(const fem::Material& material, int n) {
  const Beam beam{kLockingLength, kLockingHeight, kLockingHeight, 10 * n, n, n};
  return 100 * (end_stiffness(beam, material) / timoshenko_stiffness(beam, material) - 1);
}

void compare(Report& report, const std::string& law, fem::Material material, const std::vector<int>& levels,
             double (*error)(const fem::Material&, int), double size, const LockingLimits& limits) {
  std::vector<double> sizes, elements, patches;
  for (int n : levels) {
    sizes.push_back(1e3 * size / n);
    material.dilatation = fem::Dilatation::kElement;
    elements.push_back(error(material, n));
    material.dilatation = fem::Dilatation::kPatch;
    patches.push_back(std::abs(error(material, n)));
  }
  report.note(law + ", each element by itself: error of the stiffness", elements.back(), "%");
  report.at_most(law + ", in patches: error of the stiffness", patches.back(), "%", limits.patches);
  report.within(law + ": error of elements over that of patches", elements.back() / patches.back(), "",
                limits.gain, INFINITY);
  report.series(law + ", each element by itself", Style::kBoth, sizes, elements);
  report.series(law + ", in patches", Style::kBoth, sizes, patches);
}

}  // namespace

void locking(Report& report, Extent extent) {
  const bool full = extent == Extent::kFull;
  const auto sphere_levels = full ? std::vector{2, 4, 8} : std::vector{2, 4};
  const auto beam_levels = full ? std::vector{2, 4, 6} : std::vector{2, 4};
  report.picture(
      {"Hollow sphere, ν = 0.49: error of the stiffness", "thickness of a layer, mm", "error, %", true});
  for (const auto& [name, material] : laws(kLockingYoung, kLockingPoisson))
    compare(report, "hollow sphere, " + name, material, sphere_levels, sphere_error,
            PressedSphere::kOuter - PressedSphere::kInner, full ? kFullSphere : kShortSphere);
  report.picture({"Cantilever, ν = 0.49: error of the stiffness", "edge of a cell, mm", "error, %", true});
  for (const auto& [name, material] : laws(kLockingYoung, kLockingPoisson))
    compare(report, "cantilever, " + name, material, beam_levels, beam_error, kLockingHeight,
            full ? kFullBeam : kShortBeam);
}

}  // namespace tendril::validation
