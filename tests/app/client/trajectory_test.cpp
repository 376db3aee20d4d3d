// SPDX-License-Identifier: Apache-2.0
#include "app/client/trajectory.h"

#include <catch2/catch.hpp>
#include <fstream>

#include "app/config/config_error.h"
#include "tests/app/robot_file.h"

namespace tendril::app::trajectory_test {

struct File {
  explicit File(const std::string& text) { std::ofstream(path) << text; }
  Trajectory read() const { return Trajectory(path, {"tip.x", "tip.z", "chamber.volume"}); }

  RobotFile folder{""};
  std::filesystem::path path = folder.folder() / "way.csv";
};

TEST_CASE("A trajectory is linear between its rows and stands at its ends, in SI units", "[unit]") {
  const File file(
      "# a way\n t [ms], tip.z [mm], chamber.volume [ml]\r\n\n1000, 100, 0\n 2000,110,1\r\n2500,110,3");
  const Trajectory way = file.read();
  CHECK(way.names() == std::vector<std::string>{"tip.z", "chamber.volume"});
  CHECK(way.duration_s() == Approx(1.5));
  const auto check = [&](double t_s, double z, double volume) {
    CAPTURE(t_s);
    CHECK(way.at(t_s)[0] == Approx(z));
    CHECK(way.at(t_s)[1] == Approx(volume).margin(1e-12));
  };
  check(-1, 0.1, 0);
  check(0, 0.1, 0);
  check(0.5, 0.105, 0.5e-6);
  check(1, 0.11, 1e-6);
  check(1.25, 0.11, 2e-6);
  check(9, 0.11, 3e-6);
}

TEST_CASE("Columns without a unit are in SI units", "[unit]") {
  CHECK(File("t,tip.x\n0,0\n2,0.5\n").read().at(1)[0] == Approx(0.25));
}

TEST_CASE("A table that is no trajectory is refused with its line", "[unit]") {
  const auto [text, line, words] = GENERATE(table<std::string, std::string, std::string>({
      {"", "", "no row"},
      {"t,tip.x\n", "", "no row"},
      {"tip.x,t\n0,0\n", ":1", "begins with t"},
      {"t\n0\n", ":1", "begins with t"},
      {"t,tip.y\n0,0\n", ":1", "no coordinate 'tip.y'; it has: tip.x, tip.z"},
      {"t,tip.x,tip.x\n0,0,0\n", ":1", "stands twice"},
      {"t,tip.x [kg]\n0,0\n", ":1", "no unit"},
      {"t,tip.x [mm\n0,0\n", ":1", "no unit"},
      {"t [mm],tip.x\n0,0\n", ":1", "no unit"},
      {"t,tip.x\n0,0\n\n1\n", ":4", "1 values, where the header has 2"},
      {"t,tip.x\n0,0,0\n", ":2", "3 values"},
      {"t,tip.x\n0,nan\n", ":2", "'nan' is no finite number"},
      {"t,tip.x\n0,0.1 mm\n", ":2", "no finite number"},
      {"t,tip.x\n0,0\n0,1\n", ":3", "not after the row before"},
      {"t,tip.x [mm]\n0,1e308\n", ":2", "'1e308' is beyond 1000 m"},
      {"t,chamber.volume\n0,-1e4\n", ":2", "'-1e4' is beyond 1000 m^3"},
      {"t [ms],tip.x\n-1e308,0\n1e308,0\n", ":2", "'-1e308' is beyond 1e+06 s"},
  }));
  CAPTURE(text);
  const File file(text);
  CHECK_THROWS_WITH(file.read(),
                    Catch::StartsWith(file.path.string() + line + ": ") && Catch::Contains(words));
  CHECK_THROWS_AS(file.read(), ConfigError);
}

TEST_CASE("A trajectory that is not there is refused", "[unit]") {
  CHECK_THROWS_WITH(Trajectory("/nowhere/way.csv", {"tip.x"}),
                    Catch::Contains("/nowhere/way.csv: there is no such file"));
}

}  // namespace tendril::app::trajectory_test
