// SPDX-License-Identifier: Apache-2.0
#include "app/robot/place.h"

#include <fmt/format.h>

namespace tendril::app {
namespace {

Place place_of_kind(const CableConfig& cable) { return {"cable", cable.points.front().line}; }
Place place_of_kind(const RodConfig& rod) { return {"rod", rod.from.line}; }
Place place_of_kind(const ForceConfig& force) { return {"push", force.at.line}; }
Place place_of_kind(const CavityConfig& filled) { return {"cavity", filled.region.line}; }

std::vector<PointConfig> points_of_kind(const CableConfig& cable) { return cable.points; }
std::vector<PointConfig> points_of_kind(const RodConfig& rod) { return {rod.from, rod.to}; }
std::vector<PointConfig> points_of_kind(const ForceConfig& force) { return {force.at}; }
std::vector<PointConfig> points_of_kind(const CavityConfig&) { return {}; }

std::string key_of(const char* list, int index, const char* key, const std::string& name) {
  return fmt::format("{}[{}].{} ({})", list, index, key, name);
}

}  // namespace

Place place_of(const ActuatorConfig& actuator) {
  return std::visit([](const auto& kind) { return place_of_kind(kind); }, actuator.kind);
}

Place place_of(const EffectorConfig& effector) {
  if (effector.cavity) return {"cavity", effector.cavity->line};
  return {effector.points.size() == 1 ? "point" : "points", effector.points.front().line};
}

std::vector<PointConfig> points_of(const ActuatorConfig& actuator) {
  return std::visit([](const auto& kind) { return points_of_kind(kind); }, actuator.kind);
}

std::string actuator_key(const Config& config, int index, const char* key) {
  return key_of("actuators", index, key, config.actuators[static_cast<std::size_t>(index)].name);
}

std::string effector_key(const Config& config, int index, const char* key) {
  return key_of("effectors", index, key, config.effectors[static_cast<std::size_t>(index)].name);
}

}  // namespace tendril::app
