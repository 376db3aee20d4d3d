// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <numbers>

#include "tests/app/daemon/bus_listener.h"
#include "tests/app/program/programs.h"

// tendrilctl jog beside tendril-plant.

namespace tendril::app::jog_run_test {

constexpr double kCount_m = 2 * std::numbers::pi * 0.005 / 65536;  // of the finger's encoders
// How far the search for the zero goes past the switch while the machine stalls: at the speed below it takes
// 4 s for this.
constexpr double kPastSwitch_mm = 0.2;
// A drive that lags behind because the machine stalls is not let go, where that is not what is tested.
const std::string kPatientLag = "20 mm";
constexpr hal::ObjectAddress kPosition{0x6064, 0}, kStatusword{0x6041, 0};

double length_m(BusListener& listener, int node) {
  return kCount_m * static_cast<int32_t>(listener.read(node, kPosition).value_or(0));
}

hal::DriveState state(BusListener& listener, int node) {
  return hal::decode_statusword(static_cast<uint16_t>(listener.read(node, kStatusword).value_or(0)));
}

TEST_CASE("A jog moves its axis as far as asked, no other, and leaves it disabled", "[scenario]") {
  Workbench bench;
  BusListener listener(bench.bus(), {1, 2});
  const Ended out =
      run(bench.jog("left", {"--by", "2 mm", "--speed", "10 mm/s", "--lag", kPatientLag, "--json"}));
  INFO(out.err << out.out);
  REQUIRE(out.code == 0);
  const nlohmann::json result = nlohmann::json::parse(out.out);
  CHECK(result.at("arrived") == true);
  CHECK(result.at("measured").get<double>() == Approx(2e-3).margin(2 * kCount_m));
  CHECK(length_m(listener, 2) == Approx(2e-3).margin(2 * kCount_m));
  CHECK(length_m(listener, 1) == 0);
  CHECK(state(listener, 2) == hal::DriveState::kSwitchOnDisabled);
  CHECK_FALSE(listener.heard().command.contains(1));

  const Ended back = run(bench.jog("left", {"--by", "-2 mm", "--speed", "10 mm/s", "--lag", kPatientLag}));
  INFO(back.err);
  CHECK(back.code == 0);
  CHECK(lines_of(back.out).back() == "'left' went from 2.000 to 0.000 mm, as its drive says");
  CHECK(length_m(listener, 2) == Approx(0).margin(2 * kCount_m));
}

TEST_CASE("A jog that would leave the limits moves nothing and says where the axis stands", "[scenario]") {
  Workbench bench;
  BusListener listener(bench.bus(), {1, 2});
  const Ended ended = run(bench.jog("left", {"--by", "-4 mm"}));  // -3 to 6 mm
  CHECK(ended.code == 1);
  CHECK_THAT(ended.out,
             Catch::Contains("'left' stands at 0.000 mm, and its limits are -3 to 6 mm: it was not moved"));
  CHECK(length_m(listener, 2) == 0);
}

TEST_CASE("A jog ends on SIGINT with the axis at rest and disabled", "[scenario]") {
  Workbench bench;
  BusListener listener(bench.bus(), {1, 2});
  // It would take minutes to arrive.
  Process jog(bench.jog("right", {"--by", "5 mm", "--speed", "0.02 mm/s", "--lag", kPatientLag}));
  REQUIRE(jog.says("run "));
  jog.send(SIGINT);
  const auto code = jog.wait();
  INFO(jog.err() << jog.out());
  CHECK(code == 1);
  CHECK_THAT(jog.out(), Catch::Contains("stopped at"));
  CHECK(length_m(listener, 1) < 4.9e-3);
  CHECK(state(listener, 1) == hal::DriveState::kSwitchOnDisabled);
}

TEST_CASE("A jog against a body that pulls harder than the drive holds ends with the axis lagging behind",
          "[scenario]") {
  Workbench bench(Changes{{"plant: ", "plant:\n  drives: {force_limit: 0.05}"}});
  const Ended ended = run(bench.jog("right", {"--by", "5 mm", "--speed", "10 mm/s", "--json"}));
  INFO(ended.err << ended.out);
  CHECK(ended.code == 1);
  const nlohmann::json result = nlohmann::json::parse(ended.out);
  CHECK(result.at("arrived") == false);
  CHECK(result.at("measured").get<double>() < 4e-3);  // beyond 1 mm of lag it is let go
}

TEST_CASE("A jog without its drive says which one is silent", "[scenario]") {
  Workbench bench(Changes{{"  master_node: 127\n", "  sdo_timeout: 100 ms\n  master_node:  127\n"}});
  bench.plant().send(SIGSTOP);
  const Ended ended = run(bench.jog("right", {"--by", "1 mm"}));
  CHECK(ended.code == 1);
  CHECK_THAT(ended.out, Catch::Contains("axis 0 'right' (node 1): "));
  bench.plant().send(SIGCONT);
}

TEST_CASE("A jog moves an axis that follows efforts by its position", "[scenario]") {
  const std::string drive = "node: 2, counts_per_turn: 65536";
  Workbench bench({{drive, drive + ", setpoint: effort, rated_torque: 20 mNm"}});
  const Ended out = run(bench.jog("left", {"--by", "2 mm", "--speed", "10 mm/s", "--lag", kPatientLag}));
  INFO(out.err << out.out);
  CHECK(out.code == 0);
  CHECK(lines_of(out.out).back() == "'left' went from 0.000 to 2.000 mm, as its drive says");
}

TEST_CASE("A jog homes its axis first where it has to, and refuses one that then has no reference",
          "[scenario]") {
  const std::string drive = "node: 2, counts_per_turn: 65536";
  {
    Workbench bench({{drive, drive + ", reference: homing, homing: {method: 17, speed_search: 2000, "
                                     "speed_zero: 100}, offset: -1 mm"}});  // the switch
    BusListener listener(bench.bus(), {1, 2});
    const Ended out = run(bench.jog("left", {"--by", "2 mm", "--speed", "10 mm/s", "--lag", kPatientLag}));
    INFO(out.err << out.out);
    CHECK(out.code == 0);
    double from_mm = 0, to_mm = 0;
    REQUIRE(std::sscanf(lines_of(out.out).back().c_str(), "'left' went from %lf to %lf mm, as its drive says",
                        &from_mm, &to_mm) == 2);
    CHECK(from_mm == Approx(-1).margin(kPastSwitch_mm));
    CHECK(to_mm - from_mm == Approx(2).margin(0.002));
    CHECK(length_m(listener, 2) == Approx(1e-3 * (to_mm + 1)).margin(1e-6));
    CHECK(length_m(listener, 1) == 0);
  }
  Workbench bench({{drive, drive + ", reference: homing, homing: {method: 0}"}});
  BusListener listener(bench.bus(), {1, 2});
  const Ended out = run(bench.jog("left", {"--by", "2 mm"}));
  CHECK(out.code == 1);
  CHECK_THAT(out.out, Catch::Contains("axis 0 'left' (node 2): homing failed"));
  CHECK(length_m(listener, 2) == 0);
  CHECK(state(listener, 2) == hal::DriveState::kSwitchOnDisabled);
}

TEST_CASE("A jog refuses what it was not meant to do before it opens the bus", "[scenario]") {
  const RobotFile file(finger());
  const std::string nowhere = "local:" + (file.folder() / "bus").string();
  const auto refused = [&](const std::string& actuator, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{kCtl, "jog", file.path().string(), actuator, "--bus", nowhere};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Ended ended = run(arguments);
    CHECK(ended.code == 2);
    return ended.err;
  };
  CHECK_THAT(refused("up", {"--by", "1 mm"}), Catch::Contains("has no actuator 'up'; it has right, left"));
  CHECK_THAT(refused("left", {"--by", "1 kg"}), Catch::Contains("--by: found '1 kg', expected a length"));
  CHECK_THAT(refused("left", {"--by", "6 mm"}),
             Catch::Contains("at most 5 mm either way; a greater --limit"));
  CHECK_THAT(refused("left", {"--by", "1 mm", "--speed", "1 m/s"}),
             Catch::Contains("--speed: found 1000 mm/s"));
  CHECK_THAT(refused("left", {"--by", "1 mm", "--lag", "0 mm"}), Catch::Contains("--lag"));
  CHECK_THAT(refused("left", {}), Catch::Contains("--by is required"));
}

}  // namespace tendril::app::jog_run_test
