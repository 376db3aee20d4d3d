// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "app/config/config.h"
#include "tools/loops.h"

namespace tendril::tools {

/// How much the QP's matrix W_eaᵀW_ea changed while the tip went along a line. [Largilliere 2015, section IV]
struct CouplingVariation {
  double largest = 0;           ///< of changes, relative to the norm before
  std::vector<double> changes;  ///< of ‖W_eaᵀW_ea‖∞ [eq. 7] from each snapshot to the next, relative
};

/// Sends the tip of a robot from rest along a straight line, at constant speed from the first instant to the
/// last, and watches every snapshot from the start until five periods of the model after the end. The top
/// rates of the drives are raised out of the way; the simulated body has no part in what the model does.
/// @param way    from where the tip rests, m
/// @param speed  m/s
/// @throws std::runtime_error where the tip does not get under way
/// Real-time: no.
CouplingVariation variation_on_line(app::Config config, const Eigen::Vector3d& way, double speed,
                                    const Loops& loops);

/// The speed at which a quantity that was found at rising speeds first passes a value, interpolated between
/// the speeds on either side; NaN where it does not.
/// @param speeds  rising; any unit, also the result's
double speed_at(double value, const std::vector<double>& speeds, const std::vector<double>& found);

}  // namespace tendril::tools
