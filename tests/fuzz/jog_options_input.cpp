// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "app/config/config_error.h"
#include "app/jog/jog_options.h"
#include "tests/fuzz/inputs.h"

namespace tendril::fuzz {
namespace {

/// Jogs an actuator whose drive follows at once, for a time that most jogs do not need.
/// @param start  where it stands
void jog_it(const app::JogConfig& config, double start) {
  app::Jog jog(config);
  hal::Measurement measurement;
  measurement.axes = 1;
  measurement.all_known = true;
  measurement.displacement[0] = start;
  constexpr double kRounding = 1e-8;  // of the range
  const double slack = kRounding * (config.greatest - config.least);
  for (int k = 0; k < 2000; ++k) {
    const rt::Decision& decision = jog.step(measurement, nullptr, nullptr, {.stop_requested = k > 1900});
    const double commanded = decision.command.displacement[0];
    must(std::isfinite(commanded), "a jog commands finite displacements");
    must(!decision.command.enable || (commanded >= std::min(config.least, start) - slack &&
                                      commanded <= std::max(config.greatest, start) + slack),
         "a jog stays within the limits");
    measurement.all_enabled = decision.command.enable;
    measurement.finished = decision.command.finish;
    if (measurement.all_enabled) measurement.displacement[0] = commanded;
  }
  must(jog.ending() != app::Jog::Ending::kDriveFault, "a jog tells of no fault that is not there");
}

app::ActuatorConfig actuator_of(bool cavity) {
  app::ActuatorConfig actuator;
  if (cavity) actuator.kind = app::CavityConfig{};
  actuator.displacement_min = cavity ? -1e-6 : -0.025;
  actuator.displacement_max = cavity ? 20e-6 : 0.035;
  actuator.top_rate = cavity ? 10e-6 : 0.1;
  return actuator;
}

}  // namespace

/// Each option on a line of its own: --by, --speed, --limit, --lag.
bool feed_jog_options(const std::string& bytes) {
  app::JogOptions options;
  std::string_view left = bytes;
  for (std::string* option : {&options.by, &options.speed, &options.limit, &options.lag}) {
    const std::string_view line = left.substr(0, left.find('\n'));
    *option = line;
    left.remove_prefix(std::min(left.size(), line.size() + 1));
  }
  bool taken = false;
  for (const bool cavity : {false, true}) {
    const app::ActuatorConfig actuator = actuator_of(cavity);
    try {
      const app::JogConfig config = app::jog_config(options, actuator, 1 / 600.0);
      must(config.speed > 0 && config.speed <= actuator.top_rate, "a jog is no faster than the actuator");
      for (const double start : {0.0, actuator.displacement_max}) jog_it(config, start);
      taken = true;
    } catch (const app::ConfigError&) {
    }
  }
  return taken;
}

}  // namespace tendril::fuzz
