// SPDX-License-Identifier: Apache-2.0
#include "hal/bus/bus_budget.h"

#include <cmath>

namespace tendril::hal {

double bus_load(Wire wire, std::span<const PeriodicFrames> traffic, double bitrate) noexcept {
  double bits_per_second = 0;
  for (const PeriodicFrames& frames : traffic)
    bits_per_second += frames.count * frames.rate_hz * worst_case_bits(wire, frames.length, frames.extended);
  return bits_per_second / bitrate;
}

BusBudget judge_bus(Wire wire, std::span<const PeriodicFrames> traffic, double bitrate) {
  BusBudget budget;
  budget.load = bus_load(wire, traffic, bitrate);
  budget.text =
      "the bus would be busy " + std::to_string(std::lround(budget.load * 100)) + " % of the time at worst";
  if (budget.load > 1) {
    budget.verdict = BusBudget::Verdict::kExceeds;
    budget.text += "; lower the control rate or raise the bit rate";
  } else if (budget.load > kTightLoad) {
    budget.verdict = BusBudget::Verdict::kTight;
    budget.text +=
        "; above 70 % frames wait for each other, so a lower control rate or a higher bit rate is advised";
  }
  return budget;
}

}  // namespace tendril::hal
