#include "hal/protocols/drive_protocol.h"

#include <cmath>
#include <type_traits>

#include "hal/cia402/cia402_drive.h"
#include "hal/cia402/cia402_master.h"
#include "hal/cia402/cia402_setup.h"
#include "hal/odrive/odrive_drive.h"
#include "hal/odrive/odrive_master.h"

namespace tendril::hal {
namespace {

/// A drive of one protocol as any drive.
template <class Drive>
class Adapter final : public SimulatedDrive {
 public:
  template <class Spec>
  Adapter(const Spec& spec, const AxisScale& scale, double force_limit)
      : drive_(spec), scale_(scale), force_limit_(scale.reversed ? -force_limit : force_limit) {}

  void receive(const Frame& frame, int64_t now_ns, FrameBatch& out) noexcept override {
    drive_.receive(frame, now_ns, out);
  }
  void advance(int64_t now_ns, FrameBatch& out) noexcept override { drive_.advance(now_ns, out); }
  double displacement() const noexcept override { return scale_.to_displacement(drive_.position()); }
  void set_load(double effort) noexcept override { drive_.set_load(effort / force_limit_); }
  PowerStage power_stage() const noexcept override { return drive_.power_stage(); }
  void overheat() noexcept override { drive_.overheat(); }
  void inject_fault(uint32_t code) noexcept override {
    if constexpr (std::is_same_v<Drive, Cia402Drive>)
      drive_.inject_fault(static_cast<uint16_t>(code));
    else
      drive_.inject_fault(code);
  }
  void set_jammed(bool jammed) noexcept override { drive_.set_jammed(jammed); }

 private:
  Drive drive_;
  AxisScale scale_;
  double force_limit_;  // N or Pa, negative where displacement falls as the position rises
};

ServoTuning tuned(ServoTuning usual, const SimulatedActuator& actuator) {
  return {.acceleration_time = actuator.acceleration_time,
          .position_gain = actuator.position_gain.value_or(usual.position_gain),
          .friction = actuator.friction};
}

/// Torque of a drive that holds that force, Nm.
double torque_limit(const AxisScale& scale, double force_limit) {
  return std::abs(scale.to_torque(force_limit));
}

/// The share of a spec that is about torques. Without a rated torque the drive has half of what it holds.
void set_torques(DriveSpec& spec, const AxisConfig& axis, double limit) {
  if (axis.set_point == SetPoint::kEffort) spec.rpdo_target = kMapTargetTorque;
  if (!std::isfinite(limit)) return;
  const double rated = axis.canopen.rated_torque > 0 ? axis.canopen.rated_torque : limit / spec.torque_limit;
  spec.rated_torque_mNm = static_cast<uint32_t>(std::round(1e3 * rated));
  spec.torque_limit = limit / rated;
}

uint32_t error_window(double counts) {
  constexpr uint32_t kNotWatched = 0xFFFF'FFFF;
  return counts < kNotWatched ? static_cast<uint32_t>(std::round(counts)) : kNotWatched;
}

}  // namespace

void check(const MasterConfig& config) {
  switch (config.protocol) {
    case Protocol::kCanopen:
      return check_cia402(config);
    case Protocol::kOdrive:
      return check_odrive(config);
  }
}

std::vector<PeriodicFrames> periodic_frames(const MasterConfig& config) {
  auto frames = config.protocol == Protocol::kOdrive ? odrive_frames(config) : cia402_frames(config);
  for (const SensorConfig& sensor : config.sensors)
    frames.push_back({.length = sensor.length, .rate_hz = sensor.rate_hz, .extended = sensor.extended});
  return frames;
}

uint32_t heartbeat_identifier(const MasterConfig& config, int axis) {
  const int node = config.axes[axis].node;
  return config.protocol == Protocol::kOdrive ? odrive_id(node, OdriveMessage::kHeartbeat)
                                              : kHeartbeatBase + static_cast<uint32_t>(node);
}

std::unique_ptr<DriveMaster> make_master(const MasterConfig& config) {
  if (config.protocol == Protocol::kOdrive) return std::make_unique<OdriveMaster>(config);
  return std::make_unique<Cia402Master>(config);
}

std::unique_ptr<SimulatedDrive> make_drive(const MasterConfig& config, int axis,
                                           const SimulatedActuator& actuator) {
  const AxisConfig& a = config.axes[axis];
  const double unit = std::abs(a.scale.displacement_per_count());
  const double top_speed = actuator.top_rate / unit;
  const double position = a.scale.to_position(actuator.displacement);
  if (config.protocol == Protocol::kOdrive)
    return std::make_unique<Adapter<OdriveDrive>>(
        OdriveSpec{.node = a.node,
                   .firmware = config.odrive.firmware,
                   .top_speed = top_speed,
                   .position = position,
                   .tuning = tuned(OdriveSpec{}.tuning, actuator),
                   .torque_limit = torque_limit(a.scale, actuator.force_limit),
                   .encoder_counts = actuator.encoder_counts,
                   .heartbeat_ns = config.heartbeat_ns,
                   .encoder_period_ns = config.odrive.encoder_period_ns,
                   .watchdog_ns = config.heartbeat_timeout_ns},
        a.scale, actuator.force_limit);
  const bool mapped = a.canopen.mapping == Mapping::kAsFound;
  DriveSpec spec{.node = a.node,
                 .pdo = a.canopen.pdo,
                 .rpdo_id = mapped ? rpdo_cob_id(a) : 0,
                 .tpdo_id = mapped ? tpdo_cob_id(a) : 0,
                 .top_speed = top_speed,
                 .position_counts = position,
                 .incremental = a.canopen.reference == Reference::kHoming,
                 .referenced_bit = a.canopen.referenced_bit,
                 .tuning = tuned(DriveSpec{}.tuning, actuator),
                 .error_window = error_window(actuator.following_error / unit)};
  set_torques(spec, a, torque_limit(a.scale, actuator.force_limit));
  return std::make_unique<Adapter<Cia402Drive>>(spec, a.scale, actuator.force_limit);
}

}  // namespace tendril::hal
