#include "hal/bus/bus_budget.h"

#include <cmath>

namespace tendril::hal {

int worst_case_bits(int length, bool extended) noexcept {
  const int g = extended ? 54 : 34;  // bits before the data and of the CRC that are subject to stuffing
  const int stuffed = g + 8 * length;
  return stuffed + 13 + (stuffed - 1) / 4;
}

double bus_load(std::span<const PeriodicFrames> traffic, double bitrate) noexcept {
  double bits_per_second = 0;
  for (const PeriodicFrames& frames : traffic)
    bits_per_second += frames.count * frames.rate_hz * worst_case_bits(frames.length, frames.extended);
  return bits_per_second / bitrate;
}

BusBudget judge_bus(std::span<const PeriodicFrames> traffic, double bitrate) {
  BusBudget budget;
  budget.load = bus_load(traffic, bitrate);
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
