// SPDX-License-Identifier: Apache-2.0
#include "app/config/load_config.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/config/config_body.h"
#include "app/config/config_drive.h"
#include "app/config/config_motion.h"
#include "app/config/config_rules.h"
#include "app/config/config_sensors.h"
#include "app/config/plant_fault_parser.h"
#include "app/config/yaml_reader.h"

// One function a section, one line a key; what the body is made of is in config_body.cpp, its drives in
// config_drive.cpp, its sensors in config_sensors.cpp. A key that is added is added to docs/robot-file.md as
// well: a test compares the two.
namespace tendril::app {
namespace {

constexpr double kFastestRate = 20e3;  // Hz; no CAN bus carries a cycle in less than 50 us
constexpr Range kLoopRate = {.above = 0, .at_most = kFastestRate};
constexpr Range kCpu = {.at_least = -1, .at_most = 1023};
constexpr Range kHeartbeat = {.at_least = 1e-3, .at_most = 65.535};  // u16 in ms, CiA 301 objects 1016, 1017
constexpr Range kStartTimeout = {.at_least = 1e-3, .at_most = 600};
constexpr std::size_t kLongestInterface = 15;    // IFNAMSIZ less the final 0
constexpr std::size_t kLongestSocketPath = 107;  // sun_path likewise

void read_control(Reader& r, ControlConfig& control) {
  r.may("rate", control.rate_hz, Dimension::kRate, kLoopRate);
  r.may("epsilon", control.epsilon, Dimension::kNumber, kNotNegative);
  r.may("iteration_cap", control.iteration_cap, Range{.at_least = 1});
  r.may("priority", control.priority, Range{.at_least = 1, .at_most = 98});
  r.may("cpu", control.cpu, kCpu);
  r.may("model_cpu", control.model_cpu, kCpu);
  r.may("housekeeping_cpu", control.housekeeping_cpu, kCpu);
  r.may("idle_latency", control.idle_latency, Dimension::kTime, Range{.at_least = 0, .at_most = 1});
  r.may("snapshot_age_limit", control.snapshot_age_limit, Dimension::kTime, kPositive);
  r.may("target_age_limit", control.target_age_limit, Dimension::kTime, kPositive);
  r.may("late_cycles_limit", control.late_cycles_limit, Range{.at_least = 1});
  r.may("model_rate_limit", control.model_rate_limit_hz, Dimension::kRate,
        Range{.at_least = 0, .at_most = kFastestRate});
  r.may("model_solver", control.model_solver,
        Words<fem::LinearSolverKind>{{"direct", fem::LinearSolverKind::kDirect},
                                     {"reused", fem::LinearSolverKind::kReused}});
  r.may("model_tangent", control.model_tangent,
        Words<fem::Tangent>{{"exact", fem::Tangent::kExact}, {"semidefinite", fem::Tangent::kSemidefinite}});
  r.may("stop", control.stop,
        Words<rt::StopAction>{{"hold", rt::StopAction::kHold}, {"relax", rt::StopAction::kRelax}});
  r.may("feedback", control.feedback, Words<bool>{{"off", false}, {"on", true}});
  r.may("feedback_time", control.feedback_time, Dimension::kTime, Range{.at_least = 1e-3, .at_most = 60});
  r.may("feedback_limit", control.feedback_limit, Dimension::kLength, kPositive);
  r.may("on_fault", control.on_fault, Words<OnFault>{{"wait", OnFault::kWait}, {"exit", OnFault::kExit}});
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

void read_protocol_name(const Value& v, const hal::DriveProtocol*& protocol, Protocols protocols) {
  std::string expected;
  for (const hal::DriveProtocol* known : protocols)
    expected += (expected.empty() ? "" : " or ") + std::string(known->name());
  const std::string name = v.text(expected);
  const auto found = std::ranges::find(protocols, name, [](const auto* known) { return known->name(); });
  if (found == protocols.end()) v.fail(expected);
  protocol = *found;
}

void read_bus(Reader& r, BusConfig& bus, Protocols protocols) {
  bus.line = r.line();
  r.need("name", bus.name, read_bus_name);
  r.may("bitrate", bus.bitrate, Dimension::kBitRate, Range{.above = 0, .at_most = 1e6});  // classic CAN
  hal::MasterConfig& master = bus.master;
  r.may("protocol", master.protocol, [protocols](const Value& v, const hal::DriveProtocol*& protocol) {
    read_protocol_name(v, protocol, protocols);
  });
  read_protocol_keys(r, protocols, *master.protocol, master,
                     [](const hal::DriveProtocol& protocol, hal::Settings& section, hal::MasterConfig& its) {
                       protocol.read_bus(section, its);
                     });
  ProtocolSettings common(r);
  common.time("boot_timeout", master.start_timeout_ns, kStartTimeout);
  common.time("enable_timeout", master.enable_timeout_ns, kStartTimeout);
  common.time("disable_timeout", master.disable_timeout_ns, kStartTimeout);
  common.time("heartbeat", master.heartbeat_ns, kHeartbeat);
  common.time("heartbeat_timeout", master.heartbeat_timeout_ns, kHeartbeat);
  common.time("feedback_timeout", master.feedback_timeout_ns, kHeartbeat);
}

void read_servo(Reader& r, ServoConfig& servo, const SpokenProtocol& protocol) {
  r.may("acceleration_time", servo.acceleration_time, Dimension::kTime, Range{.at_least = 1e-3});
  r.may("position_gain", servo.position_gain, Dimension::kInverseTime, Range{.above = 0, .at_most = 1000});
  r.may("force_limit", servo.force_limit, Dimension::kNumber, kPositive);
  r.may("friction", servo.friction, Dimension::kNumber, Range{.above = 0, .at_most = 1});
  r.may("left_enabled", servo.left_enabled);
  read_protocol_keys(r, protocol.known, protocol.spoken, servo.protocol_settings,
                     [](const hal::DriveProtocol& its, hal::Settings& section, std::any& protocol_settings) {
                       its.read_simulation(section, protocol_settings);
                     });
}

/// @param config  with bus, actuators and sensors read already
void read_fault(Reader& r, PlantFault& fault, const Config& config) {
  double after = 0;
  r.need("after", after, Dimension::kTime, kNotNegative);
  r.need("inject", fault, [&config](const Value& v, PlantFault& out) {
    try {
      out = parse_plant_fault(v.text("a fault"), config);
    } catch (const PlantFaultMistake& mistake) {
      v.fail(mistake.what());
    }
  });
  fault.after = after;
}

void read_plant(Reader& r, PlantConfig& plant, const Config& config, Protocols protocols) {
  r.need("young_modulus", plant.young_modulus, Dimension::kPressure, kPositive);
  r.need("poisson_ratio", plant.poisson_ratio, Dimension::kNumber, kPoissonRatio);
  r.need("mass", plant.mass, Dimension::kMass, kPositive);
  r.may("damping_mass", plant.damping_mass, Dimension::kInverseTime, kNotNegative);
  r.may("damping_stiffness", plant.damping_stiffness, Dimension::kTime, kNotNegative);
  r.may("time_step", plant.time_step, Dimension::kTime, Range{.at_least = 1e-5, .at_most = 0.1});
  r.may("loads", plant.loads, read_load);
  r.may("drives", plant.drives, [&](Reader& section, ServoConfig& servo) {
    read_servo(section, servo, {*config.bus.master.protocol, protocols});
  });
  r.may("faults", plant.faults,
        [&](Reader& section, PlantFault& fault) { read_fault(section, fault, config); });
}

void read_robot(Reader& r, Config& config, Protocols protocols) {
  r.need("robot", config.robot, read_name);
  r.need("mesh", config.mesh, read_mesh);
  r.need("material", config.material, read_material);
  r.may("gravity", config.gravity, Dimension::kAcceleration);
  r.may("loads", config.loads, read_load);
  r.need("fixed", config.fixed, read_region);
  r.may("snap", config.snap, Dimension::kLength, kNotNegative);
  r.need("effectors", config.effectors, read_effector);
  config.bus.master.protocol = protocols.front();  // also where the section is missing
  r.need("bus", config.bus, [&](Reader& section, BusConfig& bus) { read_bus(section, bus, protocols); });
  r.need("actuators", config.actuators, [&](Reader& section, ActuatorConfig& actuator) {
    read_actuator(section, actuator, {*config.bus.master.protocol, protocols});
  });
  r.may("sensors", config.sensors,
        [&](const Value& v, SensorConfig& sensor) { read_sensor(v, sensor, config); });
  r.may("control", config.control, read_control);
  r.may("motion", config.motion,
        [&](Reader& section, MotionConfig& motion) { read_motion(section, motion, config.effectors); });
  r.may("plant", config.plant,
        [&](Reader& section, PlantConfig& plant) { read_plant(section, plant, config, protocols); });
}

}  // namespace

Config load_config(const std::filesystem::path& file, ConfigKeys* keys,
                   std::span<const hal::DriveProtocol* const> protocols) {
  Source source{.file = file};
  const Value robot = load_yaml(source);
  Config config;
  config.file = file;
  robot.read(config, [protocols](Reader& r, Config& out) { read_robot(r, out, protocols); });
  check_rules(robot, config);
  if (keys) *keys = source.keys;
  return config;
}

}  // namespace tendril::app
