// SPDX-License-Identifier: Apache-2.0
#include "app/plant/plant.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/config/master_config.h"
#include "fem/body/equilibrium.h"
#include "hal/drive/drive_protocol.h"
#include "hal/sim/simulated_actuator.h"

namespace tendril::app {
namespace {

constexpr double kPlantRestAccuracy = 1e-9;  // m
// A drive that keeps up with its actuator's top rate has some in hand to catch up with.
constexpr double kSpareSpeed = 1.25;
constexpr double kUnlimited = hal::SimulatedActuator::kUnlimited;
constexpr int kFramesPerCall = 1024;
constexpr double kOutOfReach_m = -10;  // of a cable that is cut; more than a soft robot measures

hal::SimulatedActuator simulated(const ActuatorConfig& actuator, const ServoConfig& servo,
                                 double displacement) {
  const double largest_effort = std::max(std::abs(actuator.effort_min), std::abs(actuator.effort_max));
  return {.top_rate = kSpareSpeed * actuator.top_rate,
          .displacement = displacement,
          .displacement_range = actuator.displacement_max - actuator.displacement_min,
          .force_limit = largest_effort > 0 ? servo.force_limit * largest_effort : kUnlimited,
          .acceleration_time = servo.acceleration_time.value_or(hal::ServoTuning{}.acceleration_time),
          .friction = servo.friction.value_or(hal::ServoTuning{}.friction),
          .left_enabled = servo.left_enabled,
          .position_gain = servo.position_gain,
          .protocol_settings = servo.protocol_settings};
}

}  // namespace

PlantDrives::PlantDrives(const Config& config, const PlantDisplacements& start)
    : sensors_(config.sensors), planned_(config.plant->faults) {
  std::ranges::stable_sort(planned_, {}, &PlantFault::after);
  const hal::MasterConfig master = master_config(config);
  for (size_t a = 0; a < config.actuators.size(); ++a) {
    drives_.push_back(master.protocol->make_simulated_drive(
        master, static_cast<int>(a), simulated(config.actuators[a], config.plant->drives, start.delta_a[a])));
  }
}

void PlantDrives::serve(hal::Bus& bus, const PlantMeasurement& measurement, int64_t now_ns) noexcept {
  inject_due(now_ns);
  line_.release(bus, now_ns);
  hal::Frame frame;
  for (int k = 0; k < kFramesPerCall && bus.receive(frame); ++k) {
    if (!line_.hears()) continue;
    answers_.clear();
    for (auto& drive : drives_) drive->receive(frame, now_ns, answers_);
    line_.send(bus, answers_, now_ns);
  }
  answers_.clear();
  for (auto& drive : drives_) drive->advance(now_ns, answers_);
  line_.send(bus, answers_, now_ns);
  send_samples(bus, measurement, now_ns);
}

void PlantDrives::set_loads(const PlantEfforts& efforts) noexcept {
  for (size_t a = 0; a < drives_.size(); ++a) drives_[a]->set_load(efforts.lambda_a[a]);
}

void PlantDrives::inject_due(int64_t now_ns) noexcept {
  if (start_ns_ < 0) start_ns_ = now_ns;
  const double elapsed_s = 1e-9 * static_cast<double>(now_ns - start_ns_);
  for (; injected_ < planned_.size() && planned_[injected_].after <= elapsed_s; ++injected_)
    inject(planned_[injected_]);
}

void PlantDrives::inject(const PlantFault& fault) noexcept {
  switch (fault.kind) {
    case PlantFaultKind::kDriveFault:
      return drives_[fault.axis]->inject_fault(static_cast<uint32_t>(fault.value));
    case PlantFaultKind::kSilent:
      return drives_[fault.axis]->set_silent(true);
    case PlantFaultKind::kStuck:
      return drives_[fault.axis]->set_jammed(true);
    case PlantFaultKind::kCut:
      cut_[fault.axis] = true;
      return;
    case PlantFaultKind::kDelay:
      return line_.set_delay(std::llround(1e9 * fault.value));
    case PlantFaultKind::kDrop:
      return line_.set_loss(fault.value);
    case PlantFaultKind::kNoise:
      noise_.position = fault.value;
      return;
    case PlantFaultKind::kForceNoise:
      noise_.force = fault.value;
      return;
    case PlantFaultKind::kPressureNoise:
      noise_.pressure = fault.value;
      return;
    case PlantFaultKind::kSensorSilent:
      sensor_silent_[fault.axis] = true;
      return;
    case PlantFaultKind::kBusOff:
      return line_.set_off(true);
    case PlantFaultKind::kClear:
      return clear();
  }
}

void PlantDrives::clear() noexcept {
  for (auto& drive : drives_) {
    drive->set_silent(false);
    drive->set_jammed(false);
  }
  line_.set_delay(0);
  line_.set_loss(0);
  line_.set_off(false);
  noise_ = {};
  sensor_silent_ = {};
}

void PlantDrives::send_samples(hal::Bus& bus, const PlantMeasurement& measurement, int64_t now_ns) noexcept {
  if (measurement.stamp_ns == 0) return;
  std::span<const double> left = measurement.measured;
  for (size_t s = 0; s < sensors_.size(); ++s) {
    const std::vector<MeasuredConfig>& measures = sensors_[s].measures;
    std::array<double, hal::kMaxSensorSignals> values;
    std::copy_n(left.begin(), measures.size(), values.begin());
    left = left.subspan(measures.size());
    // Who tells an age has a picture to show, others tell at any time what they feel.
    const int64_t sent_ns = sensors_[s].frame.age ? measurement.stamp_ns : now_ns;
    if (sent_ns < sent_ns_[s] + std::llround(1e9 / sensors_[s].frame.rate_hz)) continue;
    sent_ns_[s] = sent_ns;
    if (sensor_silent_[s]) continue;
    for (size_t k = 0; k < measures.size(); ++k) {
      const std::string& unit = sensors_[s].frame.signals[k].unit;
      const double noise = unit == "m" ? noise_.position : unit == "N" ? noise_.force : noise_.pressure;
      if (noise > 0) values[k] += std::normal_distribution<double>(0, noise)(random_);
    }
    const auto frame = hal::encode_sample(sensors_[s].frame, values, now_ns - measurement.stamp_ns);
    if (frame) line_.send(bus, {&*frame, 1}, now_ns);
  }
}

PlantDisplacements PlantDrives::displacements() const noexcept {
  PlantDisplacements displacements;
  for (size_t a = 0; a < drives_.size(); ++a) displacements.delta_a[a] = drives_[a]->displacement();
  return displacements;
}

PlantDisplacements PlantDrives::body_displacements() const noexcept {
  PlantDisplacements felt = displacements();
  for (size_t a = 0; a < drives_.size(); ++a)
    if (cut_[a]) felt.delta_a[a] = kOutOfReach_m;
  return felt;
}

Config with_drives_only(Config config) {
  config.plant = PlantConfig{};
  for (SensorConfig& sensor : config.sensors) sensor.frame.required = false;
  return config;
}

PlantBody::PlantBody(const Config& config, const PlantDisplacements& start)
    : robot_(build_plant(config)),
      readings_(readings(config)),
      dynamics_(robot_->model, robot_->constraints,
                fem::Damping{config.plant->damping_mass, config.plant->damping_stiffness}),
      time_step_ns_(std::llround(1e9 * config.plant->time_step)) {
  fem::Equilibrium rest(robot_->model, robot_->constraints);
  const fem::EquilibriumResult settled =
      rest.settle_at_displacements(vector(start), fem::EffortSign::kPullOnly, kPlantRestAccuracy);
  if (!settled.converged)
    throw ConfigError(
        fmt::format("{}: plant: the simulated robot finds no rest with its drives as they stand; "
                    "is it too soft for its weight?",
                    config.file.string()));
  dynamics_.reset(rest.x());
}

PlantMeasurement PlantBody::measurement(int64_t now_ns) const {
  PlantMeasurement measurement{.tip = tip(), .stamp_ns = now_ns};
  for (const auto& [sensor, signal, measures] : readings_)
    measurement.measured[signal] = measures.effector >= 0
                                       ? robot_->position(dynamics_.x(), measures.effector)[measures.axis]
                                       : dynamics_.efforts()[measures.actuator];
  return measurement;
}

PlantEfforts PlantBody::efforts() const {
  PlantEfforts efforts;
  std::ranges::copy(dynamics_.efforts(), efforts.lambda_a.begin());
  return efforts;
}

Eigen::VectorXd PlantBody::vector(const PlantDisplacements& displacements) const {
  return Eigen::Map<const Eigen::VectorXd>(displacements.delta_a.data(), robot_->constraints.actuators());
}

}  // namespace tendril::app
