// SPDX-License-Identifier: Apache-2.0
#include "app/config/plant_fault.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "app/config/config.h"
#include "app/config/plant_fault_parser.h"
#include "app/config/quantity.h"
#include "app/plant/plant_line.h"
#include "hal/bus/virtual_bus.h"
#include "hal/cia402/cia402_protocol.h"
#include "hal/odrive/odrive_protocol.h"

using namespace tendril;
namespace tendril::app::plant_fault_test {
using Catch::Matchers::Contains;
using Kind = PlantFaultKind;

Config robot(const hal::DriveProtocol& protocol) {
  Config config;
  config.bus.master.protocol = &protocol;
  config.actuators.resize(2);
  config.actuators[0].name = "north";
  config.actuators[1].name = "air";
  config.actuators[1].kind = CavityConfig{};
  config.sensors.resize(2);
  config.sensors[0].frame.name = "camera";
  config.sensors[1].frame.name = "gauge";
  return config;
}

PlantFault parse(const std::string& line, const hal::DriveProtocol& protocol = hal::cia402_protocol()) {
  return parse_plant_fault(line, robot(protocol));
}

std::string mistake(const std::string& line, const hal::DriveProtocol& protocol = hal::cia402_protocol()) {
  try {
    parse(line, protocol);
  } catch (const PlantFaultMistake& thrown) {
    return thrown.what();
  }
  return "none";
}

TEST_CASE("Each line of the help is read as the fault that it names", "[unit]") {
  struct Row {
    const char* line;
    Kind kind;
    int axis;
    double value;
  };
  for (const Row& row :
       {Row{"fault air emcy 0x2310", Kind::kDriveFault, 1, 0x2310},
        Row{"  heartbeat  north\toff ", Kind::kSilent, 0, 0}, Row{"stuck air", Kind::kStuck, 1, 0},
        Row{"cut north", Kind::kCut, 0, 0}, Row{"delay 5 ms", Kind::kDelay, -1, 0.005},
        Row{"drop 10 %", Kind::kDrop, -1, 0.1}, Row{"noise 0.2 mm", Kind::kNoise, -1, 0.0002},
        Row{"noise 3 mN", Kind::kForceNoise, -1, 0.003}, Row{"noise 2 kPa", Kind::kPressureNoise, -1, 2000},
        Row{"sensor gauge off", Kind::kSensorSilent, 1, 0}, Row{"bus off", Kind::kBusOff, -1, 0},
        Row{"clear", Kind::kClear, -1, 0}}) {
    CAPTURE(row.line);
    const PlantFault fault = parse(row.line);
    CHECK(fault.kind == row.kind);
    CHECK(fault.axis == row.axis);
    CHECK(fault.value == Approx(row.value));
  }
  CHECK(parse("fault north error 0x40000000", hal::odrive_protocol()).value == 0x40000000);
}

TEST_CASE("A line that is no fault is answered with what is expected", "[unit]") {
  CHECK_THAT(mistake("explode"), Contains("one of 'fault AXIS emcy CODE'") && Contains("'clear'"));
  CHECK_THAT(mistake(""), Contains("one of"));
  CHECK_THAT(mistake("stuck"), Contains("the name of an actuator (north, air), as in 'stuck AXIS'"));
  CHECK_THAT(mistake("cut air"), Contains("an actuator that is a cable"));
  CHECK_THAT(mistake("fault north emcy 0"), Contains("a code from 0x1 to 0xFFFF"));
  CHECK_THAT(mistake("fault north emcy 0x10000"), Contains("a code from 0x1 to 0xFFFF"));
  CHECK_THAT(mistake("fault north emcy 0x2310", hal::odrive_protocol()), Contains("'error'"));
  CHECK_THAT(mistake("drop 101 %"), Contains("a share from 0 % to 100 %"));
  CHECK_THAT(mistake("drop 10"), Contains("a share"));
  CHECK_THAT(mistake("delay 5"), Contains("a delay of 0, or 1e-06 to 1 s (s, ms, us), as in 'delay TIME'"));
  CHECK_THAT(mistake("noise 2 ms"),
             Contains("a length, force or pressure: 0, or 1e-09 to 1000 m (m, cm, mm, um); 0, or 1e-09 to") &&
                 Contains("as in 'noise SIZE'"));
  CHECK_THAT(mistake("sensor north off"),
             Contains("the name of a sensor (camera, gauge), as in 'sensor SENSOR off'"));
  CHECK_THAT(mistake("bus on"), Contains("'off'"));
  CHECK_THAT(mistake("clear all"), Contains("the end of the line"));
}

TEST_CASE("Every number of a fault has a least and a greatest value", "[unit]") {
  struct Row {
    const char* before;
    const char* unit;
    double least, greatest;
  };
  const auto [shortest, longest] = magnitudes_of(Dimension::kLength);
  const auto [weakest, strongest] = magnitudes_of(Dimension::kForce);
  const auto [lowest, highest] = magnitudes_of(Dimension::kPressure);
  for (const Row& row :
       {Row{"delay", "s", magnitudes_of(Dimension::kTime).least, 1}, Row{"noise", "m", shortest, longest},
        Row{"noise", "N", weakest, strongest}, Row{"noise", "Pa", lowest, highest}}) {
    const auto line = [&](double value) { return fmt::format("{} {:.17g} {}", row.before, value, row.unit); };
    CAPTURE(line(row.greatest));
    for (const double taken : {0.0, row.least, row.greatest}) {
      CHECK(mistake(line(taken)) == "none");
      CHECK(parse(line(taken)).value == taken);
    }
    for (const double refused : {-row.least, row.least / 2, std::nextafter(row.greatest, 1e300), 1e300})
      CHECK_THAT(mistake(line(refused)), Contains(fmt::format("to {:g} {}", row.greatest, row.unit)));
  }
  CHECK(parse("drop 0 %").value == 0);
  CHECK(parse("drop 100 %").value == 1);
  for (const char* refused : {"drop -1 %", "drop 100.1 %", "drop 1e300 %"})
    CHECK_THAT(mistake(refused), Contains("a share from 0 % to 100 %"));
}

TEST_CASE("Delayed frames come in their order after the delay, and at once when it ends", "[unit]") {
  hal::VirtualBus bus;
  hal::VirtualEndpoint& robot = bus.attach("robot");
  hal::VirtualEndpoint& other = bus.attach("other");
  PlantLine line;
  hal::Frame frame;
  line.set_delay(5'000);
  line.send(robot, std::vector<hal::Frame>{{.id = 1}, {.id = 2}}, 0);
  line.release(robot, 4'999);
  CHECK_FALSE(other.receive(frame));
  line.release(robot, 5'000);
  REQUIRE(other.receive(frame));
  CHECK(frame.id == 1);
  REQUIRE(other.receive(frame));
  CHECK(frame.id == 2);
  line.send(robot, std::vector<hal::Frame>{{.id = 3}}, 6'000);
  line.set_delay(0);
  line.send(robot, std::vector<hal::Frame>{{.id = 4}}, 6'001);
  REQUIRE(other.receive(frame));
  CHECK(frame.id == 3);
  REQUIRE(other.receive(frame));
  CHECK(frame.id == 4);
}

TEST_CASE("As many frames are lost as were asked for, both ways, and the same ones every time", "[unit]") {
  const auto heard = [](double loss) {
    hal::VirtualBus bus;
    hal::VirtualEndpoint& robot = bus.attach("robot");
    hal::VirtualEndpoint& other = bus.attach("other");
    PlantLine line;
    line.set_loss(loss);
    std::vector<uint32_t> ids;
    for (uint32_t id = 0; id < 1000; ++id) {
      line.send(robot, std::vector<hal::Frame>{{.id = id}}, id);
      hal::Frame frame;
      if (other.receive(frame) && line.hears()) ids.push_back(frame.id);
    }
    return ids;
  };
  CHECK(heard(0).size() == 1000);
  CHECK(heard(1).empty());
  CHECK(static_cast<double>(heard(0.1).size()) == Approx(810).margin(40));
  CHECK(heard(0.1) == heard(0.1));
}

}  // namespace tendril::app::plant_fault_test
