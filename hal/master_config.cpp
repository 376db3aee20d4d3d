#include "hal/master_config.h"

#include <cstdio>
#include <map>
#include <stdexcept>

#include "hal/drives.h"

namespace tendril::hal {
namespace {

constexpr int64_t kMillisecond_ns = 1'000'000;

uint32_t to_ms(int64_t duration_ns) {
  return static_cast<uint32_t>((duration_ns + kMillisecond_ns / 2) / kMillisecond_ns);
}

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument("drives: " + what); }

void check_axis(const AxisConfig& axis, int master_node) {
  const std::string who = "axis '" + axis.name + "': ";
  if (axis.node < 1 || axis.node > 127)
    refuse(who + "node " + std::to_string(axis.node) + " is not within 1..127");
  if (axis.node == master_node) refuse(who + "node " + std::to_string(axis.node) + " is the master's own");
  if (!(axis.scale.counts_per_turn > 0)) refuse(who + "counts per turn must be positive");
  if (!(axis.scale.displacement_per_turn > 0)) refuse(who + "the displacement per turn must be positive");
  if (axis.pdo < 1 || axis.pdo > 4) refuse(who + "the PDO number must be within 1..4");
  if (axis.rpdo_cob_id() > 0x7FF || axis.tpdo_cob_id() > 0x7FF) refuse(who + "COB-IDs must fit 11 bits");
}

/// On CAN two nodes that send the same identifier destroy each other's frames.
void check_identifiers(const MasterConfig& config) {
  std::map<uint32_t, std::string> users;
  const auto claim = [&users](uint32_t id, const std::string& user) {
    const auto [first, free] = users.emplace(id, user);
    if (free) return;
    char text[8];
    std::snprintf(text, sizeof text, "0x%X", id);
    refuse(first->second + " and " + user + " would both use identifier " + text);
  };
  claim(kNmtId, "NMT");
  claim(kSyncId, "SYNC");
  claim(kHeartbeatBase + config.master_node, "the master's heartbeat");
  if (config.tracker_id != 0) claim(config.tracker_id, "the tracker");
  for (const AxisConfig& axis : config.axes) {
    const std::string who = "axis '" + axis.name + "' (node " + std::to_string(axis.node) + ")";
    for (const uint32_t base : {kEmergencyBase, kSdoAnswerBase, kSdoRequestBase, kHeartbeatBase})
      claim(base + axis.node, who);
    claim(axis.rpdo_cob_id(), who);
    claim(axis.tpdo_cob_id(), who);
  }
}

SdoStep write(int index, int sub, int size, uint32_t value) {
  return {{SdoRequest::Kind::kWrite, {static_cast<uint16_t>(index), static_cast<uint8_t>(sub)}, size, value},
          0};
}

/// Off, map emptied, map filled, every SYNC, on.
void append_pdo(std::vector<SdoStep>& steps, int communication, int mapping, uint32_t cob_id, uint32_t first,
                uint32_t second) {
  steps.insert(steps.end(),
               {write(communication, 1, 4, kPdoInvalid | cob_id), write(mapping, 0, 1, 0),
                write(mapping, 1, 4, first), write(mapping, 2, 4, second), write(mapping, 0, 1, 2),
                write(communication, 2, 1, 1), write(communication, 1, 4, cob_id)});
}

}  // namespace

void check(const MasterConfig& config) {
  if (config.axes.empty() || config.axes.size() > kMaxAxes)
    refuse("there must be 1.." + std::to_string(kMaxAxes) + " axes, not " +
           std::to_string(config.axes.size()));
  if (config.period_ns < 100'000 || config.period_ns > 1'000'000'000)
    refuse("the SYNC period must be within 0.1 ms..1 s");
  if (config.master_node < 1 || config.master_node > 127) refuse("the master's node must be within 1..127");
  if (to_ms(config.heartbeat_ns) < 1 || to_ms(config.heartbeat_timeout_ns) > 0xFFFF)
    refuse("heartbeats must be within 1 ms..65 s");
  if (config.heartbeat_timeout_ns <= config.heartbeat_ns)
    refuse("the heartbeat timeout must be longer than the time between heartbeats");
  if (config.sdo_attempts < 1) refuse("there must be at least one SDO attempt");
  if (config.tracker_id > 0x7FF) refuse("the tracker's identifier must fit 11 bits");
  for (const AxisConfig& axis : config.axes) check_axis(axis, config.master_node);
  check_identifiers(config);
}

std::vector<SdoStep> setup_steps(const AxisConfig& axis, const MasterConfig& config) {
  const int number = axis.pdo - 1;
  const InterpolationPeriod period = nearest_interpolation_period(config.period_ns);
  std::vector<SdoStep> steps = {
      write(0x1016, 1, 4,
            static_cast<uint32_t>(config.master_node) << 16 | to_ms(config.heartbeat_timeout_ns)),
      write(0x1017, 0, 2, to_ms(config.heartbeat_ns))};
  append_pdo(steps, 0x1400 + number, 0x1600 + number, axis.rpdo_cob_id(), 0x6040'0010, 0x607A'0020);
  append_pdo(steps, 0x1800 + number, 0x1A00 + number, axis.tpdo_cob_id(), 0x6041'0010, 0x6064'0020);
  steps.push_back(write(0x6060, 0, 1, kModeCyclicPosition));
  steps.push_back({{SdoRequest::Kind::kRead, {0x6061, 0}, 0, 0}, kModeCyclicPosition});
  steps.push_back(write(0x60C2, 1, 1, period.value));
  steps.push_back(write(0x60C2, 2, 1, static_cast<uint8_t>(period.exponent)));
  return steps;
}

std::vector<SdoStep> release_steps() { return {write(0x1016, 1, 4, 0)}; }

std::vector<PeriodicFrames> periodic_frames(const MasterConfig& config) {
  const int axes = static_cast<int>(config.axes.size());
  const double rate_hz = 1e9 / static_cast<double>(config.period_ns);
  std::vector<PeriodicFrames> frames = {
      {.length = 0, .rate_hz = rate_hz},                     // SYNC
      {.length = 6, .rate_hz = rate_hz, .count = 2 * axes},  // PDOs
      {.length = 1, .rate_hz = 1e9 / static_cast<double>(config.heartbeat_ns), .count = axes + 1}};
  if (config.tracker_id != 0) frames.push_back({.length = 8, .rate_hz = config.tracker_rate_hz});
  return frames;
}

}  // namespace tendril::hal
