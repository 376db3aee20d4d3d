// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <any>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "app/config/config_error.h"
#include "app/config/plant_fault.h"
#include "fem/body/equilibrium.h"
#include "fem/element/material.h"
#include "fem/mesh/mesh.h"
#include "hal/drive/master_config.h"
#include "rt/controller.h"

namespace tendril::app {

using rt::kMaxActuators;
using rt::kMaxEffectorCoordinates;

/// How the nodes of the mesh file become positions in the robot's frame: scaled, then turned, then moved.
struct MeshConfig {
  std::filesystem::path file;  // absolute, or relative to the working directory; found beside the YAML
  double unit = 1e-3;          // m per length unit of the file
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  // m
  int line = 0;                                           // of `file`
};

/// A part of the mesh: one that the mesh itself names, or what lies in a part of space.
struct RegionConfig {
  std::variant<std::string, fem::Space> where;
  int line = 0;
};

/// A part of the body made of something else.
struct MaterialRegionConfig {
  RegionConfig where;          // of tetrahedra
  fem::Material material{};    // Pa
  std::optional<double> mass;  // kg, of the part
};

/// What the model takes the body to be made of.
struct MaterialConfig {
  fem::Material material{};
  double mass = 0;                            // kg, of the whole body
  bool mass_per_node = false;                 // equal shares for all nodes instead of shares by volume
  std::vector<MaterialRegionConfig> regions;  // later ones win where they overlap
};

/// A point in the robot's frame that belongs to the body or stands still in space.
struct PointConfig {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  // m
  bool on_body = true;
  int line = 0;
};

/// A force of constant size and direction on a point of the body.
struct LoadConfig {
  PointConfig at;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  // N
};

/// What is controlled: the mean of points of the body, in some or all coordinates, or the volume of a cavity.
struct EffectorConfig {
  std::string name;
  std::vector<PointConfig> points;                      // none where it is a cavity
  std::array<bool, 3> controlled = {true, true, true};  // x, y, z of the points
  std::optional<RegionConfig> cavity;
  std::vector<double>
      weights;  // one a coordinate, 1 or 1/m²: an error is multiplied by it before it is squared

  int coordinates() const;  // that are controlled
};

/// A cable that pulls: its effort is the tension, its displacement the shortening.
struct CableConfig {
  std::vector<PointConfig> points;  // two or more: from the attachment to the last guide before the winch
};

/// A rod that pushes or pulls: its effort is positive where it pushes, its displacement is the lengthening.
struct RodConfig {
  PointConfig from, to;
};

/// A force on a point along a direction fixed in space; its displacement is the point's travel along it.
struct ForceConfig {
  PointConfig at;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  // of length one
};

/// A cavity that is filled by a pump: its effort is the pressure, its displacement the growth of its volume.
struct CavityConfig {
  RegionConfig region;  // of nodes: those of its wall
  int growth_line = 0;  // of the limits of its growth
};

/// What moves the body, and its drive. The unit of effort is Pa and that of displacement m³ for a cavity;
/// they are N and m for all others.
struct ActuatorConfig {
  std::string name;
  std::variant<CableConfig, RodConfig, ForceConfig, CavityConfig> kind;
  double effort_min = 0, effort_max = 0;
  double displacement_min = 0, displacement_max = 0;  // from rest
  double top_rate = 0;                                // per second
  hal::AxisConfig drive;                              // without name and limits, see master_config()

  bool is_cavity() const { return std::holds_alternative<CavityConfig>(kind); }
  bool follows_effort() const { return drive.set_point == hal::SetPoint::kEffort; }
};

/// What a run does once a fault has stopped the robot and its drives are disabled.
enum class OnFault {
  kWaitWhereReachable,  ///< waits where an operator can connect, else ends
  kWait,                ///< for an operator's reset
  kExit,
};

/// The two loops: how fast, how long old data serves, and where the effectors may go.
struct ControlConfig {
  double rate_hz = 600;              // of the control thread
  double epsilon = 0;                // of the energy term of the QP, unitless; 0: energy breaks ties alone
  std::optional<int> iteration_cap;  // of the QP; none: what the cycle has time for, see qp_budget.h
  int priority = 80;                 // SCHED_FIFO, 1..98: 99 is the kernel's own
  int cpu = -1;                      // the control thread's; -1: any
  int model_cpu = -1;                // the model thread's
  int housekeeping_cpu = -1;         // the main thread's
  double idle_latency = 0;           // s: a CPU may take so long to wake from idle
  double snapshot_age_limit = 0.5;   // s
  double target_age_limit = 0.5;     // s
  int late_cycles_limit = 20;        // in a row
  double model_rate_limit_hz = 0;    // 0: as fast as it can
  fem::LinearSolverKind model_solver = fem::LinearSolverKind::kDirect;
  fem::Tangent model_tangent = fem::Tangent::kExact;  // of refreshes, not of settling
  bool feedback = false;                              // positions that sensors measure correct the model's
  double feedback_time = 0.08;                        // s, time constant of the correction
  double feedback_limit = 0.03;                       // m; a larger one is taken for a sensor's mistake
  rt::StopAction stop = rt::StopAction::kHold;
  OnFault on_fault = OnFault::kWaitWhereReachable;
  Eigen::Vector3d workspace_min = Eigen::Vector3d::Constant(-1);  // m
  Eigen::Vector3d workspace_max = Eigen::Vector3d::Constant(1);   // m
};

/// The CAN bus to the drives.
struct BusConfig {
  std::string name;          // a CAN interface, or local:PATH
  double bitrate = 1e6;      // bit/s
  hal::MasterConfig master;  // protocol and time-outs; without axes, period and sensors, see master_config()
  int line = 0;
};

/// What a signal of a sensor measures: a coordinate of an effector, or the effort of an actuator.
struct MeasuredConfig {
  int effector = -1;  // its place in the list of effectors, one of points; -1: an effort is measured
  int axis = 0;       // 0 x, 1 y, 2 z of the effector
  int actuator = -1;  // its place in the list of actuators

  bool operator==(const MeasuredConfig&) const = default;
};

/// A device on the bus that measures, and the frame in which it tells.
struct SensorConfig {
  hal::SensorConfig frame;
  std::vector<MeasuredConfig> measures;  // one a signal of the frame
};

/// A closed curve x(φ) = amplitude · sin(frequency φ + phase) in each coordinate, 0 ≤ φ ≤ 2π.
struct CurveConfig {
  Eigen::Vector3d amplitude = Eigen::Vector3d::Zero();  // m
  Eigen::Vector3d frequency = Eigen::Vector3d::Zero();  // whole numbers
  Eigen::Vector3d phase = Eigen::Vector3d::Zero();      // rad
};

/// Points of a curve that stand for its waypoints, evenly in φ: where --check looks.
inline constexpr int kWaypointsOfCurve = 12;

/// The path of an effector: waypoints, visited straight and at constant speed or within limits, or a curve.
struct MotionConfig {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // m
  std::vector<Eigen::Vector3d> waypoints;            // m, from the origin
  double speed = 0;                                  // m/s
  bool closed = true;
  int effector = 0;  // its place in the list of effectors; one of points
  std::optional<double> acceleration = {},
                        jerk = {};        // limits, m/s², m/s³; none: constant speed with sharp corners
  double corners = 0;                     // m, how far a path within limits stays from its waypoints
  std::optional<int> turns = {};          // of a closed path or a curve; none: for ever
  std::optional<CurveConfig> curve = {};  // the path; the waypoints are then points of it
};

/// The servo drives of the simulated robot, one setting for all: what is relative is so to the limits of each
/// actuator.
struct ServoConfig {
  std::optional<double> acceleration_time;  // s to top speed, without load; none: hal::ServoTuning's
  std::optional<double> position_gain;      // 1/s; none: as drives of the protocol are delivered
  double force_limit = 2;                   // largest efforts of the actuator
  std::optional<double> friction;  // of the force limit, at top speed, with efforts; none: hal::ServoTuning's
  bool left_enabled = false;       // at power-on, as another controller left them
  std::any protocol_settings;      // settings of the protocol, see hal::DriveProtocol::read_simulation
};

/// What the simulated robot is made of, apart from the shape: never the controller's own values. The laws of
/// its materials are the model's, the moduli and masses of their regions are in the proportion of the
/// whole's.
struct PlantConfig {
  double young_modulus = 0, poisson_ratio = 0, mass = 0;  // Pa, 1, kg
  double damping_mass = 0;                                // 1/s, Rayleigh: times M
  double damping_stiffness = 0;                           // s, Rayleigh: times K
  double time_step = 0.01;                                // s of the integrator
  std::vector<LoadConfig> loads;  // that the model knows nothing of, beside those that it knows
  ServoConfig drives;
  std::vector<PlantFault> faults;
};

/// Everything one YAML file says of a robot, in SI units.
struct Config {
  std::filesystem::path file;
  std::string robot;
  MeshConfig mesh;
  MaterialConfig material;
  Eigen::Vector3d gravity{0, 0, -9.81};  // m/s²
  std::vector<LoadConfig> loads;
  RegionConfig fixed;  // of nodes
  double snap = 0;     // m: how far outside the mesh a body point may lie and still be attached
  std::vector<EffectorConfig> effectors;
  std::vector<ActuatorConfig> actuators;
  ControlConfig control;
  BusConfig bus;
  std::vector<SensorConfig> sensors;
  std::optional<MotionConfig> motion;
  std::optional<PlantConfig> plant;
};

}  // namespace tendril::app
