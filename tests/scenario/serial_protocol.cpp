// SPDX-License-Identifier: Apache-2.0
#include "tests/scenario/serial_protocol.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "hal/bus/little_endian.h"
#include "hal/drive/axis_table.h"
#include "hal/drive/supervisor.h"
#include "hal/sim/simulated_axis.h"

namespace tendril::app::testing {
namespace {

using namespace tendril::hal;

// Packets. From the controller: flags, then node and position of each axis; from a drive: state and position.
constexpr uint32_t kCommandId = 0x700, kStatusId = 0x400;  // the latter plus the node
constexpr int kFlagBytes = 1, kTargetBytes = 5, kAxesPerPacket = (kMaxFrameBytes - kFlagBytes) / kTargetBytes;
constexpr int kStatusBytes = 5;
constexpr Range kNode = {.at_least = 1, .at_most = 253};

enum class DriveState : uint8_t { kOff, kOn, kAlarm };

std::array<uint32_t, 1> received_ids(const AxisConfig& axis) { return {kStatusId + axis.node}; }

/// The controller's view of one drive.
class SerialAxis {
 public:
  SerialAxis(const AxisConfig& axis, const MasterConfig& config)
      : config_(config), node_(axis.node), scale_(axis.scale) {}

  void receive(const Frame& frame, int64_t arrival_ns) noexcept {
    if (frame.remote || frame.length != kStatusBytes) return;
    state_ = static_cast<DriveState>(frame.data[0]);
    counts_ = get<int32_t>(frame.data, 1);
    stamp_ns_ = arrival_ns;
    if (state_ == DriveState::kOn) was_on_ = true;
  }

  void supervise(int64_t now_ns, int64_t /*last_sync_ns*/) noexcept {
    if (since_ns_ == 0) since_ns_ = now_ns;
    if (stamp_ns_ == 0) {
      if (now_ns - since_ns_ > config_.start_timeout_ns) fail(FaultKind::kStartTimeout);
      return;
    }
    if (now_ns - stamp_ns_ > config_.feedback_timeout_ns) fail(FaultKind::kFeedbackLost);
    if (state_ == DriveState::kAlarm) fail(FaultKind::kDriveFault);
    if (wanted_ && was_on_ && state_ == DriveState::kOff) fail(FaultKind::kDriveDisabled);
    if (wanted_ && !was_on_ && now_ns - wanted_since_ns_ > config_.enable_timeout_ns)
      fail(FaultKind::kEnableTimeout);
  }

  void append_target(bool follows, double displacement, std::array<uint8_t, kMaxFrameBytes>& data,
                     int at) noexcept {
    if (!follows)
      target_ = counts_;
    else if (std::isfinite(displacement))
      target_ = scale_.to_counts(displacement);
    data[at] = static_cast<uint8_t>(node_);
    put(data, at + 1, target_);
  }

  void want(bool enabled, int64_t now_ns) noexcept {
    if (enabled && !wanted_) wanted_since_ns_ = now_ns;
    if (!enabled) was_on_ = false;
    wanted_ = enabled;
  }
  void finish() noexcept { finishing_ = true; }
  void restart() noexcept {
    fault_ = {};
    since_ns_ = stamp_ns_ = 0;
    was_on_ = false;
  }

  double position() const noexcept { return scale_.to_displacement(counts_); }
  int64_t position_stamp_ns() const noexcept { return stamp_ns_; }
  bool known(int64_t now_ns) const noexcept {
    return stamp_ns_ > 0 && now_ns - stamp_ns_ <= config_.feedback_timeout_ns;
  }
  bool enabled() const noexcept { return state_ == DriveState::kOn; }
  DrivePower power() const noexcept { return state_ == DriveState::kOn ? DrivePower::kOn : DrivePower::kOff; }
  bool finished() const noexcept { return finishing_ && power() == DrivePower::kOff; }
  const DriveFault& fault() const noexcept { return fault_; }

 private:
  void fail(FaultKind kind) noexcept {
    if (fault_.kind == FaultKind::kNone) fault_.kind = kind;
  }

  const MasterConfig& config_;
  int node_;
  AxisScale scale_;
  DriveState state_ = DriveState::kOff;
  int32_t counts_ = 0, target_ = 0;
  int64_t since_ns_ = 0, stamp_ns_ = 0, wanted_since_ns_ = 0;
  bool wanted_ = false, was_on_ = false, finishing_ = false;
  DriveFault fault_;
};

void check_serial(const MasterConfig& config) {
  check_common(config, config.period_ns);
  IdentifierClaims claims;
  claims.reserve(kCommandId, "that of our commands");
  for (int i = 0; i < static_cast<int>(config.axes.size()); ++i) {
    claims.claim(kStatusId + config.axes[i].node, label(config.axes[i]));
    if (config.axes[i].set_point == SetPoint::kEffort)
      refuse_drive(config, i, "setpoint", "displacement, as these drives take positions");
  }
  claims.claim_sensors(config);
}

MasterConfig checked(MasterConfig config) {
  check_serial(config);
  return config;
}

class SerialMaster final : public DriveMaster {
 public:
  explicit SerialMaster(MasterConfig config)
      : config_(checked(std::move(config))), table_(config_.axes, received_ids), supervisor_(config_, {}) {
    for (const AxisConfig& axis : config_.axes) axes_.emplace_back(axis, config_);
  }

  Wire wire() const noexcept override { return Wire::kSerial; }

  std::vector<uint32_t> identifiers() const override {
    std::vector<uint32_t> ids = supervisor_.identifiers();
    for (const AxisConfig& axis : config_.axes) ids.push_back(received_ids(axis)[0]);
    return ids;
  }

  void receive(const Frame& frame, int64_t arrival_ns) noexcept override {
    const int axis = table_.find(frame);
    if (axis == AxisTable::kNoAxis)
      supervisor_.receive(frame, arrival_ns);
    else
      axes_[axis].receive(frame, arrival_ns);
  }

  const Measurement& measure(BusHealth health, int64_t now_ns) noexcept override {
    return supervisor_.measure(axes_, health, now_ns, now_ns);
  }

  void command(const Command& command, int64_t now_ns, FrameBatch& out) noexcept override {
    if (command.reset) supervisor_.reset(axes_);
    const bool follows = command.enable && supervisor_.measurement().all_enabled;
    for (size_t first = 0; first < axes_.size(); first += kAxesPerPacket) {
      const size_t count = std::min<size_t>(kAxesPerPacket, axes_.size() - first);
      Frame packet{.id = kCommandId, .length = static_cast<uint8_t>(kFlagBytes + count * kTargetBytes)};
      packet.data[0] = command.enable;
      for (size_t k = 0; k < count; ++k) {
        SerialAxis& axis = axes_[first + k];
        axis.want(command.enable, now_ns);
        if (command.finish) axis.finish();
        axis.append_target(follows, command.displacement[first + k], packet.data,
                           kFlagBytes + static_cast<int>(k) * kTargetBytes);
      }
      out.push(packet);
    }
  }

  std::string describe(const DriveFault& fault) const override {
    const std::string kind = tendril::hal::name(fault.kind);
    return fault.axis < 0 ? kind : label(config_, fault.axis) + ": " + kind;
  }

 private:
  MasterConfig config_;
  AxisTable table_;
  Supervisor supervisor_;
  std::vector<SerialAxis> axes_;
};

struct SerialDriveSpec {
  int node;
  double top_speed;  // counts/s
  double position;   // counts
  ServoTuning tuning;
  int64_t period_ns;  // of the commands
  int64_t watchdog_ns;
};

/// The drive's side: off until told, off again without packets.
class SimulatedSerialDrive {
 public:
  explicit SimulatedSerialDrive(const SerialDriveSpec& spec)
      : spec_(spec), servo_(spec.top_speed, spec.tuning, spec.position) {}

  void receive(const Frame& frame, int64_t now_ns, FrameBatch& out) noexcept {
    if (frame.id != kCommandId) return;
    for (int at = kFlagBytes; at + kTargetBytes <= frame.length; at += kTargetBytes) {
      if (frame.data[at] != spec_.node) continue;
      told_ns_ = now_ns;
      if (state_ != DriveState::kAlarm) state_ = frame.data[0] != 0 ? DriveState::kOn : DriveState::kOff;
      servo_.interpolate(get<int32_t>(frame.data, at + 1), spec_.period_ns);
      answer(out);
    }
  }

  void advance(int64_t now_ns, FrameBatch& /*out*/) noexcept {
    if (state_ == DriveState::kOn && now_ns - told_ns_ > spec_.watchdog_ns) state_ = DriveState::kOff;
    if (state_ == DriveState::kOn)
      servo_.unlock();
    else
      servo_.lock();
    servo_.advance(now_ns);
  }

  double position() const noexcept { return servo_.position(); }
  PowerStage power_stage() const noexcept {
    if (state_ == DriveState::kAlarm) return PowerStage::kFault;
    return state_ == DriveState::kOn ? PowerStage::kOn : PowerStage::kOff;
  }
  void overheat() noexcept { state_ = DriveState::kAlarm; }
  void inject_fault(uint32_t /*code*/) noexcept { state_ = DriveState::kAlarm; }
  void set_jammed(bool jammed) noexcept { servo_.set_jammed(jammed); }
  void set_load(double load) noexcept { servo_.set_load(load); }

 private:
  void answer(FrameBatch& out) const noexcept {
    Frame status{.id = kStatusId + spec_.node, .length = kStatusBytes};
    status.data[0] = static_cast<uint8_t>(state_);
    put(status.data, 1, static_cast<int32_t>(std::lround(servo_.position())));
    out.push(status);
  }

  SerialDriveSpec spec_;
  SimulatedServo servo_;
  DriveState state_ = DriveState::kOff;
  int64_t told_ns_ = 0;
};

class SerialProtocol final : public DriveProtocol {
 public:
  std::string_view name() const override { return "serial"; }
  Wire wire() const override { return Wire::kSerial; }

  void read_bus(Settings&, MasterConfig&) const override {}
  void read_drive(Settings& section, Dimension, AxisConfig& axis) const override {
    section.whole("node", axis.node, kNode, Settings::Need::kRequired);
    section.number("counts_per_turn", axis.scale.counts_per_turn, Dimension::kNumber, kPositive,
                   Settings::Need::kRequired);
  }
  void read_simulation(Settings&, std::any&) const override {}
  void check(const MasterConfig& config) const override { check_serial(config); }

  std::vector<PeriodicFrames> periodic_frames(const MasterConfig& config) const override {
    const double rate_hz = 1e9 / static_cast<double>(config.period_ns);
    const int axes = static_cast<int>(config.axes.size());
    std::vector<PeriodicFrames> frames = {{.length = kStatusBytes, .rate_hz = rate_hz, .count = axes}};
    for (int left = axes; left > 0; left -= kAxesPerPacket)
      frames.push_back(
          {.length = kFlagBytes + std::min(left, kAxesPerPacket) * kTargetBytes, .rate_hz = rate_hz});
    return frames;
  }

  /// A serial line has no DBC.
  std::vector<FrameLayout> drive_layouts(const MasterConfig&, int, const DisplacementUnit&) const override {
    return {};
  }

  std::unique_ptr<DriveMaster> make_master(const MasterConfig& config) const override {
    return std::make_unique<SerialMaster>(config);
  }

  std::unique_ptr<SimulatedDrive> make_simulated_drive(const MasterConfig& config, int axis,
                                                       const SimulatedActuator& actuator) const override {
    const AxisConfig& a = config.axes[axis];
    return std::make_unique<SimulatedAxis<SimulatedSerialDrive>>(
        SerialDriveSpec{.node = a.node,
                        .top_speed = actuator.top_rate / std::abs(a.scale.displacement_per_count()),
                        .position = a.scale.to_position(actuator.displacement),
                        .tuning = tuned({}, actuator),
                        .period_ns = config.period_ns,
                        .watchdog_ns = config.heartbeat_timeout_ns},
        a.scale, actuator.force_limit, kStatusId + a.node);
  }

  FaultInjection fault_injection() const override { return {"alarm", "it raises an alarm", 255}; }
};

}  // namespace

const hal::DriveProtocol& serial_protocol() {
  static const SerialProtocol protocol;
  return protocol;
}

}  // namespace tendril::app::testing
