// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>

#include "tests/app/config/mistake.h"
#include "tests/app/robot_file.h"

// Mistakes in the form of a robot file: no file, no YAML, keys that are unknown, missing or there twice.

namespace tendril::app::config_form_test {

TEST_CASE("The file that the mistakes are made in is good", "[unit]") {
  const RobotFile file(kGood);
  CHECK(error_of(file.path()) == "no error");
}

TEST_CASE("An unknown key is refused with the nearest known one", "[unit]") {
  check_mistakes({
      {"material:", "materiel:", nullptr, {"unknown key 'materiel'; did you mean 'material'?"}},
      {"top_speed: 110",
       "topspeed: 110",
       nullptr,
       {"actuators[1]: unknown key 'topspeed'; did you mean 'top_speed'?"}},
      {"pulley_radius: 11",
       "radius: 11",
       nullptr,
       {"drive: unknown key 'radius'; known keys: counts_per_turn current_limit"}},
      {"stop: hold", "stop: hold\n  zzz: 1", "zzz", {"control: unknown key 'zzz'; known keys: cpu"}},
      {"box:", "bax:", nullptr, {"fixed: unknown key 'bax'; did you mean 'box'?"}},
      {"robot: twin", "Robot: twin", nullptr, {"unknown key 'Robot'; did you mean 'robot'?"}},
  });
}

TEST_CASE("A missing key is reported on the line of its section", "[unit]") {
  check_mistakes({
      {"robot: twin\n", "", "# a comment", {":1: missing key 'robot'"}},
      {"  file: body.msh\n", "", "mesh:", {"mesh: missing key 'file'"}},
      {"  mass: 0.5 kg\n", "", "material:", {"material: missing key 'mass'"}},
      {"node: 2, ", "", "drive: {counts_per_turn: 65537", {"actuators[1].drive: missing key 'node'"}},
      {"    top_speed: 110 mm/s\n", "", "- name: south", {"actuators[1]: missing key 'top_speed'"}},
      {"  speed: 25 mm/s\n", "", "motion:", {"motion: missing key 'speed'"}},
      {"fixed: {box: [-15 -15 -40 mm, 15 15 10 mm]}",
       "fixed: {}",
       nullptr,
       {"fixed: missing a key, expected one of: box, sphere"}},
  });
}

TEST_CASE("A key given twice is refused, and both lines are named", "[unit]") {
  check_mistakes({
      {"stop: hold",
       "rate: 1 kHz",
       nullptr,
       {"control: found key 'rate' again, expected it once; line 31 has it"}},
      {"plant:", "robot: again\nplant:", "robot: again", {"found key 'robot' again", "line 2 has it"}},
  });
}

TEST_CASE("A section that is no mapping and a list that is no list are refused", "[unit]") {
  check_mistakes({
      {"fixed:", "bus: vcan0\nfixed:", "bus:\n", {"found key 'bus' again"}},
      {"{node: 1, counts_per_turn: 65536, pulley_radius: 10 mm}",
       "1",
       "drive: 1",
       {"actuators[0].drive: found '1', expected a mapping of keys"}},
      {"drive: {node: 1,", "drive: [node: 1,", "drive: [", {"found no valid YAML: illegal flow end"}},
      {"[body 0 97 45 mm, guide 0 10 30 mm]",
       "body 0 97 45 mm",
       nullptr,
       {"actuators[0].cable: found 'body 0 97 45 mm', expected a list"}},
      {"[body 0 97 45 mm, guide 0 10 30 mm]", "[]", nullptr, {"actuators[0].cable: found a list of 0"}},
      {"[body 0 97 45 mm, guide 0 10 30 mm]",
       "[body 0 97 45 mm, ]",
       nullptr,
       {"cable: found a list of 1, expected at"}},
      {"robot: twin", "robot: {a: b}", nullptr, {"robot: found a mapping of keys, expected a name"}},
      {"robot: twin", "robot: [a, ]", nullptr, {"robot: found a list of 1, expected a name"}},
      {"  - name: tip\n    point: 0 0 125 mm\n    coordinates: xyz",
       "  - tip",
       nullptr,
       {"effectors[0]: found 'tip', expected a mapping"}},
      {"plant:", "? [a, b]\n: c\nplant:", "? [a", {"found a list of 2, expected a word as key"}},
  });
}

TEST_CASE("A file that is absent, a folder, empty or no YAML is refused", "[unit]") {
  const RobotFile somewhere("");
  const std::filesystem::path absent = somewhere.folder() / "absent.yaml";
  CHECK_THAT(error_of(absent), Catch::StartsWith(absent.string() + ": cannot be read: No such file"));
  CHECK_THAT(error_of(somewhere.folder()), Catch::Contains(": cannot be read: it is a folder"));
  const std::string nothing = ":1: found nothing, expected a robot";
  CHECK_THAT(error_of(somewhere.path()), Catch::Contains(nothing));
  CHECK_THAT(error_of(RobotFile("# only this\n").path()), Catch::Contains(nothing));
  CHECK_THAT(error_of(RobotFile("---\n...\n").path()), Catch::Contains(nothing));
  CHECK_THAT(error_of(RobotFile("[1, 2]").path()),
             Catch::Contains(":1: found a list of 2, expected a mapping"));
  CHECK_THAT(error_of(RobotFile("robot: a\nmesh: {file: b\nfixed: c\n").path()),
             Catch::Contains("found no valid YAML"));
  CHECK_THAT(error_of(RobotFile("robot: a\nmesh: *b\n").path()),
             Catch::Contains("robot.yaml:2: found no valid YAML"));
  CHECK_THAT(error_of(RobotFile("robot: a\n\tmesh: b\n").path()),
             Catch::Contains("robot.yaml:2: found no valid YAML"));
  CHECK_THAT(error_of(RobotFile(kGood + "---\nrobot: b\n").path()),
             Catch::Contains("found a second document"));
  CHECK_THAT(error_of(RobotFile(std::string(100000, '[')).path()), Catch::Contains("found no valid YAML"));
}

TEST_CASE("A file without the right to read it is refused", "[unit]") {
  if (geteuid() == 0) {
    WARN("root may read every file: not checked");
    return;
  }
  const RobotFile file(kGood);
  std::filesystem::permissions(file.path(), std::filesystem::perms::none);
  CHECK_THAT(error_of(file.path()), Catch::Contains(": cannot be read: Permission denied"));
}

}  // namespace tendril::app::config_form_test
