#include <unistd.h>

#include <catch2/catch.hpp>

#include "tests/app/config/mistake.h"
#include "tests/app/robot_file.h"

namespace tendril::app::config_errors_test {

TEST_CASE("An actuator, an effector and a region are of one kind each", "[unit]") {
  check_mistakes({
      {"cable: [body 0 97 45 mm, guide 0 10 30 mm]",
       "push: 0 97 45 mm\n    cable: [body 0 97 45 mm, guide 0 10 30 mm]",
       "- name: north",
       {"actuators[0]: found keys 'cable' and 'push', expected one of them"}},
      {"cable: [body 0 97 45 mm, guide 0 10 30 mm]",
       "cabel: [body 0 97 45 mm, guide 0 10 30 mm]",
       "cabel",
       {"actuators[0]: unknown key 'cabel'; did you mean 'cable'?"}},
      {"    cable: [body 0 97 45 mm, guide 0 10 30 mm]\n",
       "",
       "- name: north",
       {"actuators[0]: missing a key, expected one of: cable, rod, push, cavity"}},
      {"point: 0 0 125 mm",
       "points: [0 0 125 mm]\n    cavity: chamber",
       "- name: tip",
       {"effectors[0]: found keys 'points' and 'cavity'"}},
      {"{box: [-15 -15 -40 mm, 15 15 10 mm]}",
       "{sphere: 0 0 1 mm}",
       nullptr,
       {"fixed.sphere: found '0 0 1 mm'", "the radius above 0", "four lengths"}},
      {"{box: [-15 -15 -40 mm, 15 15 10 mm]}", "{sphere: 0 0 1 0 mm}", nullptr, {"fixed.sphere"}},
  });
}

TEST_CASE("Weights are numbers, one for all controlled coordinates or one for each", "[unit]") {
  check_mistakes({
      {"coordinates: xyz",
       "coordinates: xz\n    weight: [1, 2, 3]",
       "weight",
       {"effectors[0].weight: found a list of 3", "one for each of the 2 controlled coordinates"}},
      {"coordinates: xyz",
       "coordinates: xyz\n    weight: -1",
       "weight",
       {"effectors[0].weight", "no less than 0"}},
      {"coordinates: xyz",
       "coordinates: xyz\n    weight: [1, one, 1]",
       "weight",
       {"effectors[0].weight[1]: found 'one', expected a number"}},
  });
}

TEST_CASE("The effector of a motion is one of points that the file has", "[unit]") {
  check_mistakes({
      {"  speed: 25 mm/s",
       "  speed: 25 mm/s\n  effector: knee",
       "effector: knee",
       {"motion.effector: found 'knee', expected the name of an effector"}},
  });
  std::string yaml = kGood;
  yaml.replace(yaml.find("actuators:"), 0, "  - {name: air, cavity: chamber}\n");
  yaml.replace(yaml.find("  speed: 25"), 0, "  effector: air\n");
  CHECK_THAT(error_of(RobotFile(yaml).path()),
             Catch::Contains("motion.effector: found 'air', expected an effector of points"));
}

TEST_CASE("The limits of a motion and its shape fit together", "[unit]") {
  const std::string speed = "  speed: 25 mm/s";
  check_mistakes({
      {speed,
       speed + "\n  jerk: 1 m/s^3",
       "jerk: 1",
       {"motion.jerk: found '1 m/s^3', expected an acceleration"}},
      {speed,
       speed + "\n  corners: 1 mm",
       "corners",
       {"motion.corners", "expected an acceleration beside it"}},
      {speed, speed + "\n  acceleration: 0 mm/s^2", "acceleration", {"motion.acceleration", "above 0"}},
      {speed, speed + "\n  size: 20 20 mm", "size: 20", {"motion.size", "no such key without a shape"}},
      {speed, speed + "\n  turns: 0", "turns", {"motion.turns", "1"}},
      {speed, speed + "\n  shape: circle", "motion:", {"found keys 'waypoints' and 'shape'"}},
  });
  const auto with_shape = [](const std::string& shape) {
    const std::size_t motion = kGood.find("motion:");
    return error_of(
        RobotFile(kGood.substr(0, motion) + "motion: {origin: 0 0 125 mm, speed: 20 mm/s, " + shape + "}\n")
            .path());
  };
  CHECK(with_shape("shape: circle, size: 20 20 mm") == "no error");
  CHECK(with_shape("shape: line, size: 20 0 mm, plane: yz, turns: 3") == "no error");
  CHECK(with_shape("shape: lissajous, size: 20 10 mm, frequencies: [5, 4]") == "no error");
  CHECK_THAT(with_shape("shape: circle"), Catch::Contains("motion.size: found nothing, expected the size"));
  CHECK_THAT(with_shape("shape: circle, size: 20 0 mm"), Catch::Contains("only a line may be 0 wide"));
  CHECK_THAT(with_shape("shape: circle, size: 20 20 mm, frequencies: [3, 2]"),
             Catch::Contains("only a shape lissajous has it"));
  CHECK_THAT(with_shape("shape: eight, size: 20 20 mm, closed: true"), Catch::Contains("a shape is closed"));
  CHECK_THAT(with_shape("shape: lissajous, size: 20 20 mm, frequencies: [3, 0]"),
             Catch::Contains("frequencies[1]"));
  CHECK_THAT(with_shape("shape: circle, size: 20 1000 mm"),
             Catch::Contains("motion.size: found '20 1000 mm', expected a shape in control.workspace"));
  CHECK_THAT(with_shape("shape: square, size: 1000 20 mm"), Catch::Contains("in control.workspace"));
}

TEST_CASE("The file that the mistakes are made in is good", "[unit]") {
  const RobotFile file(kGood);
  CHECK(error_of(file.path()) == "no error");
}

TEST_CASE("A quantity in the wrong unit, number or form is refused with what is expected", "[unit]") {
  check_mistakes({
      {"tension: 0 7 N",
       "tension: 0 8 mm",
       nullptr,
       {"actuators[1].tension: found '0 8 mm', expected two forces (N, mN, kN), as in '1 2 N'"}},
      {"tension: 0 8 N", "tension: 8 N", nullptr, {"actuators[0].tension: found '8 N', expected two forces"}},
      {"young_modulus: 150 kPa",
       "young_modulus: 150",
       nullptr,
       {"material.young_modulus: found '150', expected a pressure (Pa, kPa, MPa), as in '1 Pa'"}},
      {"mass: 0.5 kg", "mass: 0,5 kg", nullptr, {"material.mass: found '0,5 kg', expected a mass (kg, g)"}},
      {"poisson_ratio: 0.45", "poisson_ratio: .nan", nullptr, {"found '.nan', expected a number"}},
      {"mass: 0.5 kg", "mass: inf kg", nullptr, {"found 'inf kg'"}},
      {"rate: 600 Hz",
       "rate: 600Hz",
       nullptr,
       {"control.rate: found '600Hz', expected a rate (Hz, kHz), as in '1 Hz'"}},
      {"gravity: 0 0 -9.81 m/s^2",
       "gravity: -9.81 m/s^2",
       nullptr,
       {"gravity: found", "three accelerations (m/s^2, mm/s^2)"}},
      {"point: 0 0 125 mm",
       "point: [0, 0, 125 mm]",
       nullptr,
       {"effectors[0].point: found a list of 3, expected three lengths"}},
      {"- -10 10 0 mm",
       "- -10 10 mm",
       nullptr,
       {"motion.waypoints[1]: found '-10 10 mm', expected three lengths"}},
      {"mass: 0.5 kg\ngravity", "mass:\ngravity", "mass:", {"material.mass: found nothing, expected a mass"}},
      {"node: 2,", "node: two,", nullptr, {"drive.node: found 'two', expected a whole number from 1 to 127"}},
      {"node: 2,", "node: 2.0,", nullptr, {"found '2.0', expected a whole number"}},
      {"node: 2,", "node: ,", nullptr, {"found nothing, expected a whole number"}},
      {"reversed: false", "reversed: yes", nullptr, {"drive.reversed: found 'yes', expected true or false"}},
      {"stop: hold", "stop: Hold", nullptr, {"control.stop: found 'Hold', expected hold or relax"}},
      {"90 deg about x",
       "90 deg about w",
       nullptr,
       {"mesh.rotate", "expected an angle (rad, deg) about x, y or z"}},
      {"90 deg about x", "90 about x", nullptr, {"mesh.rotate: found '90 about x'"}},
      {"file: body.msh",
       "file: body.msh\n  unit: 1 mm",
       "unit",
       {"mesh.unit: found '1 mm', expected a unit of length"}},
      {"coordinates: xyz", "coordinates: xyx", nullptr, {"effectors[0].coordinates: found 'xyx'"}},
      {"coordinates: xyz", "coordinates: ''", nullptr, {"effectors[0].coordinates: found ''"}},
      {"body 0 97 45 mm",
       "corpse 0 97 45 mm",
       nullptr,
       {"actuators[0].cable[0]", "expected body or guide, then three"}},
      {"body 0 97 45 mm", "body0 97 45 mm", nullptr, {"found 'body0 97 45 mm'"}},
      {"box: [-15 -15 -40 mm, 15 15 10 mm]",
       "box: [-15 -15 -40 mm]",
       nullptr,
       {"fixed.box: found a list of 1, expected a list of two corners"}},
  });
}

TEST_CASE("A value out of its range is refused with its bounds", "[unit]") {
  check_mistakes({
      {"young_modulus: 150 kPa",
       "young_modulus: 0 kPa",
       nullptr,
       {"material.young_modulus: found '0 kPa', expected a value above 0 Pa"}},
      {"poisson_ratio: 0.45",
       "poisson_ratio: 0.5",
       nullptr,
       {"expected a value no less than 0 and below 0.5"}},
      {"poisson_ratio: 0.44", "poisson_ratio: -0.1", nullptr, {"plant.poisson_ratio: found '-0.1'"}},
      {"mass: 0.5 kg", "mass: -1 g", nullptr, {"material.mass", "above 0 kg"}},
      {"rate: 600 Hz", "rate: 0 Hz", nullptr, {"control.rate", "above 0 Hz and no more than 20000 Hz"}},
      {"rate: 600 Hz", "rate: 20.001 kHz", nullptr, {"control.rate", "no more than 20000 Hz"}},
      {"priority: 80",
       "priority: 99",
       nullptr,
       {"control.priority: found '99', expected a whole number from 1 to 98"}},
      {"priority: 80", "priority: 0", nullptr, {"control.priority"}},
      {"priority: 80", "iteration_cap: 0", nullptr, {"control.iteration_cap", "no less than 1"}},
      {"priority: 80",
       "late_cycles_limit: 99999999999",
       nullptr,
       {"found '99999999999', expected a whole number"}},
      {"priority: 80", "cpu: -2", nullptr, {"control.cpu"}},
      {"priority: 80",
       "model_solver: krylov",
       nullptr,
       {"control.model_solver: found 'krylov', expected direct or reused"}},
      {"priority: 80",
       "model_tangent: secant",
       nullptr,
       {"control.model_tangent: found 'secant', expected exact or semidefinite"}},
      {"priority: 80", "epsilon: -1e-9", nullptr, {"control.epsilon: found '-1e-9'"}},
      {"node: 1,",
       "node: 0,",
       nullptr,
       {"actuators[0].drive.node: found '0', expected a whole number from 1 to 127"}},
      {"node: 1,", "node: 128,", nullptr, {"from 1 to 127"}},
      {"master_node: 127", "master_node: 128", nullptr, {"bus.master_node"}},
      {"bitrate: 1 Mbit/s", "bitrate: 2 Mbit/s", nullptr, {"bus.bitrate", "no more than 1000000 bit/s"}},
      {"heartbeat: 50 ms", "heartbeat: 0.5 ms", nullptr, {"bus.heartbeat: ", "from 0.001 s to 65.535 s"}},
      {"tension: 0 8 N", "tension: -1 8 N", nullptr, {"actuators[0].tension", "two values no less than 0 N"}},
      {"tension: 0 7 N", "tension: 7 6 N", nullptr, {"actuators[1].tension", "the lower limit first"}},
      {"stroke: -24 34 mm", "stroke: 34 -24 mm", nullptr, {"actuators[1].stroke", "the lower limit first"}},
      {"top_speed: 110 mm/s", "top_speed: 0 m/s", nullptr, {"actuators[1].top_speed", "above 0 m/s"}},
      {"65537", "-65537", nullptr, {"actuators[1].drive.counts_per_turn", "above 0"}},
      {"pulley_radius: 11 mm",
       "pulley_radius: 0 mm",
       nullptr,
       {"actuators[1].drive.pulley_radius", "above 0 m"}},
      {"-40 -40 90 mm, 40 40 150 mm",
       "-40 -40 90 mm, 40 40 80 mm",
       nullptr,
       {"control.workspace[1]: found '40 40 80 mm'", "below the first corner's"}},
      {"15 15 10 mm", "15 -16 10 mm", nullptr, {"fixed.box[1]: found '15 -16 10 mm'"}},
      {"speed: 25 mm/s", "speed: 0 mm/s", nullptr, {"motion.speed"}},
      {"mass: 0.51 kg",
       "mass: 1 kg\n  time_step: 1e-6 s",
       "time_step",
       {"plant.time_step", "from 1e-05 s to 0.1 s"}},
      {"mass: 0.51 kg",
       "mass: 1 kg\n  time_step: 2000 s",
       "time_step",
       {"plant.time_step", "from 1e-05 s to 0.1 s"}},
      {"bitrate: 1 Mbit/s",
       "bitrate: 1 Mbit/s\n  feedback_timeout: 1e10 s",
       "feedback",
       {"bus.feedback_timeout: found '1e10 s', expected a magnitude of no more than 1000000 s"}},
      {"speed: 25 mm/s",
       "speed: 1e-300 m/s",
       nullptr,
       {"motion.speed", "a magnitude of no less than 1e-09 m/s"}},
      {"-40 -40 90 mm, 40 40 150 mm",
       "-4e9 -40 90 mm, 40 40 150 mm",
       nullptr,
       {"control.workspace[0]", "a magnitude of no more than 1000 m"}},
      {"65537", "1e11", nullptr, {"actuators[1].drive.counts_per_turn", "positions that 32 bits hold"}},
      {"counts_per_turn: 65537",
       "counts_per_turn: 10",
       "counts_per_turn: 10,",
       {"actuators[1].drive.counts_per_turn", "at least 100 counts in the range"}},
      {"mass: 0.51 kg",
       "mass: 1 kg\n  damping_mass: -1 1/s",
       "damping_mass",
       {"plant.damping_mass", "no less than 0 1/s"}},
      {"mass: 0.51 kg",
       "mass: 1 kg\n  drives: {force_limit: 0}",
       "drives",
       {"plant.drives.force_limit: found '0', expected a value above 0"}},
      {"mass: 0.51 kg",
       "mass: 1 kg\n  drives: {acceleration_time: 0.9 ms}",
       "drives",
       {"plant.drives.acceleration_time", "no less than 0.001 s"}},
      {"mass: 0.51 kg",
       "mass: 1 kg\n  drives: {position_gain: 1001 1/s}",
       "drives",
       {"plant.drives.position_gain", "above 0 1/s and no more than 1000 1/s"}},
      {"mass: 0.51 kg",
       "mass: 1 kg\n  drives: {following_error: 1.1}",
       "drives",
       {"plant.drives.following_error", "no more than 1"}},
      {"mass: 0.51 kg",
       "mass: 1 kg\n  drives: {encoder_counts: 4096}",
       "drives",
       {"plant.drives.encoder_counts: found '4096', expected no such key, as bus.protocol is canopen"}},
      {"gravity", "snap: -1 mm\ngravity", "snap", {"snap: found '-1 mm', expected a value no less than 0 m"}},
  });
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

TEST_CASE("A file, a region or a name that cannot be used is refused", "[unit]") {
  check_mistakes({
      {"file: body.msh",
       "file: absent.msh",
       nullptr,
       {"mesh.file: found 'absent.msh', expected a mesh file, but there is no ", "/absent.msh"}},
      {"file: body.msh", "file: .", nullptr, {"mesh.file: found '.'"}},
      {"{box: [-15 -15 -40 mm, 15 15 10 mm]}",
       "",
       "fixed:",
       {"fixed: found nothing, expected the name of a region"}},
      {"name: tip",
       "name: the tip",
       nullptr,
       {"effectors[0].name: found 'the tip', expected a name of letters"}},
      {"name: tip", "name: t,p", nullptr, {"effectors[0].name"}},
      {"name: tip", "name: \"t\\np\"", nullptr, {"effectors[0].name: found 't p'"}},
      {"name: vcan0", "name: an-interface-with-a-name-too-long", nullptr, {"bus.name", "CAN interface"}},
      {"name: vcan0", "name: 'local:'", nullptr, {"bus.name", "path of a socket"}},
      {"name: vcan0", "name: local:/" + std::string(107, 'a'), nullptr, {"bus.name", "aaa...', expected"}},
      {"name: vcan0", "name: can 0", nullptr, {"bus.name: found 'can 0'"}},
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

}  // namespace tendril::app::config_errors_test
