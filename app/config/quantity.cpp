// SPDX-License-Identifier: Apache-2.0
#include "app/config/quantity.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

namespace tendril::app {
namespace {

/// One value in this unit is multiply / divide in SI. Two exact factors rather than one rounded: 35 / 1000 is
/// the double nearest to 0.035, 35 * 0.001 is not.
struct Unit {
  std::string_view name;
  Dimension dimension;
  double multiply = 1;
  double divide = 1;
};

constexpr std::array kUnits = {
    Unit{"m", Dimension::kLength},
    Unit{"cm", Dimension::kLength, 1, 100},
    Unit{"mm", Dimension::kLength, 1, 1e3},
    Unit{"um", Dimension::kLength, 1, 1e6},
    Unit{"s", Dimension::kTime},
    Unit{"ms", Dimension::kTime, 1, 1e3},
    Unit{"us", Dimension::kTime, 1, 1e6},
    Unit{"Hz", Dimension::kRate},
    Unit{"kHz", Dimension::kRate, 1e3},
    Unit{"bit/s", Dimension::kBitRate},
    Unit{"kbit/s", Dimension::kBitRate, 1e3},
    Unit{"Mbit/s", Dimension::kBitRate, 1e6},
    Unit{"1/s", Dimension::kInverseTime},
    Unit{"kg", Dimension::kMass},
    Unit{"g", Dimension::kMass, 1, 1e3},
    Unit{"N", Dimension::kForce},
    Unit{"mN", Dimension::kForce, 1, 1e3},
    Unit{"kN", Dimension::kForce, 1e3},
    Unit{"Pa", Dimension::kPressure},
    Unit{"kPa", Dimension::kPressure, 1e3},
    Unit{"MPa", Dimension::kPressure, 1e6},
    Unit{"m/s", Dimension::kSpeed},
    Unit{"mm/s", Dimension::kSpeed, 1, 1e3},
    Unit{"m/s^2", Dimension::kAcceleration},
    Unit{"mm/s^2", Dimension::kAcceleration, 1, 1e3},
    Unit{"m/s^3", Dimension::kJerk},
    Unit{"mm/s^3", Dimension::kJerk, 1, 1e3},
    Unit{"rad", Dimension::kAngle},
    Unit{"deg", Dimension::kAngle, std::numbers::pi, 180},
    Unit{"m^3", Dimension::kVolume},
    Unit{"l", Dimension::kVolume, 1, 1e3},
    Unit{"ml", Dimension::kVolume, 1, 1e6},
    Unit{"cm^3", Dimension::kVolume, 1, 1e6},
    Unit{"mm^3", Dimension::kVolume, 1, 1e9},
    Unit{"m^3/s", Dimension::kFlow},
    Unit{"l/s", Dimension::kFlow, 1, 1e3},
    Unit{"ml/s", Dimension::kFlow, 1, 1e6},
    Unit{"l/min", Dimension::kFlow, 1, 6e4},
    Unit{"ml/min", Dimension::kFlow, 1, 6e7},
    Unit{"rev/s", Dimension::kTurnRate},
    Unit{"rpm", Dimension::kTurnRate, 1, 60},
    Unit{"A", Dimension::kCurrent},
    Unit{"mA", Dimension::kCurrent, 1, 1e3},
    Unit{"Nm", Dimension::kTorque},
    Unit{"mNm", Dimension::kTorque, 1, 1e3},
};

/// How a dimension is called, and what its values may be, in SI units: far beyond any robot, and far within
/// what nanoseconds and counts hold.
struct DimensionTraits {
  std::string_view one, many;
  double least, greatest;
};

DimensionTraits traits_of(Dimension dimension) {
  switch (dimension) {
    case Dimension::kNumber:
      return {"a number", "numbers", 0, 1e12};
    case Dimension::kLength:
      return {"a length", "lengths", 1e-9, 1e3};
    case Dimension::kTime:
      return {"a duration", "durations", 1e-6, 1e6};
    case Dimension::kRate:
      return {"a rate", "rates", 1e-3, 1e6};
    case Dimension::kBitRate:
      return {"a bit rate", "bit rates", 1, 1e9};
    case Dimension::kInverseTime:
      return {"an inverse time", "inverse times", 1e-6, 1e6};
    case Dimension::kMass:
      return {"a mass", "masses", 1e-9, 1e6};
    case Dimension::kForce:
      return {"a force", "forces", 1e-9, 1e6};
    case Dimension::kPressure:
      return {"a pressure", "pressures", 1e-6, 1e12};
    case Dimension::kSpeed:
      return {"a speed", "speeds", 1e-9, 1e3};
    case Dimension::kAcceleration:
      return {"an acceleration", "accelerations", 1e-6, 1e4};
    case Dimension::kJerk:
      return {"a jerk", "jerks", 1e-6, 1e6};
    case Dimension::kAngle:
      return {"an angle", "angles", 1e-9, 1e3};
    case Dimension::kVolume:
      return {"a volume", "volumes", 1e-15, 1e3};
    case Dimension::kFlow:
      return {"a flow", "flows", 1e-15, 1e3};
    case Dimension::kTurnRate:
      return {"a turn rate", "turn rates", 1e-6, 1e5};
    case Dimension::kCurrent:
      return {"a current", "currents", 1e-6, 1e4};
    case Dimension::kTorque:
      return {"a torque", "torques", 1e-9, 1e6};
  }
  return {"a value", "values", 0, 1e12};
}

constexpr std::string_view kBlanks = " \t";

/// Takes the first word off the text; empty at its end.
std::string_view take_word(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(kBlanks));
  text.remove_prefix(word.size());
  return word;
}

/// std::from_chars is the one standard parser that no locale can turn into reading "0,45".
bool parse_number(std::string_view word, double& out) {
  const char* const end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, out);
  return error == std::errc() && stop == end && std::isfinite(out);
}

}  // namespace

bool parse_quantity(std::string_view text, Dimension dimension, std::span<double> out) {
  for (double& number : out) {
    if (!parse_number(take_word(text), number)) return false;
  }
  if (dimension != Dimension::kNumber) {
    const auto unit = std::ranges::find(kUnits, take_word(text), &Unit::name);
    if (unit == kUnits.end() || unit->dimension != dimension) return false;
    for (double& number : out) {
      number = number * unit->multiply / unit->divide;
      if (!std::isfinite(number)) return false;
    }
  }
  return take_word(text).empty();
}

std::string units_of(Dimension dimension) {
  std::string list;
  for (const Unit& unit : kUnits) {
    if (unit.dimension == dimension)
      fmt::format_to(std::back_inserter(list), "{}{}", list.empty() ? "" : ", ", unit.name);
  }
  return list;
}

Magnitudes magnitudes_of(Dimension dimension) {
  const DimensionTraits traits = traits_of(dimension);
  return {traits.least, traits.greatest};
}

std::string_view si_unit(Dimension dimension) {
  const auto unit = std::ranges::find(kUnits, dimension, &Unit::dimension);
  return unit == kUnits.end() ? std::string_view() : unit->name;
}

std::string describe_quantity(std::size_t count, Dimension dimension) {
  constexpr std::array<std::string_view, 5> kCounts = {"no", "one", "two", "three", "four"};
  const DimensionTraits noun = traits_of(dimension);
  std::string text(noun.one);
  if (count != 1) {
    text = fmt::format("{} {}", count < kCounts.size() ? kCounts[count] : std::to_string(count), noun.many);
  }
  if (dimension == Dimension::kNumber) return text;
  text += fmt::format(" ({}), as in '", units_of(dimension));
  for (std::size_t number = 1; number <= count; ++number) text += fmt::format("{} ", number);
  return text.append(si_unit(dimension)).append("'");
}

}  // namespace tendril::app
