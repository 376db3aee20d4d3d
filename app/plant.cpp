#include "app/plant.h"

#include <fmt/format.h>

#include <cmath>

#include "fem/equilibrium.h"
#include "hal/drive_protocol.h"
#include "hal/tracker.h"

namespace tendril::app {
namespace {

constexpr double kSettled = 1e-9;  // m
// A drive that keeps up with its actuator's top rate has some in hand to catch up with.
constexpr double kSpareSpeed = 1.25;
constexpr int kFramesPerCall = 1024;

}  // namespace

PlantDrives::PlantDrives(const Config& config, const PlantDisplacements& start)
    : tracker_id_(static_cast<std::uint32_t>(config.bus.tracker_id)),
      tracker_period_ns_(std::llround(1e9 / config.plant->tracker_rate_hz)) {
  const hal::MasterConfig master = master_config(config);
  for (size_t a = 0; a < config.actuators.size(); ++a)
    drives_.push_back(hal::make_drive(master, static_cast<int>(a),
                                      {kSpareSpeed * config.actuators[a].top_rate, start.delta_a[a]}));
}

void PlantDrives::serve(hal::Bus& bus, const PlantTip& tip, std::int64_t now_ns) noexcept {
  hal::Frame frame;
  for (int k = 0; k < kFramesPerCall && bus.receive(frame); ++k) {
    answers_.clear();
    for (auto& drive : drives_) drive->receive(frame, now_ns, answers_);
    bus.send(answers_);
  }
  answers_.clear();
  for (auto& drive : drives_) drive->advance(now_ns, answers_);
  bus.send(answers_);
  show(bus, tip, now_ns);
}

void PlantDrives::show(hal::Bus& bus, const PlantTip& tip, std::int64_t now_ns) noexcept {
  if (tracker_id_ == 0 || tip.stamp_ns == 0 || tip.stamp_ns < shown_ns_ + tracker_period_ns_) return;
  const hal::TrackerSample sample{{tip.position.x(), tip.position.y(), tip.position.z()},
                                  now_ns - tip.stamp_ns};
  if (const auto frame = hal::encode_tracker(tracker_id_, sample)) bus.send(*frame);
  shown_ns_ = tip.stamp_ns;
}

PlantDisplacements PlantDrives::displacements() const noexcept {
  PlantDisplacements displacements;
  for (size_t a = 0; a < drives_.size(); ++a) displacements.delta_a[a] = drives_[a]->displacement();
  return displacements;
}

PlantBody::PlantBody(const Config& config, const PlantDisplacements& start)
    : robot_(build_plant(config)),
      dynamics_(robot_->model, robot_->constraints,
                fem::Damping{config.plant->damping_mass, config.plant->damping_stiffness}),
      time_step_ns_(std::llround(1e9 * config.plant->time_step)) {
  fem::Equilibrium rest(robot_->model, robot_->constraints);
  const fem::Settled settled = rest.settle_at_displacements(vector(start), fem::Sign::kPullOnly, kSettled);
  if (!settled.converged)
    throw ConfigError(
        fmt::format("{}: plant: the simulated robot finds no rest with its drives as they stand; "
                    "is it too soft for its weight?",
                    config.file.string()));
  dynamics_.reset(rest.x());
}

Eigen::VectorXd PlantBody::vector(const PlantDisplacements& displacements) const {
  return Eigen::Map<const Eigen::VectorXd>(displacements.delta_a.data(), robot_->constraints.actuators());
}

}  // namespace tendril::app
