// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <string>

namespace tendril::fem {

/// A position (m) in mm, as messages show it: "(1, -2.5, 30) mm". Real-time: no (allocates).
inline std::string format_point_mm(const Eigen::Vector3d& p) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g}) mm", 1e3 * p.x(), 1e3 * p.y(), 1e3 * p.z());
}

}  // namespace tendril::fem
