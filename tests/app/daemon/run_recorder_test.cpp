// SPDX-License-Identifier: Apache-2.0
#include "app/daemon/run_recorder.h"

#include <catch2/catch.hpp>
#include <memory>

#include "tests/app/program/programs.h"

namespace tendril::app::run_recorder_test {

constexpr int64_t kStart_ns = 5'000'000'000;
constexpr int64_t kMillisecond_ns = 1'000'000;
constexpr double kSpeed = 0.01;  // m/s along x

/// A robot whose tip is controlled in x and z, on the way from the origin in x.
Config straight() {
  Config config;
  config.robot = "straight";
  config.effectors = {{"tip", {}, {true, false, true}, {}, {1, 1}}};
  config.actuators.resize(1);
  config.actuators[0].name = "north";
  config.sensors = {
      {{.name = "camera", .id = 0x1F0, .signals = std::vector<hal::Signal>(3)},
       {{.effector = 0, .axis = 0}, {.effector = 0, .axis = 1}, {.effector = 0, .axis = 2}}},
      {{.name = "cells", .id = 0x1F1, .signals = std::vector<hal::Signal>(1)}, {{.actuator = 0}}}};
  config.motion = MotionConfig{{0, 0, 0}, {{0, 0, 0}, {1, 0, 0}}, kSpeed, false};
  return config;
}

/// A run that a test writes cycle by cycle. Motion begins at kStart_ns without an approach.
struct Recording {
  Recording() : recorder(config, folder.folder() / "report") {}

  /// A cycle of the phase kRunning, `at_ms` after the start.
  rt::TraceRecord cycle(int at_ms) const {
    rt::TraceRecord record;
    record.intended_ns = kStart_ns + at_ms * kMillisecond_ns;
    record.phase = rt::Phase::kRunning;
    record.qp_solved = true;
    record.qp_iterations = 2;
    return record;
  }

  /// The same with a sighting of the tip at (x, 0.5, 0), seen `seen_ms` after the start.
  rt::TraceRecord sighting(int at_ms, int seen_ms, double x) const {
    rt::TraceRecord record = cycle(at_ms);
    record.sensors.stamp_ns[0] = kStart_ns + seen_ms * kMillisecond_ns;
    record.sensors.value = {x, 0.5, 0};  // y is not controlled: it is no error
    return record;
  }

  nlohmann::json finish(const RunFacts& facts = {}) {
    recorder.finish(facts, *counts);
    return read_summary(folder.folder() / "report");
  }

  Trace trace() const { return read_trace(folder.folder() / "report"); }

  RobotFile folder{""};
  Config config = straight();
  RunRecorder recorder;
  Motion motion{config, rt::EffectorVector::Zero(2), {kStart_ns, rt::EffectorVector::Zero(2)}};
  std::unique_ptr<rt::LoopCounts> counts = std::make_unique<rt::LoopCounts>();
};

TEST_CASE("The report tells what share of the bus our frames took", "[unit]") {
  Recording recording;
  recording.config.bus.bitrate = 500'000;
  for (int at_ms = 0; at_ms <= 100; ++at_ms) {
    rt::TraceRecord record = recording.cycle(at_ms);
    record.bus_bits = at_ms == 0 ? 1'000'000 : 300;  // what came before the first cycle does not count
    recording.recorder.add(record, nullptr);
  }
  CHECK(recording.finish()["bus_load"].get<double>() == Approx(0.6));
}

TEST_CASE("A sighting is compared with where the target was when the camera saw the tip", "[unit]") {
  Recording run;
  // Seen at 1000 ms, when 10 mm were wanted, and known at 1200 ms, when 12 mm are.
  run.recorder.add(run.sighting(1200, 1000, 0.010), &run.motion);
  REQUIRE(run.recorder.last_error_mm());
  CHECK(*run.recorder.last_error_mm() == Approx(0).margin(1e-6));
  run.recorder.add(run.sighting(1400, 1200, 0.0125), &run.motion);
  CHECK(*run.recorder.last_error_mm() == Approx(0.5));
  const nlohmann::json error = run.finish().at("tracking_error_mm");
  CHECK(error.at("samples") == 2);
  CHECK(error.at("mean").get<double>() == Approx(0.25));
  CHECK(error.at("max").get<double>() == Approx(0.5));
}

TEST_CASE("The model's error is that of the pose it had when the camera saw the tip", "[unit]") {
  Recording run;
  for (int ms = 0; ms <= 1000; ms += 100) {
    rt::TraceRecord record = ms == 1000 ? run.sighting(ms, 690, 0.5) : run.cycle(ms);
    record.p_e = {0.001 * ms, 0.003};  // at 700 ms: 0.7 m, and 3 mm beside in z
    run.recorder.add(record, &run.motion);
  }
  const nlohmann::json error = run.finish().at("model_error_mm");
  CHECK(error.at("mean").get<double>() == Approx(std::hypot(200, 3)));
  CHECK(error.at("max").get<double>() == Approx(std::hypot(200, 3)));
}

TEST_CASE(
    "The distance from target to model is that on the path, not that to a target held, and more than 1 mm is "
    "a warning",
    "[unit]") {
  const bool far = GENERATE(true, false);
  Recording run;
  for (int ms = 0; ms <= 1000; ms += 100) {
    rt::TraceRecord record = run.cycle(ms);
    record.p_e = {kSpeed * 1e-3 * ms, ms == 700 ? (far ? 0.0012 : 0.0009) : 0};
    record.desired = record.p_e;  // whatever the controller served
    run.recorder.add(record, &run.motion);
  }
  const nlohmann::json summary = run.finish();
  const nlohmann::json& error = summary.at("target_to_model_mm");
  CHECK(error.at("max").get<double>() == Approx(far ? 1.2 : 0.9));
  CHECK(error.at("max_at_s").get<double>() == Approx(0.7));
  CHECK(error.at("mean").get<double>() == Approx(error.at("max").get<double>() / 11));
  REQUIRE(summary.at("warnings").size() == (far ? 1 : 0));
  if (far)
    CHECK_THAT(summary.at("warnings").at(0).get<std::string>(),
               Catch::StartsWith("the model was up to 1.20 mm from the target, at 0.70 s"));
}

TEST_CASE("The p95 of the tracking error is the least value that 95 % of the samples do not exceed",
          "[unit]") {
  Recording run;
  for (int k = 1; k <= 100; ++k) {  // errors of 0.01 to 1 mm, in an order that is not theirs
    const int share = k * 37 % 101;
    run.recorder.add(run.sighting(10 * k, 10 * k, 1e-4 * k + 1e-5 * share), &run.motion);
  }
  const nlohmann::json error = run.finish().at("tracking_error_mm");
  CHECK(error.at("samples") == 100);
  CHECK(error.at("mean").get<double>() == Approx(0.505));
  CHECK(error.at("p95").get<double>() == Approx(0.95));
  CHECK(error.at("max").get<double>() == Approx(1.0));
}

TEST_CASE("A sighting counts once, while the robot is on its path or goes where an operator wants it",
          "[unit]") {
  Recording run;
  run.recorder.add(run.sighting(100, -50, 1), &run.motion);  // seen before the path began
  CHECK_FALSE(run.recorder.last_error_mm());
  for (const int ms : {200, 210, 220}) run.recorder.add(run.sighting(ms, 200, 0.002), &run.motion);
  run.recorder.add(run.sighting(230, 230, 0.003), nullptr);  // to an operator's target
  rt::TraceRecord stopping = run.sighting(240, 240, 1);
  stopping.phase = rt::Phase::kStopping;
  run.recorder.add(stopping, &run.motion);
  CHECK(run.finish().at("tracking_error_mm").at("samples") == 2);
  const Trace trace = run.trace();
  std::string known;  // in which rows the sighting stands
  for (std::size_t row = 0; row < trace.rows.size(); ++row)
    known += trace.cell(row, "measured_x_m").empty() ? '-' : 'x';
  CHECK(known == "xx--xx");
}

TEST_CASE("What no sensor has told is null and its cells empty", "[unit]") {
  Recording run;
  for (int ms = 0; ms < 100; ms += 10) run.recorder.add(run.cycle(ms), &run.motion);
  const nlohmann::json summary = run.finish();
  CHECK(summary.at("tracking_error_mm").is_null());
  CHECK(summary.at("model_error_mm").is_null());
  CHECK(summary.at("effort_error").at("north").is_null());
  CHECK_FALSE(run.recorder.last_error_mm());
  for (const char* column : {"measured_x_m", "measured_y_m", "measured_z_m", "measured_t_s"})
    CHECK(run.trace().cell(0, column).empty());
}

TEST_CASE("A measured effort stands beside the model's, and is held against it at its own instant",
          "[unit]") {
  Recording run;
  const auto cycle = [&run](int at_ms, int measured_ms, double measured, double solved) {
    rt::TraceRecord record = run.cycle(at_ms);
    record.sensors.stamp_ns[1] = kStart_ns + measured_ms * kMillisecond_ns;
    record.sensors.value[3] = measured;
    record.lambda[0] = solved;
    run.recorder.add(record, nullptr);
  };
  cycle(0, -10, 9, 1);  // measured before the drives followed
  cycle(10, 0, 1.5, 2);
  cycle(20, 0, 1.5, 3);  // nothing new
  cycle(30, 20, 2.75, 4);
  const nlohmann::json error = run.finish().at("effort_error").at("north");
  CHECK(error.at("samples") == 2);
  CHECK(error.at("mean").get<double>() == Approx((0.5 + 0.25) / 2));
  CHECK(error.at("max").get<double>() == Approx(0.5));
  CHECK(error.at("unit") == "N");
  const Trace trace = run.trace();
  CHECK(trace.number(0, "measured_north_N") == 9);
  CHECK(trace.number(1, "measured_north_N") == 1.5);
  CHECK(trace.cell(2, "measured_north_N").empty());
  CHECK(trace.number(3, "measured_north_N") == 2.75);
}

TEST_CASE("Coordinates from several sensors make one error, each at its own instant", "[unit]") {
  Config config = straight();
  config.sensors = {
      {{.name = "laser", .signals = std::vector<hal::Signal>(1)}, {{.effector = 0, .axis = 0}}},
      {{.name = "scale", .signals = std::vector<hal::Signal>(1)}, {{.effector = 0, .axis = 2}}}};
  const RobotFile folder("");
  RunRecorder recorder(config, folder.folder());
  const Motion motion(config, rt::EffectorVector::Zero(2), {kStart_ns, rt::EffectorVector::Zero(2)});
  rt::TraceRecord record;
  record.phase = rt::Phase::kRunning;
  record.intended_ns = kStart_ns + 300 * kMillisecond_ns;
  record.sensors.stamp_ns[0] = kStart_ns + 100 * kMillisecond_ns;
  record.sensors.value = {0.001 + 0.003,
                          0.004};  // in x 3 mm ahead of where it is wanted at 100 ms, in z 4 mm
  recorder.add(record, &motion);
  CHECK_FALSE(recorder.last_error_mm());
  record.intended_ns += 10 * kMillisecond_ns;
  record.sensors.stamp_ns[1] = kStart_ns + 200 * kMillisecond_ns;
  recorder.add(record, &motion);
  REQUIRE(recorder.last_error_mm());
  CHECK(*recorder.last_error_mm() == Approx(5));
}

TEST_CASE("What sensors tell of a further effector has columns of its own", "[unit]") {
  Config config = straight();
  config.effectors.push_back({"middle", {}, {true, true, true}, {}, {1, 1, 1}});
  config.sensors = {
      {{.name = "camera", .signals = std::vector<hal::Signal>(1)}, {{.effector = 1, .axis = 1}}}};
  const RobotFile folder("");
  RunRecorder recorder(config, folder.folder());
  rt::TraceRecord record;
  record.intended_ns = kStart_ns;
  record.sensors.stamp_ns[0] = kStart_ns;
  record.sensors.value[0] = 0.012;
  recorder.add(record, nullptr);
  recorder.finish({}, *std::make_unique<rt::LoopCounts>());
  CHECK(read_trace(folder.folder()).number(0, "measured_middle_y_m") == 0.012);
}

TEST_CASE("The summary counts the losses of each sensor", "[unit]") {
  Recording run;
  for (int ms = 0; ms < 100; ms += 10) {
    rt::TraceRecord record = run.cycle(ms);
    record.sensors.fresh[0] = ms != 30 && ms != 40 && ms != 70;
    record.sensors.fresh[1] = true;
    run.recorder.add(record, &run.motion);
  }
  const nlohmann::json sensors = run.finish().at("sensors");
  CHECK(sensors.at("camera").at("losses") == 2);
  CHECK(sensors.at("camera").at("stale_s").get<double>() == Approx(0.03));
  CHECK(sensors.at("cells") == nlohmann::json{{"losses", 0}, {"stale_s", 0.0}});
}

TEST_CASE("What is not known in a cycle is an empty cell, what is known stands in its column", "[unit]") {
  Recording run;
  rt::TraceRecord connecting = run.cycle(0);
  connecting.phase = rt::Phase::kConnecting;
  connecting.qp_solved = false;
  connecting.qp_iterations = 0;
  connecting.measured[0] = 0.0015;
  run.recorder.add(connecting, nullptr);
  rt::TraceRecord running = run.sighting(100, 90, 0.0012);
  running.desired = {0.001, -0.1};
  running.p_e = {0.0011, -0.101};
  running.command[0] = 0.0025;
  running.lambda[0] = 1.5;
  running.snapshot_age_ns = 3 * kMillisecond_ns;
  running.wakeup_ns = 12'340;
  run.recorder.add(running, &run.motion);
  run.finish();

  const Trace trace = run.trace();
  REQUIRE(trace.rows.size() == 2);
  for (const char* column : {"target_x_m", "target_y_m", "target_z_m", "model_x_m", "model_z_m", "qp_status"})
    CHECK(trace.cell(0, column).empty());
  CHECK(trace.cell(0, "phase") == "connect");
  CHECK(trace.number(0, "displacement_north_m") == 0.0015);
  CHECK(trace.number(1, "t_s") == 0.1);
  CHECK(trace.cell(1, "phase") == "run");
  CHECK(trace.number(1, "target_x_m") == 0.001);
  CHECK(trace.cell(1, "target_y_m").empty());
  CHECK(trace.number(1, "target_z_m") == -0.1);
  CHECK(trace.number(1, "model_z_m") == -0.101);
  CHECK(trace.number(1, "measured_x_m") == 0.0012);
  CHECK(trace.number(1, "measured_y_m") == 0.5);
  CHECK(trace.number(1, "measured_t_s") == 0.09);
  CHECK(trace.number(1, "command_north_m") == 0.0025);
  CHECK(trace.number(1, "effort_north_N") == 1.5);
  CHECK(trace.cell(1, "qp_status") == "optimal");
  CHECK(trace.number(1, "snapshot_age_s") == 0.003);
  CHECK(trace.number(1, "wakeup_us") == 12.34);
}

TEST_CASE("The way to the path and the path itself have phases of their own in the trace", "[unit]") {
  Recording run;
  const Motion motion(run.config, rt::EffectorVector::Zero(2),
                      {kStart_ns, rt::EffectorVector::Constant(2, 0.01)});  // 1414 ms away
  for (const int ms : {0, 1400, 1430}) run.recorder.add(run.cycle(ms), &motion);
  run.recorder.add(run.cycle(1435), nullptr);  // to an operator's target
  rt::TraceRecord disabling = run.cycle(1440);
  disabling.phase = rt::Phase::kDisabling;
  run.recorder.add(disabling, &motion);
  run.finish();
  const Trace trace = run.trace();
  CHECK(trace.cell(0, "phase") == "approach");
  CHECK(trace.cell(1, "phase") == "approach");
  CHECK(trace.cell(2, "phase") == "run");
  CHECK(trace.cell(3, "phase") == "run");
  CHECK(trace.cell(4, "phase") == "stop");
}

TEST_CASE("The summary names the reason of a stop, then every fault with its cycles", "[unit]") {
  Recording run;
  for (int ms = 0; ms < 100; ms += 10) {
    rt::TraceRecord record = run.cycle(ms);
    if (ms < 30) record.faults.add(rt::Fault::kTargetStale);
    if (ms == 90) record.faults.add(rt::Fault::kDrives);  // the reason of the stop itself is not repeated
    record.qp_solved = true;
    record.qp_iterations = ms == 50 ? 7 : 1;
    if (ms >= 80) record.qp_status = qp::Status::kSoftened;
    record.p_e = {kSpeed * 1e-3 * ms};
    run.recorder.add(record, &run.motion);
  }
  run.counts->cycles = 12;
  run.counts->late_cycles = 2;
  RunFacts facts;
  facts.model_refreshes = 30;
  facts.iteration_cap = 64;
  facts.model_rate_hz = 60;
  facts.stop_reason = "axis 'north': heartbeat lost";
  const nlohmann::json summary = run.finish(facts);
  CHECK(summary.at("faults") == nlohmann::json::array({"axis 'north': heartbeat lost"}));
  CHECK(summary.at("warnings") ==
        nlohmann::json::array({"the newest target is older than its limit (3 cycles)"}));
  CHECK(summary.at("qp").at("iterations_max") == 7);
  CHECK(summary.at("qp").at("cap") == 64);
  CHECK(summary.at("qp").at("statuses") == nlohmann::json{{"optimal", 8}, {"softened", 2}});
  CHECK(summary.at("duration_s").get<double>() == Approx(0.09));
  CHECK(summary.at("cycles") == 12);
  CHECK(summary.at("late_cycles") == 2);
  CHECK(summary.at("success_rate").get<double>() == Approx(10.0 / 12));
  CHECK(summary.at("model_rate_hz") == 60.0);
}

TEST_CASE("A run that never ran has a summary all the same", "[unit]") {
  Recording run;
  rt::TraceRecord connecting = run.cycle(0);
  connecting.phase = rt::Phase::kConnecting;
  run.recorder.add(connecting, nullptr);
  RunFacts facts;
  facts.stop_reason = "the bus is down";
  const nlohmann::json summary = run.finish(facts);
  CHECK(summary.at("duration_s") == 0.0);
  CHECK(summary.at("model_rate_hz") == 0.0);
  CHECK(summary.at("faults") == nlohmann::json::array({"the bus is down"}));
}

TEST_CASE("A report folder that cannot be made is refused with its name", "[unit]") {
  const RobotFile file("");
  const std::filesystem::path below_a_file = file.path() / "report";
  CHECK_THROWS_WITH(RunRecorder(straight(), below_a_file),
                    Catch::Contains((below_a_file / "trace.csv").string()) && Catch::Contains("--report"));
}

}  // namespace tendril::app::run_recorder_test
