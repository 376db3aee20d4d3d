// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tests/validation/report.h"

namespace tendril::validation {

/// Errors of one quantity on meshes that become finer.
struct Convergence {
  std::vector<double> sizes;   ///< of a cell, mm, descending
  std::vector<double> errors;  ///< relative, signed, %

  void add(double size, double error) {
    sizes.push_back(size);
    errors.push_back(error);
  }
};

/// What is asked of a convergence. Errors are in %.
struct ConvergenceLimits {
  double order_low, order_high;
  double finest;        ///< error on the finest mesh
  double extrapolated;  ///< error of the value that two meshes extrapolate to where the error goes as h²
};

/// Slope of the error between two sizes in a log-log plot.
double order(double coarse_size, double coarse_error, double fine_size, double fine_error);

/// Rows for every mesh, the order between the two finest and the extrapolated error; a series of the last
/// picture.
void report_convergence(Report& report, const std::string& what, const Convergence& found,
                        const ConvergenceLimits& limits);

/// A dashed line of second order through the finest mesh, in the last picture.
void draw_second_order(Report& report, const Convergence& found);

}  // namespace tendril::validation
