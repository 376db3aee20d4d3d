// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "app/config/plant_fault.h"
#include "app/config/readings.h"
#include "app/plant/plant_line.h"
#include "app/robot/robot.h"
#include "fem/body/dynamics.h"
#include "hal/bus/bus.h"
#include "hal/sim/simulated_drive.h"

namespace tendril::app {

/// Where the drives of the simulated robot stand: displacements of its actuators, m or m³.
struct PlantDisplacements {
  std::array<double, kMaxActuators> delta_a{};
};

/// What the actuators of the simulated robot do to its body: tensions and forces in N, pressures in Pa.
struct PlantEfforts {
  std::array<double, kMaxActuators> lambda_a{};
};

/// The state of the simulated robot at an instant, as far as sensors can measure it.
struct PlantMeasurement {
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();          ///< position of the first effector, m
  std::array<double, hal::kMaxSensorSignals> measured{};  ///< one a signal, as in hal::SensorReadings
  int64_t stamp_ns = 0;                                   ///< 0: not known yet
};

/// The electrical half of the simulated robot: one drive an actuator, and the sensors, on a bus.
class PlantDrives {
 public:
  /// @param start  where the drives stand at power-on
  explicit PlantDrives(const Config& config, const PlantDisplacements& start = {});

  /// Answers all that has arrived, lets time pass, and lets each sensor send at its rate.
  /// Real-time: bounded by the frames that have arrived; allocates nothing.
  void serve(hal::Bus& bus, const PlantMeasurement& measurement, int64_t now_ns) noexcept;

  /// Lets the body pull at the drives from now on. Real-time: bounded, allocates nothing.
  void set_loads(const PlantEfforts& efforts) noexcept;

  /// Makes the robot suffer a fault from now on. Real-time: bounded, allocates nothing.
  void inject(const PlantFault& fault) noexcept;

  /// Where the drives stand now.
  PlantDisplacements displacements() const noexcept;

  /// Those that act on the body: the cable of a `cut` fault is so long that it is slack.
  PlantDisplacements body_displacements() const noexcept;

  hal::SimulatedDrive& drive(int axis) { return *drives_[axis]; }

 private:
  void inject_due(int64_t now_ns) noexcept;
  void clear() noexcept;
  void send_samples(hal::Bus& bus, const PlantMeasurement& measurement, int64_t now_ns) noexcept;

  std::vector<std::unique_ptr<hal::SimulatedDrive>> drives_;
  std::vector<SensorConfig> sensors_;
  std::array<int64_t, hal::kMaxSensors> sent_ns_{};  // stamp of the last sample of each sensor
  std::vector<PlantFault> planned_;                  // the next one first
  std::size_t injected_ = 0;                         // of those planned
  int64_t start_ns_ = -1;                            // of the first call of serve; -1: none yet
  PlantLine line_;
  std::array<bool, kMaxActuators> cut_{};
  std::array<bool, hal::kMaxSensors> sensor_silent_{};
  struct Noise {
    double position = 0, force = 0, pressure = 0;  // standard deviations, m, N, Pa
  } noise_;
  std::minstd_rand random_;  // of the noise; always the same seed
  hal::FrameBatch answers_;
};

/// The configuration for a simulation of the drives alone, without a body: no planned faults, no sensor is
/// required. Real-time: no (allocates).
Config with_drives_only(Config config);

/// The mechanical half of the simulated robot: the body in motion, its actuators at the drives'
/// displacements.
class PlantBody {
 public:
  /// Builds the body and lets it come to rest with its actuators at the given displacements.
  /// @throws ConfigError, also where it finds no rest
  explicit PlantBody(const Config& config, const PlantDisplacements& start = {});

  /// Lets time pass in one step, at whose end the actuators are at the given displacements.
  /// @param seconds  usually time_step_ns(), longer where real time demands it
  /// @return  false where the body could not be advanced
  [[nodiscard]] bool step(const PlantDisplacements& displacements, double seconds) {
    return dynamics_.step(vector(displacements), seconds);
  }

  /// Of the last step; 0 before the first.
  PlantEfforts efforts() const;

  Eigen::Vector3d tip() const { return robot_->tip(dynamics_.x()); }
  /// What there is to be measured. Efforts are those of the last step, 0 before the first.
  PlantMeasurement measurement(int64_t now_ns) const;
  const Robot& robot() const { return *robot_; }
  int64_t time_step_ns() const { return time_step_ns_; }

 private:
  Eigen::VectorXd vector(const PlantDisplacements& displacements) const;

  std::unique_ptr<Robot> robot_;
  std::vector<Reading> readings_;
  fem::Dynamics dynamics_;
  int64_t time_step_ns_;
};

}  // namespace tendril::app
