// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>

#include "tests/app/program/programs.h"

// What the programs refuse: each with its exit code and one line on stderr that says what, where and what to
// do. None of these runs reaches a bus.

namespace tendril::app::refusals_test {

constexpr int kUsage = 2, kEnvironment = 3;

using Fragments = std::vector<std::string>;

void check_refused(const std::vector<std::string>& arguments, int code, const Fragments& fragments) {
  const Ended ended = run(arguments);
  INFO(ended.out << ended.err);
  CHECK(ended.code == code);
  std::vector<std::string> lines = lines_of(ended.err);
  // --allow-non-rt warns where the machine refuses to lock memory.
  std::erase_if(lines, [](const std::string& line) { return line.find("[warning]") != std::string::npos; });
  REQUIRE(lines.size() == 1);
  for (const std::string& fragment : fragments) CHECK_THAT(lines[0], Catch::Contains(fragment));
}

/// Both programs refuse the file, and name it.
void check_file_refused(const RobotFile& file, const Fragments& fragments) {
  const std::string nowhere = "local:" + (file.folder() / "bus").string();
  Fragments all = fragments;
  all.push_back(file.path().string() + ":");
  for (const std::string& program : {kDaemon, kPlant}) {
    INFO(program);
    check_refused({program, file.path().string(), "--bus", nowhere}, kUsage, all);
  }
}

/// One piece of the finger's file becomes another, and both programs name its line.
void check_mistake(const std::string& good, const std::string& bad, const Fragments& fragments) {
  INFO("'" << good << "' becomes '" << bad << "'");
  const int line = line_of(good);
  Fragments all = fragments;
  all.push_back("robot.yaml:" + std::to_string(line) + ": ");
  check_file_refused(RobotFile(finger({{good, bad}})), all);
}

/// A finger with a mesh of its own, made of the tetrahedra given (node numbers from 1) over five nodes.
void check_mesh_refused(const std::string& tetrahedra, int count, const Fragments& fragments) {
  const RobotFile file(finger({{"file: finger.msh", "file: small.msh"}}), "small.msh");
  const std::string n = std::to_string(count);
  std::ofstream(file.folder() / "small.msh")
      << "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
         "$Entities\n0 0 0 1\n1 0 0 0 9 9 9 0 0\n$EndEntities\n"
         "$Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n0 0 0\n9 0 0\n0 9 0\n0 0 9\n9 9 9\n$EndNodes\n"
         "$Elements\n1 "
      << n << " 1 " << n << "\n3 1 4 " << n << "\n"
      << tetrahedra << "$EndElements\n";
  Fragments all = fragments;
  all.push_back("robot.yaml:" + std::to_string(line_of("file: ")) + ": mesh.file: ");
  check_file_refused(file, all);
}

TEST_CASE("A robot file that is not there is refused", "[scenario]") {
  const RobotFile other("");
  const std::string absent = (other.folder() / "absent/robot.yaml").string();
  for (const std::string& program : {kDaemon, kPlant})
    check_refused({program, absent}, kUsage, {absent + ": cannot be read: No such file"});
}

TEST_CASE("A mistake in the robot file is refused with its line and what is expected", "[scenario]") {
  check_mistake("young_modulus: 150 kPa", "youngs_modulus: 150 kPa",
                {"unknown key 'youngs_modulus'", "did you mean 'young_modulus'?"});
  check_mistake("tension: 0.1 2 N", "tension: 0.1 2 mm",
                {"actuators[0].tension: found '0.1 2 mm'", "expected two forces (N, mN, kN)"});
  check_mistake("young_modulus: 150 kPa", "young_modulus: .nan kPa",
                {"material.young_modulus: found '.nan kPa'", "expected a pressure"});
  check_mistake("young_modulus: 150 kPa", "young_modulus: -150 kPa",
                {"material.young_modulus: found '-150 kPa'", "expected a value above 0 Pa"});
  check_mistake("node: 2,", "node: 1,",
                {"actuators[1].drive.node: found '1'", "expected a node id of its own"});
}

TEST_CASE("A robot that does not fit its mesh is refused with the line and the remedy", "[scenario]") {
  check_mistake("fixed: base", "fixed: root",
                {"fixed: found 'root'", "expected a region of finger.msh: base, body"});
  check_mistake("[body 5 0 -90 mm", "[body 5 0 -120 mm",
                {"actuators[0].cable (right): ", "(5, 0, -120) mm lies 20 mm outside the mesh",
                 "the nearest point of the body is (5, ", "'snap'"});
}

TEST_CASE("A mesh that no model can be built on is refused with its file and the culprit", "[scenario]") {
  check_mesh_refused("1 1 3 2 4\n", 1,
                     {"small.msh", "inverted: tetrahedron 0 at ", "swap two of their corners"});
  check_mesh_refused("1 1 2 3 4\n2 1 2 3 4\n", 2,
                     {"small.msh", "tetrahedra are in the mesh twice", "remove the second ones"});
}

TEST_CASE("Frames that cannot fit the bit rate are refused before any is sent", "[scenario]") {
  const RobotFile file(
      finger({{"rate: 600 Hz", "rate: 2 kHz"}, {"bitrate: 1 Mbit/s", "bitrate: 125 kbit/s"}}));
  check_refused({kDaemon, file.path().string(), "--allow-non-rt"}, kUsage,
                {file.path().string() + ":", "bus: ", " % of the time",
                 "lower the control rate or raise the bit rate"});
}

TEST_CASE("A bus that does not exist is refused with its name and what to do", "[scenario]") {
  const RobotFile file(finger());
  check_refused({kDaemon, file.path().string(), "--allow-non-rt", "--bus", "nosuchcan0"}, kEnvironment,
                {"'nosuchcan0'", "local:PATH"});
  const std::string path = (file.folder() / "bus").string();
  check_refused({kDaemon, file.path().string(), "--allow-non-rt", "--bus", "local:" + path}, kEnvironment,
                {"'" + path + "'", "start the plant first (tendril-plant)"});
  const std::string homeless = (file.folder() / "absent/bus").string();
  check_refused({kPlant, file.path().string(), "--bus", "local:" + homeless}, kEnvironment,
                {"'" + homeless + "'", "the folder must exist and be writable"});
}

TEST_CASE("A bus that has a host already is refused to a second plant", "[scenario]") {
  const Workbench bench;
  const RobotFile file(finger());
  check_refused({kPlant, file.path().string(), "--bus", bench.bus()}, kEnvironment,
                {"has a host already", "choose another path"});
}

TEST_CASE("A report that cannot be written is refused before the bus is opened", "[scenario]") {
  const RobotFile file(finger());
  const std::string folder = (file.path() / "report").string();  // below a file, where even root cannot
  check_refused({kDaemon, file.path().string(), "--allow-non-rt", "--report", folder, "--bus", "nosuchcan0"},
                kEnvironment, {"cannot write " + folder, "--report"});
}

TEST_CASE("A picture that cannot be written is refused before the check begins", "[scenario]") {
  const RobotFile file(finger());
  const std::string nowhere = (file.folder() / "absent/robot.png").string();
  check_refused({kDaemon, file.path().string(), "--check", "--picture", nowhere}, kEnvironment,
                {"cannot write " + nowhere, "No such file or directory", "name a file in a folder"});
  const std::string below = (file.path() / "robot.png").string();  // below a file, where even root cannot
  check_refused({kDaemon, file.path().string(), "--check", "--picture", below}, kEnvironment,
                {"cannot write " + below, "Not a directory"});
}

#ifndef TENDRIL_SANITIZED  // their run-time libraries make locking memory do nothing
TEST_CASE("Without the rights of real time the daemon does not start, and says what to grant", "[scenario]") {
  if (geteuid() != 0) {
    WARN("only root can take rights away: not checked");
    return;
  }
  Workbench bench;
  std::vector<std::string> daemon = bench.daemon({"--duration", "0.1"});
  std::erase(daemon, "--allow-non-rt");
  const auto without = [&](const std::string& right, const std::string& limit) {
    std::vector<std::string> arguments{"prlimit", limit, "setpriv", "--bounding-set", right};
    arguments.insert(arguments.end(), daemon.begin(), daemon.end());
    return run(arguments);
  };
  const Ended no_fifo = without("-sys_nice", "--rtprio=0:0");
  INFO(no_fifo.err);
  CHECK(no_fifo.code == kEnvironment);
  CHECK_THAT(lines_of(no_fifo.err).back(),
             Catch::Contains("SCHED_FIFO") && Catch::Contains("grant CAP_SYS_NICE") &&
                 Catch::Contains("LimitRTPRIO=80") && Catch::Contains("--allow-non-rt"));
  const Ended no_lock = without("-ipc_lock", "--memlock=65536:65536");
  INFO(no_lock.err);
  CHECK(no_lock.code == kEnvironment);
  CHECK_THAT(lines_of(no_lock.err).back(),
             Catch::Contains("cannot lock memory") && Catch::Contains("grant CAP_IPC_LOCK") &&
                 Catch::Contains("LimitMEMLOCK=infinity") && Catch::Contains("--allow-non-rt"));
  CHECK_FALSE(bench.plant().wait(0));
}
#endif

TEST_CASE("Wrong usage ends with exit code 2, and what was asked for with 0", "[scenario]") {
  for (const std::string& program : {kDaemon, kPlant}) {
    INFO(program);
    const Ended unknown = run({program, "robot.yaml", "--speed", "9"});
    CHECK(unknown.code == kUsage);
    CHECK_THAT(unknown.err, Catch::Contains("--speed") && Catch::Contains("--help"));
    const Ended nothing = run({program});
    CHECK(nothing.code == kUsage);
    CHECK_THAT(nothing.err, Catch::Contains("CONFIG is required"));
    const Ended help = run({program, "--help"});
    CHECK(help.code == 0);
    for (const char* fragment : {"CONFIG", "--bus", "Exit codes: 0"})
      CHECK_THAT(help.out, Catch::Contains(fragment));
    const Ended version = run({program, "--version"});
    CHECK(version.code == 0);
    CHECK(version.out == TENDRIL_VERSION "\n");
  }
  CHECK(run({kDaemon, "robot.yaml", "--duration", "-1"}).code == kUsage);
}

TEST_CASE(
    "A number that is none, an empty text, and an option without the one that it belongs to are wrong usage",
    "[scenario]") {
  const std::vector<std::pair<std::vector<std::string>, std::string>> rows = {
      {{kDaemon, "robot.yaml", "--duration", "nan"}, "--duration"},
      {{kDaemon, "robot.yaml", "--duration", "inf"}, "--duration"},
      {{kDaemon, "robot.yaml", "--bus", ""}, "--bus"},
      {{kDaemon, "robot.yaml", "--json"}, "--check"},
      {{kDaemon, "robot.yaml", "--picture", "robot.png"}, "--check"},
      {{kDaemon, "robot.yaml", "--check", "--picture", "robot.jpg"},
       "must end in .png or .svg or .html, not be 'robot.jpg'"},
      {{kCtl, "jog", "robot.yaml", "north", "--by", ""}, "--by"}};
  for (const auto& [command, said] : rows) {
    CAPTURE(said);
    const Ended ended = run(command);
    CHECK(ended.code == kUsage);
    CHECK_THAT(ended.err, Catch::Contains(said));
  }
}

}  // namespace tendril::app::refusals_test
