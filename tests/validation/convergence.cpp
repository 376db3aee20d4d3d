// SPDX-License-Identifier: Apache-2.0
#include "tests/validation/convergence.h"

#include <fmt/format.h>

#include <cmath>

namespace tendril::validation {

double order(double coarse_size, double coarse_error, double fine_size, double fine_error) {
  return std::log(std::abs(coarse_error / fine_error)) / std::log(coarse_size / fine_size);
}

void report_convergence(Report& report, const std::string& what, const Convergence& found,
                        const ConvergenceLimits& limits) {
  const size_t fine = found.sizes.size() - 1, coarse = fine - 1;
  for (size_t k = 0; k < fine; ++k)
    report.note(fmt::format("{}, cells of {:.3g} mm", what, found.sizes[k]), found.errors[k], "%");
  report.at_most(fmt::format("{}, cells of {:.3g} mm", what, found.sizes[fine]), std::abs(found.errors[fine]),
                 "%", limits.finest);
  report.within(what + ": order of convergence",
                order(found.sizes[coarse], found.errors[coarse], found.sizes[fine], found.errors[fine]), "",
                limits.order_low, limits.order_high);
  const double gain = std::pow(found.sizes[coarse] / found.sizes[fine], 2);
  report.at_most(what + ", extrapolated to cells of no size",
                 std::abs((gain * found.errors[fine] - found.errors[coarse]) / (gain - 1)), "%",
                 limits.extrapolated);
  std::vector<double> sizes_of_errors;
  for (double error : found.errors) sizes_of_errors.push_back(std::abs(error));
  report.series(what, Style::kBoth, found.sizes, sizes_of_errors);
}

void draw_second_order(Report& report, const Convergence& found) {
  const double coarse = found.sizes.front(), fine = found.sizes.back(), error = std::abs(found.errors.back());
  report.series("second order", Style::kGuide, {coarse, fine}, {error * std::pow(coarse / fine, 2), error});
}

}  // namespace tendril::validation
