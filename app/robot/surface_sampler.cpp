// SPDX-License-Identifier: Apache-2.0
#include "app/robot/surface_sampler.h"

#include "app/robot/body.h"
#include "app/robot/place.h"
#include "fem/mesh/surface.h"

namespace tendril::app {

SurfaceSampler::SurfaceSampler(const fem::Model& model, const Config& config)
    : model_(model), nodes_(fem::nodes_of(fem::boundary(model.mesh()))) {
  const auto add = [&](const PointConfig& point, const char* key) {
    if (point.on_body)
      points_.emplace_back(attach(model.mesh(), config, point, key));
    else
      points_.emplace_back(point.at);
  };
  for (const ActuatorConfig& actuator : config.actuators)
    for (const PointConfig& point : points_of(actuator)) add(point, "actuators");
  for (const EffectorConfig& effector : config.effectors)
    for (const PointConfig& point : effector.points) add(point, "effectors");
  for (const LoadConfig& load : config.loads) add(load.at, "loads");
}

void SurfaceSampler::sample(const Eigen::VectorXd& x, int64_t now_ns, rt::Surface& surface) const {
  surface.stamp_ns = now_ns;
  surface.positions.resize(3, size());
  Eigen::Index column = 0;
  for (const int node : nodes_) surface.positions.col(column++) = model_.position(x, node).cast<float>();
  for (const auto& point : points_) {
    const auto* attachment = std::get_if<fem::Attachment>(&point);
    surface.positions.col(column++) =
        (attachment ? model_.position(x, *attachment) : std::get<Eigen::Vector3d>(point)).cast<float>();
  }
}

}  // namespace tendril::app
