// SPDX-License-Identifier: Apache-2.0
#include "app/jog/jog_options.h"

#include <fmt/format.h>

#include <cmath>
#include <span>

#include "app/config/config_error.h"
#include "app/config/quantity.h"
#include "app/robot/robot.h"

namespace tendril::app {
namespace {

double parse(const char* option, const std::string& text, Dimension dimension, double otherwise) {
  if (text.empty()) return otherwise;
  double value = 0;
  if (!parse_quantity(text, dimension, std::span(&value, 1)))
    throw ConfigError(
        fmt::format("{}: found '{}', expected {}", option, text, describe_quantity(1, dimension)));
  return value;
}

}  // namespace

JogConfig jog_config(const JogOptions& options, const ActuatorConfig& actuator, double period_s) {
  const bool cavity = actuator.is_cavity();
  const Dimension way = cavity ? Dimension::kVolume : Dimension::kLength;
  const hal::DisplacementUnit unit = displacement_unit(actuator);
  JogConfig jog;
  jog.distance = parse("--by", options.by, way, 0);
  jog.speed = parse("--speed", options.speed, cavity ? Dimension::kFlow : Dimension::kSpeed,
                    0.01 * actuator.top_rate);
  jog.lag = parse("--lag", options.lag, way, 1 / unit.per_si);
  jog.least = actuator.displacement_min;
  jog.greatest = actuator.displacement_max;
  jog.period_s = period_s;
  const double limit = parse("--limit", options.limit, way, 5 / unit.per_si);
  if (!(std::abs(jog.distance) <= limit))
    throw ConfigError(
        fmt::format("--by: found {}, expected at most {:g} {} either way; a greater --limit allows "
                    "more",
                    options.by, unit.per_si * limit, unit.name));
  if (!(jog.speed > 0 && jog.speed <= actuator.top_rate))
    throw ConfigError(
        fmt::format("--speed: found {:g} {}/s, expected more than 0 and at most the actuator's top "
                    "rate, {:g} {}/s",
                    unit.per_si * jog.speed, unit.name, unit.per_si * actuator.top_rate, unit.name));
  if (!(jog.lag > 0)) throw ConfigError("--lag: expected more than 0");
  return jog;
}

}  // namespace tendril::app
