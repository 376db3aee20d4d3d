#include "hal/drive/master_config.h"

#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "hal/drive/drives.h"

namespace tendril::hal {
namespace {

void check_scale(const AxisConfig& axis) {
  const std::string who = "axis '" + axis.name + "': ";
  if (!(axis.scale.counts_per_turn > 0)) refuse_drives(who + "counts per turn must be positive");
  if (!(axis.scale.displacement_per_turn > 0))
    refuse_drives(who + "the displacement per turn must be positive");
}

void check_range(const AxisConfig& axis) {
  const std::string who = "axis '" + axis.name + "': ";
  if (!(axis.displacement_min <= axis.displacement_max))
    refuse_drives(who + "the least displacement must not exceed the greatest");
  const bool limited = std::isfinite(axis.displacement_min) && std::isfinite(axis.displacement_max);
  if (axis.set_point == SetPoint::kEffort && !limited)
    refuse_drives(who + "one that follows efforts must have limits of its displacement");
}

}  // namespace

void refuse_drives(const std::string& what) { throw std::invalid_argument("drives: " + what); }

std::string to_text(const AxisConfig& axis) {
  return "axis '" + axis.name + "' (node " + std::to_string(axis.node) + ")";
}

std::string name_of(const MasterConfig& config, int axis) {
  const AxisConfig& a = config.axes[axis];
  return "axis " + std::to_string(axis) + " '" + a.name + "' (node " + std::to_string(a.node) + ")";
}

void check_common(const MasterConfig& config) {
  if (config.axes.empty() || config.axes.size() > kMaxAxes)
    refuse_drives("there must be 1.." + std::to_string(kMaxAxes) + " axes, not " +
                  std::to_string(config.axes.size()));
  if (config.period_ns < 100'000 || config.period_ns > 1'000'000'000)
    refuse_drives("the control period must be within 0.1 ms..1 s");
  if (config.heartbeat_timeout_ns <= config.heartbeat_ns)
    refuse_drives("the heartbeat timeout must be longer than the time between heartbeats");
  check(config.sensors);
  for (const AxisConfig& axis : config.axes) {
    check_scale(axis);
    check_range(axis);
  }
}

void IdentifierClaims::claim(uint32_t id, const std::string& user) {
  const auto [first, free] = users_.emplace(id, user);
  if (free) return;
  char text[16];
  std::snprintf(text, sizeof text, "0x%X", id & ~kExtendedMark);
  refuse_drives(first->second + " and " + user + " would both use identifier " + text);
}

void IdentifierClaims::claim(const std::vector<SensorConfig>& sensors) {
  for (const SensorConfig& sensor : sensors)
    claim(marked_id(sensor.id, sensor.extended), "sensor '" + sensor.name + "'");
}

const std::string* IdentifierClaims::user(uint32_t id) const {
  const auto found = users_.find(id);
  return found == users_.end() ? nullptr : &found->second;
}

}  // namespace tendril::hal
