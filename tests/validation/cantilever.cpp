// SPDX-License-Identifier: Apache-2.0
#include "tests/validation/beam.h"
#include "tests/validation/cases.h"
#include "tests/validation/convergence.h"

// A cantilever under an end load so small that it bends linearly, against Timoshenko's beam. Poisson's ratio
// is zero, so that the clamp hinders nothing that the beam theory leaves free. Linear tetrahedra are too
// stiff in bending: the error of the stiffness, load over deflection, goes as the square of the cell.

namespace tendril::validation {
namespace {

constexpr ConvergenceLimits kShort{1.8, 2.2, 25, 2}, kFull{1.8, 2.2, 6, 0.5};

constexpr double kLength = 0.1, kHeight = 0.01;  // m
constexpr double kYoung = 1e6;                   // Pa

}  // namespace

void cantilever(Report& report, Extent extent) {
  const bool full = extent == Extent::kFull;
  report.picture({"A cantilever's stiffness: error", "edge of a cell, mm", "error, %", true});
  Convergence found;
  for (const auto& [name, material] : laws(kYoung, 0)) {
    found = {};
    for (int n : full ? std::vector{1, 2, 4, 8} : std::vector{1, 2, 4}) {
      const Beam beam{kLength, kHeight, kHeight, 10 * n, n, n};
      const double ratio = end_stiffness(beam, material) / timoshenko_stiffness(beam, material);
      found.add(1e3 * kHeight / n, 100 * (ratio - 1));
    }
    report_convergence(report, name + ": error of the stiffness", found, full ? kFull : kShort);
  }
  draw_second_order(report, found);
}

}  // namespace tendril::validation
