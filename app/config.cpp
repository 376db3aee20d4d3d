#include "app/config.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <system_error>

#include "app/config_rules.h"
#include "app/yaml_reader.h"

// One function a section, one line a key. A key that is added here is added to docs/robot-file.md as well: a
// test compares the two.
namespace tendril::app {
namespace {

constexpr double kFastestRate = 20e3;  // Hz; no CAN bus carries a cycle in less than 50 us
constexpr Range kPositive = {.above = 0};
constexpr Range kNotNegative = {.at_least = 0};
constexpr Range kPoissonRatio = {.at_least = 0, .below = 0.5};
constexpr Range kLoopRate = {.above = 0, .at_most = kFastestRate};
constexpr Range kNodeId = {.at_least = 1, .at_most = 127};           // CiA 301
constexpr Range kHeartbeat = {.at_least = 1e-3, .at_most = 65.535};  // u16 in ms, CiA 301 objects 1016, 1017
constexpr std::size_t kLongestInterface = 15;                        // IFNAMSIZ less the final 0
constexpr std::size_t kLongestSocketPath = 107;                      // sun_path likewise

/// Names become columns of tables and labels of metrics.
void read_name(const Value& v, std::string& name) {
  constexpr std::string_view kAllowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
  name = v.text("a name");
  if (name.find_first_not_of(kAllowed) != std::string::npos) {
    v.fail("a name of letters, digits, _ and - only");
  }
}

void read_mesh_file(const Value& v, std::filesystem::path& file) {
  file = v.folder() / v.text("the path of a mesh file");
  std::error_code absent;
  if (!std::filesystem::is_regular_file(file, absent)) {
    v.fail("a mesh file, but there is no " + file.string());
  }
}

void read_length_unit(const Value& v, double& metres) {
  const std::string expected = "a unit of length (" + units_of(Dimension::kLength) + ")";
  if (!parse_quantity("1 " + v.text(expected), Dimension::kLength, {&metres, 1})) v.fail(expected);
}

/// "90 deg about x": a turn about an axis of the robot's frame, by the right hand.
void read_turn(const Value& v, Eigen::Matrix3d& R) {
  constexpr std::string_view kAbout = " about ";
  constexpr std::string_view kAxes = "xyz";
  const std::string expected =
      "an angle (" + units_of(Dimension::kAngle) + ") about x, y or z, as in '90 deg about x'";
  const std::string text = v.text(expected);
  const std::size_t about = text.find(kAbout);
  const std::string axis = about == std::string::npos ? "" : text.substr(about + kAbout.size());
  double angle = 0;
  if (axis.size() != 1 || kAxes.find(axis) == std::string::npos ||
      !parse_quantity(text.substr(0, about), Dimension::kAngle, {&angle, 1})) {
    v.fail(expected);
  }
  R = Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(Eigen::Index(kAxes.find(axis)))).toRotationMatrix();
}

void read_mesh(Reader& r, MeshConfig& mesh) {
  r.need("file", mesh.file, read_mesh_file);
  r.may("unit", mesh.unit, read_length_unit);
  r.may("rotate", mesh.rotation, read_turn);
  r.may("translate", mesh.translation, Dimension::kLength);
}

void read_material(Reader& r, MaterialConfig& material) {
  r.need("young_modulus", material.young_modulus, Dimension::kPressure, kPositive);
  r.need("poisson_ratio", material.poisson_ratio, Dimension::kNumber, kPoissonRatio);
  r.need("mass", material.mass, Dimension::kMass, kPositive);
  r.may("mass_distribution", material.mass_per_node, Words<bool>{{"volume", false}, {"nodes", true}});
}

void read_fixed_box(Reader& r, FixedConfig& fixed) {
  r.need("box", fixed.box_min, fixed.box_max, Dimension::kLength);
}

void read_fixed(const Value& v, FixedConfig& fixed) {
  fixed.line = v.line();
  if (v.is_mapping()) {
    v.read(fixed, read_fixed_box);
  } else {
    fixed.region = v.text("the name of a region of the mesh, or a mapping with a box");
  }
}

void read_body_point(const Value& v, PointConfig& point) {
  point.line = v.line();
  v.read(point.at, Dimension::kLength);
}

/// "body 0 97 45 mm" or "guide 0 10 30 mm".
void read_cable_point(const Value& v, PointConfig& point) {
  const std::string expected = "body or guide, then " + describe_quantity(3, Dimension::kLength);
  const std::string text = v.text(expected);
  const std::size_t blank = std::min(text.find(' '), text.size());
  const std::string kind = text.substr(0, blank);
  point.line = v.line();
  point.on_body = kind == "body";
  if ((kind != "body" && kind != "guide") ||
      !parse_quantity(text.substr(blank), Dimension::kLength, {point.at.data(), 3})) {
    v.fail(expected);
  }
}

/// Some of the letters x, y and z, each at most once.
void read_coordinates(const Value& v, std::array<bool, 3>& controlled) {
  constexpr std::string_view kExpected = "the controlled coordinates, as in xyz, xy or z";
  controlled = {};
  for (const char letter : v.text(kExpected)) {
    const std::size_t axis = std::string_view("xyz").find(letter);
    if (axis == std::string_view::npos || controlled[axis]) v.fail(kExpected);
    controlled[axis] = true;
  }
}

void read_effector(Reader& r, EffectorConfig& effector) {
  r.need("name", effector.name, read_name);
  r.need("point", effector.point, read_body_point);
  r.may("coordinates", effector.controlled, read_coordinates);
}

void read_drive(Reader& r, DriveConfig& drive) {
  drive.line = r.line();
  r.need("node", drive.node, kNodeId);
  r.need("counts_per_turn", drive.counts_per_turn, Dimension::kNumber, kPositive);
  r.need("pulley_radius", drive.pulley_radius, Dimension::kLength, kPositive);
  r.may("reversed", drive.reversed);
}

void read_cable(Reader& r, CableConfig& cable) {
  r.need("name", cable.name, read_name);
  r.need("cable", cable.points, read_cable_point);
  r.need("tension", cable.tension_min, cable.tension_max, Dimension::kForce, kNotNegative);
  r.need("stroke", cable.stroke_min, cable.stroke_max, Dimension::kLength);
  r.need("top_speed", cable.top_speed, Dimension::kSpeed, kPositive);
  r.need("drive", cable.drive, read_drive);
}

void read_control(Reader& r, ControlConfig& control) {
  r.may("rate", control.rate_hz, Dimension::kRate, kLoopRate);
  r.may("epsilon", control.epsilon, Dimension::kNumber, kNotNegative);
  r.may("iteration_cap", control.iteration_cap, Range{.at_least = 1});
  r.may("priority", control.priority, Range{.at_least = 1, .at_most = 98});
  r.may("cpu", control.cpu, Range{.at_least = -1, .at_most = 1023});
  r.may("snapshot_age_limit", control.snapshot_age_limit, Dimension::kTime, kPositive);
  r.may("target_age_limit", control.target_age_limit, Dimension::kTime, kPositive);
  r.may("late_cycles_limit", control.late_cycles_limit, Range{.at_least = 1});
  r.may("model_rate_limit", control.model_rate_limit_hz, Dimension::kRate,
        Range{.at_least = 0, .at_most = kFastestRate});
  r.may("stop", control.stop,
        Words<rt::StopAction>{{"hold", rt::StopAction::kHold}, {"relax", rt::StopAction::kRelax}});
  r.may("workspace", control.workspace_min, control.workspace_max, Dimension::kLength);
}

void read_bus_name(const Value& v, std::string& name) {
  constexpr std::string_view kLocal = "local:";
  constexpr std::string_view kExpected =
      "a CAN interface (at most 15 letters), or local: and the path of a socket (at most 107)";
  name = v.text(kExpected);
  const bool local = name.starts_with(kLocal);
  const std::size_t length = name.size() - (local ? kLocal.size() : 0);
  const bool fits = length >= 1 && length <= (local ? kLongestSocketPath : kLongestInterface);
  if (!fits || (!local && name.find_first_of("/: ") != std::string::npos)) {
    v.fail(kExpected);
  }
}

void read_bus(Reader& r, BusConfig& bus) {
  bus.line = r.line();
  r.need("name", bus.name, read_bus_name);
  r.may("bitrate", bus.bitrate, Dimension::kBitRate, Range{.above = 0, .at_most = 1e6});  // classic CAN
  r.may("master_node", bus.master_node, kNodeId);
  r.may("heartbeat", bus.heartbeat, Dimension::kTime, kHeartbeat);
  r.may("heartbeat_timeout", bus.heartbeat_timeout, Dimension::kTime, kHeartbeat);
  r.may("tracker", bus.tracker_id, Range{.at_least = 0, .at_most = 0x7FF});
}

void read_motion(Reader& r, MotionConfig& motion) {
  r.need("origin", motion.origin, Dimension::kLength);
  r.need("waypoints", motion.waypoints, Dimension::kLength);
  r.need("speed", motion.speed, Dimension::kSpeed, kPositive);
  r.may("closed", motion.closed);
}

void read_plant(Reader& r, PlantConfig& plant) {
  r.need("young_modulus", plant.young_modulus, Dimension::kPressure, kPositive);
  r.need("poisson_ratio", plant.poisson_ratio, Dimension::kNumber, kPoissonRatio);
  r.need("mass", plant.mass, Dimension::kMass, kPositive);
  r.may("damping_mass", plant.damping_mass, Dimension::kInverseTime, kNotNegative);
  r.may("damping_stiffness", plant.damping_stiffness, Dimension::kTime, kNotNegative);
  r.may("time_step", plant.time_step, Dimension::kTime, kPositive);
  r.may("tracker_rate", plant.tracker_rate_hz, Dimension::kRate, kLoopRate);
}

void read_robot(Reader& r, Config& config) {
  r.need("robot", config.robot, read_name);
  r.need("mesh", config.mesh, read_mesh);
  r.need("material", config.material, read_material);
  r.may("gravity", config.gravity, Dimension::kAcceleration);
  r.need("fixed", config.fixed, read_fixed);
  r.may("snap", config.snap, Dimension::kLength, kNotNegative);
  r.need("effectors", config.effectors, read_effector);
  r.need("actuators", config.cables, read_cable);
  r.may("control", config.control, read_control);
  r.need("bus", config.bus, read_bus);
  r.may("motion", config.motion, read_motion);
  r.may("plant", config.plant, read_plant);
}

}  // namespace

Config load_config(const std::filesystem::path& file, ConfigKeys* keys) {
  Source source{.file = file};
  const Value robot = load_yaml(source);
  Config config;
  config.file = file;
  robot.read(config, read_robot);
  check_rules(robot, config);
  if (keys) *keys = source.keys;
  return config;
}

}  // namespace tendril::app
