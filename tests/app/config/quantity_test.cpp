// SPDX-License-Identifier: Apache-2.0
#include "app/config/quantity.h"

#include <array>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <limits>
#include <locale>
#include <numbers>
#include <random>

namespace tendril::app::quantity_test {

/// One quantity in SI; fails the test where it is refused.
double si(const std::string& text, Dimension dimension) {
  INFO(text);
  double value = 0;
  REQUIRE(parse_quantity(text, dimension, {&value, 1}));
  return value;
}

bool refused(std::string_view text, Dimension dimension, std::size_t count = 1) {
  std::array<double, 3> values = {};
  return !parse_quantity(text, dimension, std::span(values).first(count));
}

struct UnitCase {
  const char* unit;
  Dimension dimension;
  double si;
};

const UnitCase kUnits[] = {{"m", Dimension::kLength, 1},
                           {"cm", Dimension::kLength, 1e-2},
                           {"mm", Dimension::kLength, 1e-3},
                           {"um", Dimension::kLength, 1e-6},
                           {"s", Dimension::kTime, 1},
                           {"ms", Dimension::kTime, 1e-3},
                           {"us", Dimension::kTime, 1e-6},
                           {"Hz", Dimension::kRate, 1},
                           {"kHz", Dimension::kRate, 1e3},
                           {"bit/s", Dimension::kBitRate, 1},
                           {"kbit/s", Dimension::kBitRate, 1e3},
                           {"Mbit/s", Dimension::kBitRate, 1e6},
                           {"1/s", Dimension::kInverseTime, 1},
                           {"kg", Dimension::kMass, 1},
                           {"g", Dimension::kMass, 1e-3},
                           {"N", Dimension::kForce, 1},
                           {"mN", Dimension::kForce, 1e-3},
                           {"kN", Dimension::kForce, 1e3},
                           {"Pa", Dimension::kPressure, 1},
                           {"kPa", Dimension::kPressure, 1e3},
                           {"MPa", Dimension::kPressure, 1e6},
                           {"m/s", Dimension::kSpeed, 1},
                           {"mm/s", Dimension::kSpeed, 1e-3},
                           {"m/s^2", Dimension::kAcceleration, 1},
                           {"mm/s^2", Dimension::kAcceleration, 1e-3},
                           {"m/s^3", Dimension::kJerk, 1},
                           {"mm/s^3", Dimension::kJerk, 1e-3},
                           {"rad", Dimension::kAngle, 1},
                           {"deg", Dimension::kAngle, std::numbers::pi / 180},
                           {"m^3", Dimension::kVolume, 1},
                           {"l", Dimension::kVolume, 1e-3},
                           {"ml", Dimension::kVolume, 1e-6},
                           {"cm^3", Dimension::kVolume, 1e-6},
                           {"mm^3", Dimension::kVolume, 1e-9},
                           {"m^3/s", Dimension::kFlow, 1},
                           {"l/s", Dimension::kFlow, 1e-3},
                           {"ml/s", Dimension::kFlow, 1e-6},
                           {"l/min", Dimension::kFlow, 1 / 6e4},
                           {"ml/min", Dimension::kFlow, 1 / 6e7},
                           {"rev/s", Dimension::kTurnRate, 1},
                           {"rpm", Dimension::kTurnRate, 1.0 / 60},
                           {"A", Dimension::kCurrent, 1},
                           {"mA", Dimension::kCurrent, 1e-3},
                           {"Nm", Dimension::kTorque, 1},
                           {"mNm", Dimension::kTorque, 1e-3}};

/// A locale in which numbers look like 1.234,5.
struct CommaLocale : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

/// Sets the global locale for one scope.
class GlobalLocale {
 public:
  explicit GlobalLocale(const std::locale& locale) : before_(std::locale::global(locale)) {}
  ~GlobalLocale() { std::locale::global(before_); }
  GlobalLocale(const GlobalLocale&) = delete;
  GlobalLocale& operator=(const GlobalLocale&) = delete;

 private:
  std::locale before_;
};

TEST_CASE("Every unit has its value in SI and belongs to one dimension alone", "[law]") {
  std::array<std::string, 18> listed;
  for (const UnitCase& unit : kUnits) {
    const std::string text = std::string("1 ") + unit.unit;
    CHECK(si(text, unit.dimension) == unit.si);
    for (const UnitCase& other : kUnits) {
      INFO(text << " read as " << other.unit);
      CHECK(refused(text, other.dimension) == (other.dimension != unit.dimension));
    }
    CHECK(refused(text, Dimension::kNumber));
    std::string& list = listed.at(std::size_t(unit.dimension));
    list += (list.empty() ? "" : ", ") + std::string(unit.unit);
  }
  for (std::size_t d = 0; d < listed.size(); ++d) CHECK(units_of(Dimension(d)) == listed[d]);
}

TEST_CASE("A whole number of any decimal unit becomes the double that its SI value is nearest to", "[law]") {
  const unsigned seed = Catch::rngSeed() + 1;
  CAPTURE(seed);
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> numbers(-1'000'000, 1'000'000);
  const std::pair<const char*, const char*> kExponents[] = {
      {"m", ""}, {"cm", "e-2"}, {"mm", "e-3"}, {"um", "e-6"}};
  for (int i = 0; i < 1000; ++i) {
    const std::string number = std::to_string(numbers(random));
    for (const auto& [unit, exponent] : kExponents) {
      CHECK(si(number + " " + unit, Dimension::kLength) == std::strtod((number + exponent).c_str(), nullptr));
    }
    CHECK(si(number + " MPa", Dimension::kPressure) == std::strtod((number + "e6").c_str(), nullptr));
  }
  CHECK(si("35 mm", Dimension::kLength) == 0.035);
  CHECK(si("150 kPa", Dimension::kPressure) == 150e3);
  CHECK(si("180 deg", Dimension::kAngle) == std::numbers::pi);
}

TEST_CASE("A quantity has exactly the numbers that are asked for", "[unit]") {
  std::array<double, 3> p = {};
  REQUIRE(parse_quantity("0 -2.5 125 mm", Dimension::kLength, p));
  CHECK(p == std::array<double, 3>{0, -0.0025, 0.125});
  REQUIRE(parse_quantity("  1e-3 \t 2E+1   .5 ", Dimension::kNumber, p));
  CHECK(p == std::array<double, 3>{1e-3, 20, 0.5});
  CHECK(refused("0 125 mm", Dimension::kLength, 3));
  CHECK(refused("0 0 0 125 mm", Dimension::kLength, 3));
  CHECK(refused("1 2", Dimension::kNumber, 1));
  CHECK(refused("1", Dimension::kNumber, 2));
  CHECK(si("2 1/s", Dimension::kInverseTime) == 2);
}

TEST_CASE("Anything but finite decimal numbers and one unit is refused", "[unit]") {
  for (const char* text :
       {"",         " ",       "mm",     "5",          "5mm",         "5 mm mm",  "5 mm 1",
        "5 mmm",    "5 MM",    "5, mm",  "0x10 mm",    "+5 mm",       "- 5 mm",   "5.0.1 mm",
        "1e mm",    "nan mm",  "inf mm", "-inf mm",    "infinity mm", "1e999 mm", "1,5 mm",
        "1_000 mm", "five mm", "5 mm\n", "5\xC2\xA0mm"}) {
    INFO("'" << text << "'");
    CHECK(refused(text, Dimension::kLength));
  }
  CHECK(refused("1e308 kN", Dimension::kForce));
  CHECK(refused(std::string_view("5\0 mm", 5), Dimension::kLength));
  CHECK(refused("nan", Dimension::kNumber));
}

TEST_CASE("The locale changes nothing about numbers", "[unit]") {
  const GlobalLocale german(std::locale(std::locale::classic(), new CommaLocale));
  CHECK(si("0.45", Dimension::kNumber) == 0.45);
  CHECK(si("1234.5 mm", Dimension::kLength) == 1.2345);
  CHECK(refused("0,45", Dimension::kNumber));
  CHECK(refused("1.234,5 mm", Dimension::kLength));
}

TEST_CASE("A description of a quantity says how many, of what, in which units, and is itself an example",
          "[unit]") {
  CHECK(describe_quantity(2, Dimension::kForce) == "two forces (N, mN, kN), as in '1 2 N'");
  CHECK(describe_quantity(1, Dimension::kPressure) == "a pressure (Pa, kPa, MPa), as in '1 Pa'");
  CHECK(describe_quantity(1, Dimension::kNumber) == "a number");
  for (const UnitCase& unit : kUnits) {
    const std::string text = describe_quantity(3, unit.dimension);
    const std::size_t example = text.find('\'') + 1;
    INFO(text);
    CHECK_FALSE(refused(text.substr(example, text.size() - example - 1), unit.dimension, 3));
  }
}

}  // namespace tendril::app::quantity_test
