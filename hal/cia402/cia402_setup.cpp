// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/cia402_setup.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "hal/canopen/canopen.h"
#include "hal/cia402/cia402.h"
#include "hal/drive/range_monitor.h"

namespace tendril::hal {
namespace {

constexpr uint16_t kSoftLimits = 0x607D;

SdoStep write(int index, int sub, int size, uint32_t value) {
  return {{SdoRequest::Kind::kWrite, {static_cast<uint16_t>(index), static_cast<uint8_t>(sub)}, size, value},
          0};
}

/// Drives acknowledge values that they do not take: what the robot's safety depends on is read back.
SdoStep verified(SdoStep step, uint32_t mask = 0xFFFF'FFFF) {
  step.verify = true;
  step.mask = mask;
  return step;
}

SdoStep read(int index, int sub, uint32_t expected, uint32_t mask = 0xFFFF'FFFF) {
  return {{SdoRequest::Kind::kRead, {static_cast<uint16_t>(index), static_cast<uint8_t>(sub)}, 0, 0},
          expected,
          mask};
}

/// At least one count, and not 0xFFFFFFFF, which is no window at all.
uint32_t following_error_window(const AxisConfig& axis) {
  const double counts = axis.following_error / std::abs(axis.scale.displacement_per_count());
  return static_cast<uint32_t>(std::clamp(std::round(counts), 1.0, double{0xFFFF'FFFE}));
}

void append_mode(std::vector<SdoStep>& steps, int8_t mode) {
  steps.push_back(write(0x6060, 0, 1, static_cast<uint8_t>(mode)));
}

/// An object that a drive may lack. If it is right already it is not written: it may be read-only.
void append_optional(std::vector<SdoStep>& steps, SdoStep step) {
  step = verified(step);
  step.only_if_different = true;
  step.tolerance = Tolerance::kUnreadable;
  steps.push_back(step);
}

void append_period(std::vector<SdoStep>& steps, InterpolationPeriod period) {
  append_optional(steps, write(0x60C2, 1, 1, period.value));
  append_optional(steps, write(0x60C2, 2, 1, static_cast<uint8_t>(period.exponent)));
}

// Of a statusword: set in every state with power, and in the states on the way to it.
constexpr uint32_t kPowerBits = 0x0007;

/// A drive that an earlier controller has left with power loses it, and must say so. Not every drive takes a
/// controlword over SDO.
void append_power_off(std::vector<SdoStep>& steps) {
  SdoStep off = write(0x6040, 0, 2, kDisableVoltage);
  off.tolerance = Tolerance::kAny;
  steps.insert(steps.end(), {off, read(0x6041, 0, 0, kPowerBits)});
}

/// Offsets that an earlier controller has left would be added to the targets.
void append_no_offsets(std::vector<SdoStep>& steps, const AxisConfig& axis) {
  if (axis.set_point == SetPoint::kDisplacement) {
    append_optional(steps, write(0x60B0, 0, 4, 0));
    append_optional(steps, write(0x60B1, 0, 4, 0));
  }
  append_optional(steps, write(0x60B2, 0, 2, 0));
}

/// The drive monitors the controller.
SdoStep consumer_step(const MasterConfig& config) {
  return write(0x1016, 1, 4,
               static_cast<uint32_t>(cia402_settings(config).master_node) << 16 |
                   heartbeat_ms(config.heartbeat_timeout_ns));
}

/// Another controller may have changed it since the set-up.
void append_consumer_check(std::vector<SdoStep>& steps, const MasterConfig& config) {
  steps.push_back(read(0x1016, 1, consumer_step(config).request.value));
}

// Bit of the COB-ID of a TPDO. Tendril makes no remote requests; drives that serve none may refuse 0.
constexpr uint32_t kNoRemoteRequest = 0x4000'0000;

/// A PDO that is on and goes with every SYNC.
struct SyncedPdo {
  int communication, mapping;  // indices of its objects
  uint32_t cob_id, first, second;
};

/// Checks that a PDO is on and goes with every SYNC, with these two objects.
void append_checks(std::vector<SdoStep>& steps, const SyncedPdo& pdo) {
  steps.insert(steps.end(), {read(pdo.communication, 1, pdo.cob_id & ~kNoRemoteRequest, ~kNoRemoteRequest),
                             read(pdo.communication, 2, 1), read(pdo.mapping, 0, 2),
                             read(pdo.mapping, 1, pdo.first), read(pdo.mapping, 2, pdo.second)});
}

/// Off, map emptied, map filled, every SYNC, on; then checks, as drives acknowledge what they do not take.
void append_writes(std::vector<SdoStep>& steps, const SyncedPdo& pdo) {
  steps.insert(steps.end(), {write(pdo.communication, 1, 4, kPdoInvalid | pdo.cob_id),
                             write(pdo.mapping, 0, 1, 0), write(pdo.mapping, 1, 4, pdo.first),
                             write(pdo.mapping, 2, 4, pdo.second), write(pdo.mapping, 0, 1, 2),
                             write(pdo.communication, 2, 1, 1), write(pdo.communication, 1, 4, pdo.cob_id)});
  append_checks(steps, pdo);
}

}  // namespace

uint32_t heartbeat_ms(int64_t duration_ns) noexcept {
  constexpr int64_t kMillisecond = 1'000'000;
  return static_cast<uint32_t>((duration_ns + kMillisecond / 2) / kMillisecond);
}

int8_t following_mode(const AxisConfig& axis) noexcept {
  return axis.set_point == SetPoint::kEffort ? kModeCyclicTorque : kModeCyclicPosition;
}

uint32_t rpdo_cob_id(const AxisConfig& axis) noexcept {
  return cia402_settings(axis).rpdo_id != 0 ? cia402_settings(axis).rpdo_id
                                            : 0x100 * (cia402_settings(axis).pdo + 1) + axis.node;
}

uint32_t tpdo_cob_id(const AxisConfig& axis) noexcept {
  return cia402_settings(axis).tpdo_id != 0 ? cia402_settings(axis).tpdo_id
                                            : 0x100 * cia402_settings(axis).pdo + 0x80 + axis.node;
}

std::array<uint32_t, 4> received_cia402_ids(const AxisConfig& axis) noexcept {
  const auto node = static_cast<uint32_t>(axis.node);
  return {kEmergencyBase + node, kSdoAnswerBase + node, kHeartbeatBase + node, tpdo_cob_id(axis)};
}

std::string describe_set_up_object(uint32_t object) {
  const uint32_t index = object >> 8, sub = object & 0xFF;
  if (index == 0x6061) return " (the mode of operation)";
  const uint32_t table = index & ~3u;
  const bool communication = table == 0x1400 || table == 0x1800, mapping = table == 0x1600 || table == 0x1A00;
  if ((!communication && !mapping) || sub > 2) return "";
  static constexpr const char* kCommunication[] = {"", "the COB-ID of ", "the transmission type of "};
  static constexpr const char* kMapping[] = {"the number of objects in ", "the first object in ",
                                             "the second object in "};
  return std::string(" (") + (communication ? kCommunication : kMapping)[sub] +
         (table == 0x1400 || table == 0x1600 ? "RPDO " : "TPDO ") + std::to_string(index - table + 1) + ")";
}

std::vector<SdoStep> setup_steps(const AxisConfig& axis, const MasterConfig& config) {
  const int number = cia402_settings(axis).pdo - 1;
  std::vector<SdoStep> steps;
  append_power_off(steps);
  steps.insert(steps.end(), {verified(consumer_step(config)),
                             verified(write(0x1017, 0, 2, heartbeat_ms(config.heartbeat_ns)))});
  const uint32_t target = axis.set_point == SetPoint::kEffort ? kMapTargetTorque : kMapTargetPosition;
  for (const SyncedPdo& pdo :
       {SyncedPdo{0x1400 + number, 0x1600 + number, rpdo_cob_id(axis), kMapControlword, target},
        SyncedPdo{0x1800 + number, 0x1A00 + number, kNoRemoteRequest | tpdo_cob_id(axis), kMapStatusword,
                  kMapActualPosition}})
    cia402_settings(axis).mapping == Mapping::kConfigure ? append_writes(steps, pdo)
                                                         : append_checks(steps, pdo);
  // A SYNC with a counter is another one. [CiA 301, object 1019]
  append_optional(steps, write(0x1019, 0, 1, 0));
  append_mode(steps, following_mode(axis));
  append_period(steps, nearest_interpolation_period(config.period_ns));
  if (axis.following_error > 0) steps.push_back(verified(write(0x6065, 0, 4, following_error_window(axis))));
  return steps;
}

std::vector<SdoStep> homing_steps(const AxisConfig& axis, const MasterConfig& config) {
  const HomingConfig& homing = cia402_settings(axis).homing;
  std::vector<SdoStep> steps;
  append_consumer_check(steps, config);
  if (homing.method) steps.push_back(write(0x6098, 0, 1, static_cast<uint8_t>(*homing.method)));
  if (homing.speed_search) steps.push_back(write(0x6099, 1, 4, *homing.speed_search));
  if (homing.speed_zero) steps.push_back(write(0x6099, 2, 4, *homing.speed_zero));
  if (homing.acceleration) steps.push_back(write(0x609A, 0, 4, *homing.acceleration));
  append_mode(steps, kModeHoming);
  return steps;
}

std::optional<SoftLimits> soft_limits(const AxisConfig& axis) {
  if (!cia402_settings(axis).soft_limits || !std::isfinite(axis.displacement_min) ||
      !std::isfinite(axis.displacement_max))
    return std::nullopt;
  // With efforts the drive must not stop before the controller does.
  const double margin = axis.set_point == SetPoint::kEffort ? RangeMonitor(axis).margin() : 0;
  const int32_t least = axis.scale.to_counts(axis.displacement_min - margin);
  const int32_t greatest = axis.scale.to_counts(axis.displacement_max + margin);
  return SoftLimits{std::min(least, greatest), std::max(least, greatest)};  // a reversed axis swaps them
}

SoftLimits widened(SoftLimits limits, int32_t position) noexcept {
  const int64_t margin = (int64_t{limits.max} - limits.min) / 100 + 1;
  const int64_t below = position < limits.min ? position - margin : limits.min;
  const int64_t above = position > limits.max ? position + margin : limits.max;
  return {static_cast<int32_t>(std::max<int64_t>(below, INT32_MIN)),
          static_cast<int32_t>(std::min<int64_t>(above, INT32_MAX))};
}

std::vector<SdoStep> following_steps(const AxisConfig& axis, const MasterConfig& config) {
  std::vector<SdoStep> steps;
  append_consumer_check(steps, config);
  append_mode(steps, following_mode(axis));
  append_no_offsets(steps, axis);
  if (const auto limits = soft_limits(axis)) {
    // A drive that compares both may refuse a least limit above its present greatest one. So the least is
    // written again after the greatest.
    SdoStep least = write(kSoftLimits, 1, 4, 0);
    least.tolerance = Tolerance::kAny;
    steps.insert(steps.end(),
                 {least, verified(write(kSoftLimits, 2, 4, 0)), verified(write(kSoftLimits, 1, 4, 0))});
    set_soft_limits(steps, *limits);
  }
  return steps;
}

void set_soft_limits(std::span<SdoStep> steps, SoftLimits limits) noexcept {
  for (SdoStep& step : steps)
    if (step.request.object.index == kSoftLimits)
      step.request.value = static_cast<uint32_t>(step.request.object.sub == 1 ? limits.min : limits.max);
}

std::vector<SdoStep> mode_steps(int8_t mode) { return {read(0x6061, 0, static_cast<uint8_t>(mode))}; }

std::vector<SdoStep> power_off_steps() {
  std::vector<SdoStep> steps;
  append_power_off(steps);
  return steps;
}

std::vector<SdoStep> release_steps() { return {write(0x1016, 1, 4, 0)}; }

std::vector<PeriodicFrames> cia402_frames(const MasterConfig& config) {
  const int axes = static_cast<int>(config.axes.size());
  const auto on_efforts =
      static_cast<int>(std::ranges::count(config.axes, SetPoint::kEffort, &AxisConfig::set_point));
  const double rate_hz = 1e9 / static_cast<double>(config.period_ns);
  return {{.length = 0, .rate_hz = rate_hz},                                  // SYNC
          {.length = 6, .rate_hz = rate_hz, .count = 2 * axes - on_efforts},  // PDOs
          {.length = 4, .rate_hz = rate_hz, .count = on_efforts},             // RPDOs of torques
          {.length = 1, .rate_hz = 1e9 / static_cast<double>(config.heartbeat_ns), .count = axes + 1}};
}

}  // namespace tendril::hal
