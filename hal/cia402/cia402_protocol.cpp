// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/cia402_protocol.h"

#include <cmath>
#include <utility>

#include "hal/canopen/canopen.h"
#include "hal/cia402/cia402.h"
#include "hal/cia402/cia402_check.h"
#include "hal/cia402/cia402_master.h"
#include "hal/cia402/cia402_settings.h"
#include "hal/cia402/cia402_setup.h"
#include "hal/cia402/simulated_cia402_drive.h"
#include "hal/cia402/simulated_drive_eds.h"
#include "hal/drive/formatted.h"
#include "hal/sim/simulated_axis.h"

namespace tendril::hal {
namespace {

constexpr Range kNode = {.at_least = 1, .at_most = 127};         // CiA 301
constexpr Range kCobId = {.at_least = 0x181, .at_most = 0x57F};  // CiA 301, without the restricted COB-IDs
constexpr Range kHomingMethod = {.at_least = -128, .at_most = 127};  // object 6098, i8
constexpr Range kHomingQuantity = {.at_least = 1};
constexpr Range kSdoTimeout = {.at_least = 1e-3, .at_most = 60};

template <class T>
void read_whole(Settings& section, std::string_view key, std::optional<T>& out, const Range& range) {
  int number = 0;
  section.whole(key, number, range);
  if (section.has(key)) out = static_cast<T>(number);
}

void read_cob_id(Settings& section, std::string_view key, uint32_t& out) {
  int id = static_cast<int>(out);
  section.whole(key, id, kCobId);
  out = static_cast<uint32_t>(id);
}

void read_homing(Settings& section, HomingConfig& homing) {
  read_whole(section, "method", homing.method, kHomingMethod);
  read_whole(section, "speed_search", homing.speed_search, kHomingQuantity);
  read_whole(section, "speed_zero", homing.speed_zero, kHomingQuantity);
  read_whole(section, "acceleration", homing.acceleration, kHomingQuantity);
  section.time("timeout", homing.timeout_ns, Range{.above = 0, .at_most = 3600});
}

void append_sdo(std::vector<FrameLayout>& frames, const std::string& node, int number_of_node) {
  const std::vector<Signal> signals = {number("command", 0, 8), number("index", 8, 16),
                                       number("subindex", 24, 8), number("data", 32, 32)};
  frames.push_back({kSdoRequestBase + number_of_node, node + "_SDO_request", 8, kController, signals});
  frames.push_back({kSdoAnswerBase + number_of_node, node + "_SDO_answer", 8, node, signals});
}

std::vector<FrameLayout> axis_layouts(const AxisConfig& axis, const DisplacementUnit& unit) {
  std::vector<FrameLayout> frames;
  const std::string node = node_name(axis);
  const auto position = [&](const char* name) {
    return as_displacement(number(name, 16, 32, SignalType::kSigned), axis.scale, unit);
  };
  const bool on_efforts = axis.set_point == SetPoint::kEffort;
  const Signal torque = scaled(number("target_torque", 16, 16, SignalType::kSigned),
                               1e-3 * cia402_settings(axis).rated_torque, "Nm");
  frames.push_back({rpdo_cob_id(axis),
                    node + "_RPDO",
                    on_efforts ? 4 : 6,
                    kController,
                    {number("controlword", 0, 16), on_efforts ? torque : position("target_position")}});
  frames.push_back({tpdo_cob_id(axis),
                    node + "_TPDO",
                    6,
                    node,
                    {number("statusword", 0, 16), position("actual_position")}});
  frames.push_back(
      {kEmergencyBase + axis.node,
       node + "_EMCY",
       8,
       node,
       {number("error_code", 0, 16), number("error_register", 16, 8), number("detail", 24, 40)}});
  append_sdo(frames, node, axis.node);
  frames.push_back({kHeartbeatBase + axis.node, node + "_heartbeat", 1, node, {number("nmt_state", 0, 8)}});
  return frames;
}

/// The share of a spec that is about torques. Without a rated torque the drive has half of what it holds.
void set_torques(SimulatedCia402Spec& spec, const AxisConfig& axis, double limit) {
  if (axis.set_point == SetPoint::kEffort) spec.rpdo_target = kMapTargetTorque;
  if (!std::isfinite(limit)) return;
  const double rated =
      cia402_settings(axis).rated_torque > 0 ? cia402_settings(axis).rated_torque : limit / spec.torque_limit;
  spec.rated_torque_mNm = static_cast<uint32_t>(std::round(1e3 * rated));
  spec.torque_limit = limit / rated;
}

/// An offset to its targets that another controller has left in a drive, counts.
/// @param unit  displacement of one count
int32_t left_offset(const SimulatedActuator& actuator, double unit) {
  constexpr double kShare = 0.1;  // of the range
  return actuator.left_enabled
             ? static_cast<int32_t>(std::lround(kShare * actuator.displacement_range / unit))
             : 0;
}

uint32_t error_window(double counts) {
  constexpr uint32_t kNotWatched = 0xFFFF'FFFF;
  return counts < kNotWatched ? static_cast<uint32_t>(std::round(counts)) : kNotWatched;
}

class Cia402Protocol final : public DriveProtocol {
 public:
  std::string_view name() const override { return "canopen"; }

  void read_bus(Settings& section, MasterConfig& config) const override {
    Cia402BusSettings& bus = cia402_settings(config);
    section.whole("master_node", bus.master_node, kNode);
    section.time("sdo_timeout", bus.sdo_timeout_ns, kSdoTimeout);
  }

  void read_drive(Settings& section, Dimension /*displacement*/, AxisConfig& axis) const override {
    Cia402AxisSettings& settings = cia402_settings(axis);
    section.whole("node", axis.node, kNode, Settings::Need::kRequired);
    section.number("counts_per_turn", axis.scale.counts_per_turn, Dimension::kNumber, kPositive,
                   Settings::Need::kRequired);
    section.word("reference", settings.reference,
                 {{"absolute", Reference::kAbsolute}, {"homing", Reference::kHoming}});
    section.whole("pdo", settings.pdo, Range{.at_least = 1, .at_most = 4});
    read_cob_id(section, "rpdo_id", settings.rpdo_id);
    read_cob_id(section, "tpdo_id", settings.tpdo_id);
    section.word("mapping", settings.mapping,
                 {{"configure", Mapping::kConfigure}, {"as_found", Mapping::kAsFound}});
    section.whole("referenced_bit", settings.referenced_bit);
    const int bit = settings.referenced_bit;
    if (section.has("referenced_bit") && bit != 8 && bit != 14 && bit != 15)
      section.fail("referenced_bit", "8, 14 or 15, the bits that CiA 402 leaves to the maker");
    section.section("homing", [&settings](Settings& homing) { read_homing(homing, settings.homing); });
    settings.homing_given = section.has("homing");
    section.flag("soft_limits", settings.soft_limits);
    section.number("rated_torque", settings.rated_torque, Dimension::kTorque, kPositive);
    const bool on_efforts = axis.set_point == SetPoint::kEffort;
    if (!on_efforts && section.has("rated_torque"))
      section.fail("rated_torque", "no such key, as drive.setpoint is displacement");
  }

  void read_simulation(Settings& section, std::any& protocol_settings) const override {
    double share = 0;
    section.number("following_error", share, Dimension::kNumber, Range{.above = 0, .at_most = 1});
    if (section.has("following_error"))
      settings_as<Cia402SimulationSettings>(protocol_settings).following_error = share;
  }

  void check(const MasterConfig& config) const override { check_cia402(config); }

  std::vector<std::string> advice(const MasterConfig& config) const override {
    // Drives that know milliseconds alone refuse another period, or take a wrong one. 60C2, see
    // docs/drives.md.
    if (nearest_interpolation_period(config.period_ns).exponent == InterpolationPeriod::kMilliseconds)
      return {};
    const auto period_ns = static_cast<double>(config.period_ns);
    return {
        formatted("control.rate %g Hz is a period of %.4g ms; many CANopen drives take whole milliseconds "
                  "only, as of 500 Hz or 1 kHz",
                  1e9 / period_ns, 1e-6 * period_ns)};
  }

  double effort_step(const AxisConfig& axis) const override {
    return 1e-3 * cia402_settings(axis).rated_torque / std::abs(axis.scale.to_torque(1));
  }

  std::vector<PeriodicFrames> periodic_frames(const MasterConfig& config) const override {
    return cia402_frames(config);
  }

  std::vector<FrameLayout> bus_layouts(const MasterConfig& config) const override {
    return {{kNmtId, "NMT", 2, kController, {number("command", 0, 8), number("node", 8, 8)}},
            {kSyncId, "SYNC", 0, kController, {}},
            {kHeartbeatBase + cia402_settings(config).master_node,
             "Tendril_heartbeat",
             1,
             kController,
             {number("nmt_state", 0, 8)}}};
  }

  std::vector<FrameLayout> drive_layouts(const MasterConfig& config, int axis,
                                         const DisplacementUnit& unit) const override {
    return axis_layouts(config.axes[axis], unit);
  }

  std::unique_ptr<DriveMaster> make_master(const MasterConfig& config) const override {
    return std::make_unique<Cia402Master>(config);
  }

  std::unique_ptr<SimulatedDrive> make_simulated_drive(const MasterConfig& config, int axis,
                                                       const SimulatedActuator& actuator) const override {
    const AxisConfig& a = config.axes[axis];
    const double unit = std::abs(a.scale.displacement_per_count());
    const bool mapped = cia402_settings(a).mapping == Mapping::kAsFound;
    const auto share = settings_as<Cia402SimulationSettings>(actuator.protocol_settings).following_error;
    const double window = share ? *share * actuator.displacement_range : SimulatedActuator::kUnlimited;
    SimulatedCia402Spec spec{.node = a.node,
                             .pdo = cia402_settings(a).pdo,
                             .rpdo_id = mapped ? rpdo_cob_id(a) : 0,
                             .tpdo_id = mapped ? tpdo_cob_id(a) : 0,
                             .top_speed = actuator.top_rate / unit,
                             .position_counts = a.scale.to_position(actuator.displacement),
                             .incremental = cia402_settings(a).reference == Reference::kHoming,
                             .referenced_bit = cia402_settings(a).referenced_bit,
                             .tuning = tuned(SimulatedCia402Spec{}.tuning, actuator),
                             .error_window = error_window(window / unit),
                             .left_enabled = actuator.left_enabled,
                             .position_offset = left_offset(actuator, unit)};
    set_torques(spec, a, std::abs(a.scale.to_torque(actuator.force_limit)));
    return std::make_unique<SimulatedAxis<SimulatedCia402Drive>>(
        spec, a.scale, actuator.force_limit, kHeartbeatBase + static_cast<uint32_t>(a.node));
  }

  FaultInjection fault_injection() const override {
    return {"emcy", "its drive fails with that EMCY error code (0x1 to 0xFFFF)", 0xFFFF};
  }

  std::string data_sheet() const override { return simulated_drive_eds(); }
};

}  // namespace

const DriveProtocol& cia402_protocol() {
  static const Cia402Protocol protocol;
  return protocol;
}

}  // namespace tendril::hal
