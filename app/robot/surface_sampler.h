// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <variant>
#include <vector>

#include "app/config/config.h"
#include "fem/body/model.h"
#include "rt/surface.h"

namespace tendril::app {

/// Takes from a pose what shows the body: the nodes of its surface, then the points that actuators, effectors
/// and loads are attached to, both in the order of robot_geometry().
class SurfaceSampler {
 public:
  /// Keeps a reference to the model.
  /// @throws ConfigError where a point cannot be attached
  SurfaceSampler(const fem::Model& model, const Config& config);

  Eigen::Index size() const { return static_cast<Eigen::Index>(nodes_.size() + points_.size()); }

  /// @param x        the free nodes, 3N, m
  /// @param surface  overwritten: 3 × size(), m
  /// Real-time: no (allocates the first time; time depends on the mesh).
  void sample(const Eigen::VectorXd& x, int64_t now_ns, rt::Surface& surface) const;

 private:
  const fem::Model& model_;
  std::vector<int> nodes_;                                              // in the model's numbering
  std::vector<std::variant<fem::Attachment, Eigen::Vector3d>> points_;  // on the body, or still, m
};

}  // namespace tendril::app
