#include "hal/cia402/cia402_setup.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "hal/canopen/canopen.h"
#include "hal/cia402/cia402.h"
#include "hal/drive/formatted.h"
#include "hal/drive/range_monitor.h"

namespace tendril::hal {
namespace {

constexpr int64_t kSetupMillisecond_ns = 1'000'000;
constexpr uint16_t kSoftLimits = 0x607D;

uint32_t to_ms(int64_t duration_ns) {
  return static_cast<uint32_t>((duration_ns + kSetupMillisecond_ns / 2) / kSetupMillisecond_ns);
}

constexpr double kLargestTorque = 32.767;  // rated ones, object 6071, i16 in thousandths

/// With efforts the rated torque must be given, and the largest torque must fit into object 6071.
void check_torques(const MasterConfig& config, int i) {
  const AxisConfig& axis = config.axes[i];
  const double rated = cia402_settings(axis).rated_torque;
  if (axis.set_point != SetPoint::kEffort) return;
  if (!(rated > 0))
    refuse_drive(config, i, "rated_torque",
                 "the torque that the drive calls 1000, as drive.setpoint is effort");
  const double torque = std::abs(axis.scale.to_torque(axis.largest_effort));
  if (torque > kLargestTorque * rated)
    refuse_drive(
        config, i, "rated_torque",
        formatted("at least %.4g Nm, as the largest effort is a torque of %.4g Nm and object 6071 holds "
                  "32.767 times the rated one",
                  torque / kLargestTorque, torque));
}

/// Homing settings need reference: homing. A method that takes the present position as zero needs a bit that
/// says whether it has been done, so that a start does not move the zero.
void check_reference(const MasterConfig& config, int i) {
  const Cia402AxisSettings& settings = cia402_settings(config.axes[i]);
  if (settings.referenced_bit < -1 || settings.referenced_bit > 15)
    refuse_drive(config, i, "referenced_bit", "a bit of the statusword, 0 to 15");
  if (settings.reference != Reference::kHoming) {
    if (settings.homing_given) refuse_drive(config, i, "reference", "homing, as there is a section for it");
    return;
  }
  const HomingConfig& homing = settings.homing;
  if (homing.timeout_ns <= 0) refuse_drive(config, i, "homing.timeout", "a time above 0");
  if (homing.method && homes_in_place(*homing.method) && settings.referenced_bit < 0)
    refuse_drive(
        config, i, "referenced_bit",
        formatted("the statusword bit that tells whether it has been done, as homing method %d takes "
                  "wherever the axis stands at a start for the zero",
                  static_cast<int>(*homing.method)));
}

void check_axis(const MasterConfig& config, int i) {
  const AxisConfig& axis = config.axes[i];
  if (axis.node < 1 || axis.node > 127) refuse_drive(config, i, "node", "a node id from 1 to 127");
  if (cia402_settings(axis).pdo < 1 || cia402_settings(axis).pdo > 4)
    refuse_drive(config, i, "pdo", "a PDO from 1 to 4");
  if (rpdo_cob_id(axis) > 0x7FF) refuse_drive(config, i, "rpdo_id", "a COB-ID of 11 bits");
  if (tpdo_cob_id(axis) > 0x7FF) refuse_drive(config, i, "tpdo_id", "a COB-ID of 11 bits");
  check_reference(config, i);
  if (!(cia402_settings(axis).following_error >= 0))
    refuse_drive(config, i, "following_error", "a window that is not negative");
  check_torques(config, i);
}

/// The identifiers that CiA 301 gives a node [predefined connection set].
constexpr struct {
  uint32_t base;
  const char* name;
} kPredefined[] = {{0x080, "the emergency message"},
                   {0x180, "TPDO 1"},
                   {0x200, "RPDO 1"},
                   {0x280, "TPDO 2"},
                   {0x300, "RPDO 2"},
                   {0x380, "TPDO 3"},
                   {0x400, "RPDO 3"},
                   {0x480, "TPDO 4"},
                   {0x500, "RPDO 4"},
                   {0x580, "the SDO answer"},
                   {0x600, "the SDO request"},
                   {0x700, "the heartbeat"}};

void check_identifiers(const MasterConfig& config) {
  IdentifierClaims claims;
  claims.claim(kNmtId, "the NMT command");
  claims.claim(kSyncId, "SYNC");
  const int master_node = cia402_settings(config).master_node;
  claims.claim(kHeartbeatBase + master_node, "the master's heartbeat");
  for (const AxisConfig& axis : config.axes) {
    for (const uint32_t base : {kEmergencyBase, kSdoAnswerBase, kSdoRequestBase, kHeartbeatBase})
      claims.claim(base + axis.node, label(axis));
    claims.claim(rpdo_cob_id(axis), label(axis));
    claims.claim(tpdo_cob_id(axis), label(axis));
  }
  // No sensor may use an identifier that CiA 301 gives a node, even if the node does not use it.
  for (const AxisConfig& axis : config.axes)
    for (const uint32_t id : {rpdo_cob_id(axis), tpdo_cob_id(axis)})
      claims.reserve(id, "that of a PDO of the drive of '" + axis.name + "'");
  const auto name_node = [&claims](int node) {
    for (const auto& [base, name] : kPredefined)
      claims.reserve(base + node, std::string(name) + " of node " + std::to_string(node));
  };
  for (const AxisConfig& axis : config.axes) name_node(axis.node);
  name_node(master_node);
  claims.claim_sensors(config);
}

SdoStep write(int index, int sub, int size, uint32_t value) {
  return {{SdoRequest::Kind::kWrite, {static_cast<uint16_t>(index), static_cast<uint8_t>(sub)}, size, value},
          0};
}

SdoStep read(int index, int sub, uint32_t expected, uint32_t mask = 0xFFFF'FFFF) {
  return {{SdoRequest::Kind::kRead, {static_cast<uint16_t>(index), static_cast<uint8_t>(sub)}, 0, 0},
          expected,
          mask};
}

/// The mode in which a drive follows the set-points of the controller.
int8_t following_mode(const AxisConfig& axis) noexcept {
  return axis.set_point == SetPoint::kEffort ? kModeCyclicTorque : kModeCyclicPosition;
}

/// At least one count, and not 0xFFFFFFFF, which is no window at all.
uint32_t following_error_window(const AxisConfig& axis) {
  const double counts = cia402_settings(axis).following_error / std::abs(axis.scale.displacement_per_count());
  return static_cast<uint32_t>(std::clamp(std::round(counts), 1.0, double{0xFFFF'FFFE}));
}

/// Mode of operation, and the drive must show it in 6061.
void append_mode(std::vector<SdoStep>& steps, int8_t mode) {
  steps.push_back(write(0x6060, 0, 1, static_cast<uint8_t>(mode)));
  steps.push_back(read(0x6061, 0, static_cast<uint8_t>(mode)));
}

/// The object is optional; in many drives the exponent is -3, and may not be written even with that.
void append_period(std::vector<SdoStep>& steps, InterpolationPeriod period) {
  for (SdoStep step :
       {write(0x60C2, 1, 1, period.value), write(0x60C2, 2, 1, static_cast<uint8_t>(period.exponent))}) {
    step.only_if_different = true;
    step.tolerance = Tolerance::kMissingObject;
    steps.push_back(step);
  }
}

// Bit of the COB-ID of a TPDO. Tendril makes no remote requests; drives that serve none may refuse 0.
constexpr uint32_t kNoRemoteRequest = 0x4000'0000;

/// A PDO that is on and goes with every SYNC.
struct SyncedPdo {
  int communication, mapping;  // indices of its objects
  uint32_t cob_id, first, second;
};

/// Off, map emptied, map filled, every SYNC, on.
void append_writes(std::vector<SdoStep>& steps, const SyncedPdo& pdo) {
  steps.insert(steps.end(), {write(pdo.communication, 1, 4, kPdoInvalid | pdo.cob_id),
                             write(pdo.mapping, 0, 1, 0), write(pdo.mapping, 1, 4, pdo.first),
                             write(pdo.mapping, 2, 4, pdo.second), write(pdo.mapping, 0, 1, 2),
                             write(pdo.communication, 2, 1, 1), write(pdo.communication, 1, 4, pdo.cob_id)});
}

/// Checks for the same state.
void append_checks(std::vector<SdoStep>& steps, const SyncedPdo& pdo) {
  steps.insert(steps.end(), {read(pdo.communication, 1, pdo.cob_id & ~kNoRemoteRequest, ~kNoRemoteRequest),
                             read(pdo.communication, 2, 1), read(pdo.mapping, 0, 2),
                             read(pdo.mapping, 1, pdo.first), read(pdo.mapping, 2, pdo.second)});
}

}  // namespace

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

void check_cia402(const MasterConfig& config) {
  const Cia402BusSettings& bus = cia402_settings(config);
  if (bus.master_node < 1 || bus.master_node > 127) refuse_bus("master_node", "a node id from 1 to 127");
  check_common(config, config.period_ns, bus.master_node);
  if (to_ms(config.heartbeat_ns) < 1) refuse_bus("heartbeat", "at least 1 ms");
  if (to_ms(config.heartbeat_timeout_ns) > 0xFFFF) refuse_bus("heartbeat_timeout", "at most 65.535 s");
  if (bus.sdo_attempts < 1) throw std::invalid_argument("drives: there must be at least one SDO attempt");
  for (int i = 0; i < static_cast<int>(config.axes.size()); ++i) check_axis(config, i);
  check_identifiers(config);
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
  std::vector<SdoStep> steps = {write(0x1016, 1, 4,
                                      static_cast<uint32_t>(cia402_settings(config).master_node) << 16 |
                                          to_ms(config.heartbeat_timeout_ns)),
                                write(0x1017, 0, 2, to_ms(config.heartbeat_ns))};
  const uint32_t target = axis.set_point == SetPoint::kEffort ? kMapTargetTorque : kMapTargetPosition;
  for (const SyncedPdo& pdo :
       {SyncedPdo{0x1400 + number, 0x1600 + number, rpdo_cob_id(axis), kMapControlword, target},
        SyncedPdo{0x1800 + number, 0x1A00 + number, kNoRemoteRequest | tpdo_cob_id(axis), kMapStatusword,
                  kMapActualPosition}})
    cia402_settings(axis).mapping == Mapping::kConfigure ? append_writes(steps, pdo)
                                                         : append_checks(steps, pdo);
  append_mode(steps, following_mode(axis));
  append_period(steps, nearest_interpolation_period(config.period_ns));
  if (cia402_settings(axis).following_error > 0)
    steps.push_back(write(0x6065, 0, 4, following_error_window(axis)));
  return steps;
}

std::vector<SdoStep> homing_steps(const AxisConfig& axis) {
  const HomingConfig& homing = cia402_settings(axis).homing;
  std::vector<SdoStep> steps;
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

std::vector<SdoStep> following_steps(const AxisConfig& axis) {
  std::vector<SdoStep> steps;
  append_mode(steps, following_mode(axis));
  if (const auto limits = soft_limits(axis)) {
    // A drive that compares both may refuse a least limit above its present greatest one. So the least is
    // written again after the greatest.
    SdoStep least = write(kSoftLimits, 1, 4, 0);
    least.tolerance = Tolerance::kAny;
    steps.insert(steps.end(), {least, write(kSoftLimits, 2, 4, 0), write(kSoftLimits, 1, 4, 0)});
    set_soft_limits(steps, *limits);
  }
  return steps;
}

void set_soft_limits(std::span<SdoStep> steps, SoftLimits limits) noexcept {
  for (SdoStep& step : steps)
    if (step.request.object.index == kSoftLimits)
      step.request.value = static_cast<uint32_t>(step.request.object.sub == 1 ? limits.min : limits.max);
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
