// SPDX-License-Identifier: Apache-2.0
#include "tests/validation/cases.h"
#include "tests/validation/convergence.h"
#include "tests/validation/pressed_sphere.h"
#include "tests/validation/statics.h"

// A hollow sphere under a small pressure inside, against Lamé's solution.

namespace tendril::validation {
namespace {

constexpr ConvergenceLimits kLameShort{1.7, 2.2, 12, 4}, kLameFull{1.8, 2.2, 3, 1};
constexpr ConvergenceLimits kShortGrowth{1.7, 2.2, 20, 4}, kFullGrowth{1.8, 2.2, 5, 1};

constexpr double kLameYoung = 100e3, kPoisson = 0.3;

}  // namespace

void lame(Report& report, Extent extent) {
  const bool full = extent == Extent::kFull;
  const int finest = full ? 8 : 4;
  report.picture({"A hollow sphere's stiffness: error", "thickness of a layer, mm", "error, %", true});
  Inflation last;
  Convergence inside, growth;
  for (const auto& [name, material] : laws(kLameYoung, kPoisson)) {
    inside = growth = {};
    for (int n = 2; n <= finest; n *= 2) {
      const PressedSphere sphere{material, n};
      last = sphere.inflate();
      inside.add(1e3 * sphere.cell(), 100 * (sphere.theory(sphere.kInner) / last.displacement[0] - 1));
      growth.add(1e3 * sphere.cell(), 100 * (sphere.theory_of_growth() / last.growth - 1));
    }
    report_convergence(report, name + ": error of pressure over displacement inside", inside,
                       full ? kLameFull : kLameShort);
    report_convergence(report, name + ": error of pressure over growth of the cavity", growth,
                       full ? kFullGrowth : kShortGrowth);
  }
  draw_second_order(report, growth);

  report.picture({"Displacement through the wall", "radius, mm", "displacement, nm"});
  const PressedSphere sphere{laws(kLameYoung, kPoisson)[0].material, finest};
  std::vector<double> r, u, radii = sphere.radii();
  for (int k = 0; k <= 100; ++k) {
    const double at = sphere.kInner + (sphere.kOuter - sphere.kInner) * k / 100;
    r.push_back(1e3 * at);
    u.push_back(1e9 * sphere.theory(at));
  }
  report.series("Lamé", Style::kLine, r, u);
  for (double& value : radii) value *= 1e3;
  for (double& value : last.displacement) value *= 1e9;
  report.series("on the finest mesh", Style::kMarks, radii, last.displacement);
}

}  // namespace tendril::validation
