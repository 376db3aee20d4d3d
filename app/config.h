#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "rt/controller.h"

namespace tendril::app {

using rt::kMaxActuators;
using rt::kMaxEffectorCoordinates;
static_assert(hal::kMaxAxes >= kMaxActuators);

/// A mistake in a configuration file; what() reads "FILE:LINE: KEY: found ..., expected ...".
struct ConfigError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// How the nodes of the mesh file become positions in the robot's frame: scaled, then turned, then moved.
struct MeshConfig {
  std::filesystem::path file;  // absolute, or relative to the working directory; found beside the YAML
  double unit = 1e-3;          // m per length unit of the file
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  // m
};

/// What the model takes the body to be made of.
struct MaterialConfig {
  double young_modulus = 0;  // Pa
  double poisson_ratio = 0;
  double mass = 0;             // kg, of the whole body
  bool mass_per_node = false;  // equal shares for all nodes instead of shares by volume
};

/// Nodes that do not move: those of a named region of the mesh, or those inside a box.
struct FixedConfig {
  std::string region;  // empty where the box is used
  Eigen::Vector3d box_min = Eigen::Vector3d::Zero(), box_max = Eigen::Vector3d::Zero();  // m
  int line = 0;
};

/// A point in the robot's frame that belongs to the body or stands still in space.
struct PointConfig {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  // m
  bool on_body = true;
  int line = 0;
};

/// A point of the body whose position is controlled, in some or all coordinates.
struct EffectorConfig {
  std::string name;
  PointConfig point;
  std::array<bool, 3> controlled = {true, true, true};  // x, y, z
};

/// One axis of the bus: how metres of cable become counts of the drive's encoder.
struct DriveConfig {
  int node = 0;                // CANopen node id, 1..127, no other drive's and not the master's
  double counts_per_turn = 0;  // encoder counts in one turn of the pulley
  double pulley_radius = 0;    // m
  bool reversed = false;       // true where a positive count lets the cable out
  int line = 0;
};

/// A cable that pulls the body, and the winch that pulls the cable.
struct CableConfig {
  std::string name;
  std::vector<PointConfig> points;  // two or more: from the attachment to the last guide before the winch
  double tension_min = 0, tension_max = 0;  // N, 0 ≤ min ≤ max: a cable cannot push
  double stroke_min = 0, stroke_max = 0;    // m of shortening from the rest length, min ≤ max
  double top_speed = 0;                     // m/s
  DriveConfig drive;
};

/// The two loops: how fast, how long old data serves, and where the effectors may go.
struct ControlConfig {
  double rate_hz = 600;             // of the control thread
  double epsilon = 1e-3;            // weight of the energy term of the QP, unitless
  int iteration_cap = 100;          // of the QP
  int priority = 80;                // SCHED_FIFO, 1..98: 99 is the kernel's own
  int cpu = -1;                     // the control thread's; -1: any
  double snapshot_age_limit = 0.5;  // s
  double target_age_limit = 0.5;    // s
  int late_cycles_limit = 20;       // in a row
  double model_rate_limit_hz = 0;   // 0: as fast as it can
  rt::StopAction stop = rt::StopAction::kHold;
  Eigen::Vector3d workspace_min = Eigen::Vector3d::Constant(-1);  // m
  Eigen::Vector3d workspace_max = Eigen::Vector3d::Constant(1);   // m
};

/// The CAN bus to the drives.
struct BusConfig {
  std::string name;                 // a CAN interface, or local:PATH
  double bitrate = 1e6;             // bit/s
  int master_node = 127;            // CANopen node id of this controller
  double heartbeat = 0.05;          // s between heartbeats, both ways
  double heartbeat_timeout = 0.15;  // s
  int tracker_id = 0;               // identifier of the frames of the effector's tracker; 0: there is none
  int line = 0;
};

/// The path of the effector: waypoints visited at constant speed.
struct MotionConfig {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // m
  std::vector<Eigen::Vector3d> waypoints;            // m, from the origin
  double speed = 0;                                  // m/s
  bool closed = true;
};

/// What the simulated robot is made of, apart from the shape: never the controller's own values.
struct PlantConfig {
  double young_modulus = 0, poisson_ratio = 0, mass = 0;  // Pa, 1, kg
  double damping_mass = 0;                                // 1/s, Rayleigh: times M
  double damping_stiffness = 0;                           // s, Rayleigh: times K
  double time_step = 0.01;                                // s of the integrator
  double tracker_rate_hz = 100;
};

/// Everything one YAML file says of a robot, in SI units.
struct Config {
  std::filesystem::path file;
  std::string robot;
  MeshConfig mesh;
  MaterialConfig material;
  Eigen::Vector3d gravity{0, 0, -9.81};  // m/s²
  FixedConfig fixed;
  double snap = 0;  // m: how far outside the mesh a body point may lie and still be attached
  std::vector<EffectorConfig> effectors;
  std::vector<CableConfig> cables;
  ControlConfig control;
  BusConfig bus;
  std::optional<MotionConfig> motion;
  std::optional<PlantConfig> plant;
};

/// The keys a robot file may have, such as "actuators[].drive.node", and for each whether it is required.
using ConfigKeys = std::map<std::string, bool>;

/// Reads and checks one robot file: syntax, keys, units, ranges, and what one key demands of another.
/// docs/robot-file.md describes the file.
/// @param keys  where given, receives the keys that were looked for: all but those of sections that the file
/// leaves out
/// @throws      ConfigError naming file, line and key, what was found and what is expected
/// Real-time: no (reads a file, allocates).
Config load_config(const std::filesystem::path& file, ConfigKeys* keys = nullptr);

}  // namespace tendril::app
