// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "app/config/config.h"
#include "fem/body/constraints.h"
#include "fem/body/model.h"
#include "hal/drive/frame_layout.h"
#include "rt/controller.h"

namespace tendril::app {

/// A body with its actuators and effectors, built from a configuration. Stays where it was built: its
/// constraints refer to its model.
struct Robot {
  /// @param effectors  at least one, the first of points; attached, like the actuators, to the body
  Robot(fem::Model body, const std::vector<fem::Actuator>& actuators,
        const std::vector<fem::Effector>& effectors);
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  /// Position of an effector of points, m.
  Eigen::Vector3d position(const Eigen::VectorXd& x, int effector) const;
  /// Position of the first effector, the one that trace and report are about, m.
  Eigen::Vector3d tip(const Eigen::VectorXd& x) const { return position(x, 0); }

  fem::Model model;
  std::vector<std::vector<fem::Attachment>> effector_points;  ///< one an effector; empty where it is a cavity
  fem::Constraints constraints;
};

/// The body as the controller takes it to be.
/// @throws ConfigError where mesh, regions or points do not fit together; it names the line
/// Real-time: no.
std::unique_ptr<Robot> build_model(const Config& config);

/// The body as the simulated robot has it: the same shape, of materials, a mass and loads of its own.
/// @throws ConfigError as build_model(), and where the file has no section `plant`
std::unique_ptr<Robot> build_plant(const Config& config);

/// Iterations of the QP that suffice nearly always, even where limits conflict, see qp::Solver::solve.
constexpr int useful_iterations(int actuators) { return 16 * actuators; }

/// Limits and rates of the control law; where the file has no iteration cap, useful_iterations(), whatever
/// the machine. Real-time: no.
rt::ControllerConfig controller_config(const Config& config);

/// What people read the displacements of an actuator in. Real-time: no.
hal::DisplacementUnit displacement_unit(const ActuatorConfig& actuator);

/// Controlled coordinates of all effectors, in the order of the rows of W_ea.
struct EffectorRow {
  int effector;
  int axis;       ///< 0 x, 1 y, 2 z; kVolume: the volume of a cavity
  double weight;  ///< of its error, 1 or 1/m²

  static constexpr int kVolume = 3;
  bool is_position() const { return axis != kVolume; }
};
std::vector<EffectorRow> effector_rows(const Config& config);

/// Axes of the first effector's controlled coordinates, in the order of their rows: 0 x, 1 y, 2 z.
std::vector<int> tip_axes(const Config& config);

/// Controlled coordinates that a sensor measures, in metres, where the robot file asks for feedback.
/// Real-time: no.
std::vector<rt::MeasuredCoordinate> measured_coordinates(const Config& config);

}  // namespace tendril::app
