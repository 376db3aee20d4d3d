// SPDX-License-Identifier: Apache-2.0
#include "app/operation/control_server.h"

#include <catch2/catch.hpp>

#include "rt/periodic_clock.h"
#include "tests/app/operation/line_client.h"
#include "tests/app/operation/small_robot.h"
#include "tests/app/robot_file.h"

namespace tendril::app::control_server_test {

using nlohmann::json;

Config robot() {
  Config config = small_robot();
  config.motion = MotionConfig{{0, 0, 0.1}, {{0, 0, 0}, {0.03, 0, 0}}, 0.02, true};
  return config;
}

/// A robot that runs, as far as the server can tell.
struct Bench {
  Bench() {
    record.phase = rt::Phase::kRunning;
    record.p_e = {0.001, 0.1};
  }
  void run() {
    rt::EffectorVector p_e(2);
    p_e << 0.001, 0.1;
    targets.begin({rt::now_ns(), p_e});
    server.add(record);
  }

  RobotFile folder{""};
  std::filesystem::path path = folder.folder() / "robot.sock";
  Config config = robot();
  TargetSource targets{config, rt::EffectorVector::Zero(2)};
  rt::Requests requests;
  NoDrives drives;
  ControlServer server{path, config, targets, requests, drives};
  rt::TraceRecord record;
};

/// A client whose messages are read one by one.
class Client {
 public:
  explicit Client(Bench& bench) : bench_(bench), client_(bench.path) { greeting = next(); }

  /// The next message; null where there is none.
  json next() {
    for (int k = 0; k < 3; ++k) bench_.server.serve();
    received_ += client_.receive();
    const std::size_t end = received_.find('\n');
    if (end == std::string::npos) return nullptr;
    const json message = json::parse(received_.substr(0, end));
    received_.erase(0, end + 1);
    return message;
  }
  json ask(const json& request) {
    client_.send(request.dump() + "\n");
    return next();
  }
  /// The code of the refusal; "ok" where there is none.
  std::string code(const json& request) {
    const json answer = ask(request);
    return answer.at("ok").get<bool>() ? "ok" : answer.at("error").at("code").get<std::string>();
  }

  json greeting;

 private:
  Bench& bench_;
  LineClient client_;
  std::string received_;
};

const json kGo{{"command", "target"}, {"position", {{"tip.x", 0.01}}}, {"in", 0}};

TEST_CASE("A client is greeted with robot, version and coordinates, and answered by its own id", "[unit]") {
  Bench bench;
  Client client(bench);
  CHECK(client.greeting.at("robot") == "finger");
  CHECK(client.greeting.at("version") == kControlProtocol);
  CHECK(client.greeting.at("coordinates") == json{"tip.x", "tip.z"});
  const json answer = client.ask({{"id", {1, "b"}}, {"command", "status"}});
  CHECK(answer.at("id") == json{1, "b"});
  CHECK(answer.at("ok") == true);
  CHECK(answer.at("state").at("mode") == "none");
  CHECK(client.ask({{"id", 7}, {"command", "dance"}}).at("id") == 7);
}

TEST_CASE("One client has the control: others watch, or take it away, and the first is told", "[unit]") {
  Bench bench;
  bench.run();
  Client first(bench), second(bench);
  CHECK(first.code(kGo) == "no_control");
  CHECK(bench.targets.mode() == TargetSource::Mode::kPath);  // as it was
  CHECK(first.code({{"command", "acquire"}}) == "ok");
  CHECK(first.code({{"command", "acquire"}}) == "ok");  // it has it already
  CHECK(first.code(kGo) == "ok");
  CHECK(second.code(kGo) == "no_control");
  CHECK(second.code({{"command", "acquire"}}) == "control_taken");
  CHECK(second.code({{"command", "release"}}) == "no_control");
  CHECK(second.code({{"command", "status"}}) == "ok");
  CHECK(second.code({{"command", "acquire"}, {"steal", true}}) == "ok");
  CHECK(first.next().at("event") == "control_lost");
  CHECK(first.code(kGo) == "no_control");
  CHECK(second.code(kGo) == "ok");
  CHECK(second.code({{"command", "release"}}) == "ok");
  CHECK(first.code({{"command", "acquire"}}) == "ok");
}

TEST_CASE("A client that goes away gives the control back, and the robot stays at its last target",
          "[unit]") {
  Bench bench;
  bench.run();
  {
    Client client(bench);
    REQUIRE(client.code({{"command", "acquire"}}) == "ok");
    REQUIRE(client.code(kGo) == "ok");
  }
  Client other(bench);
  CHECK(other.code({{"command", "acquire"}}) == "ok");
  CHECK(bench.targets.wanted(rt::now_ns() + 1'000'000'000)[0] == Approx(0.01));
}

TEST_CASE("A target leaves alone what it does not name, and goes at the speed that is asked for", "[unit]") {
  Bench bench;
  bench.run();
  Client client(bench);
  client.ask({{"command", "acquire"}});
  client.ask({{"command", "hold"}});
  const rt::EffectorVector from = bench.targets.wanted(rt::now_ns());
  const int64_t before_ns = rt::now_ns();
  CHECK(client.ask({{"command", "target"}, {"position", {{"tip.x", from[0] + 0.1}}}, {"speed", 0.001}})
            .at("mode") == "target");
  const double most_s = 1e-9 * static_cast<double>(rt::now_ns() + 1'000'000'000 - before_ns);
  const rt::EffectorVector then = bench.targets.wanted(rt::now_ns() + 1'000'000'000);
  CHECK(then[0] - from[0] >= 0.001);
  CHECK(then[0] - from[0] <= 0.001 * most_s * 1.001 + 1e-6);
  CHECK(then[1] == from[1]);
}

TEST_CASE("A robot that does not run takes no targets", "[unit]") {
  Bench bench;
  Client client(bench);
  client.ask({{"command", "acquire"}});
  CHECK(client.code(kGo) == "not_running");
  bench.run();
  CHECK(client.code(kGo) == "ok");
  bench.record.phase = rt::Phase::kStopping;
  bench.server.add(bench.record);
  CHECK(client.code(kGo) == "not_running");
}

TEST_CASE("A fault that stops the robot is told with what to do, and reset once it stands", "[unit]") {
  Bench bench;
  bench.run();
  Client client(bench);
  client.ask({{"command", "acquire"}});
  CHECK(client.code({{"command", "reset"}}) == "no_fault");
  bench.record.intended_ns = 2'500'000'000;
  bench.record.latched = {true, rt::Fault::kDrives, {hal::FaultKind::kBusOff}, -1, 2'000'000'000};
  bench.record.phase = rt::Phase::kStopping;
  bench.server.add(bench.record);
  CHECK(client.code({{"command", "reset"}}) == "not_standby");
  bench.record.phase = rt::Phase::kStandby;
  bench.server.add(bench.record);
  const json fault = client.ask({{"command", "status"}}).at("state").at("fault");
  CHECK(fault.at("what") == hal::name(hal::FaultKind::kBusOff));
  CHECK(fault.at("since") == 2.0);
  CHECK_THAT(fault.at("do").get<std::string>(), Catch::Contains("terminations"));
  CHECK(client.code({{"command", "enable"}}) == "faulted");
  CHECK(client.code(kGo) == "not_running");
  CHECK(bench.requests.resets == 0);
  CHECK(client.code({{"command", "reset"}}) == "ok");
  CHECK(bench.requests.resets == 1);
}

TEST_CASE("Anybody may have the drives disabled, in any phase; who enables them has the control", "[unit]") {
  Bench bench;
  Client client(bench);
  CHECK(client.code({{"command", "disable"}}) == "ok");
  CHECK(bench.requests.standby);
  CHECK(client.code({{"command", "enable"}}) == "no_control");
  client.ask({{"command", "acquire"}});
  CHECK(client.code({{"command", "enable"}}) == "ok");
  CHECK_FALSE(bench.requests.standby);
}

TEST_CASE("The path is played, paused and slowed by its commands, and the run ended", "[unit]") {
  Bench bench;
  bench.run();
  Client client(bench);
  client.ask({{"command", "acquire"}});
  CHECK(client.ask({{"command", "pause"}}).at("mode") == "paused");
  CHECK(client.ask({{"command", "resume"}}).at("mode") == "path");
  CHECK(client.ask({{"command", "hold"}}).at("mode") == "hold");
  CHECK(client.ask({{"command", "play"}}).at("mode") == "path");
  CHECK(client.code({{"command", "set"}, {"path_rate", 0.25}}) == "ok");
  CHECK(bench.targets.path_rate() == 0.25);
}

TEST_CASE("Whoever may connect may stop the robot, with or without the control", "[law]") {
  Bench bench;
  bench.run();
  Client holder(bench), other(bench);
  const bool has_control = GENERATE(false, true), is_held = GENERATE(false, true);
  if (is_held) CHECK(holder.code({{"command", "acquire"}}) == "ok");
  CHECK_FALSE(bench.requests.stop);
  CHECK((has_control ? holder : other).code({{"command", "stop"}}) == "ok");
  CHECK(bench.requests.stop);
}

TEST_CASE("A refusal has the id of its request, where the line has one", "[unit]") {
  Bench bench;
  Client client(bench);
  for (const json& request : {json{{"id", "a"}, {"command", "dance"}}, json{{"id", "a"}, {"version", 7}},
                              json{{"id", "a"}, {"command", "play"}, {"rate", 1}}, json{{"id", "a"}}}) {
    const json answer = client.ask(request);
    CHECK(answer.at("ok") == false);
    CHECK(answer.at("id") == "a");
  }
  CHECK(client.ask(json::array({1})).at("id").is_null());
}

TEST_CASE("A client that takes the control and gives it back again and again gets a line of log a second",
          "[unit]") {
  RateLimitedLog log;
  constexpr int64_t kSecond_ns = 1'000'000'000, kStart_ns = 5 * kSecond_ns;
  CHECK(log.due(kStart_ns).empty());
  log.say("control acquired by anna");
  CHECK(log.due(kStart_ns) == "control acquired by anna");
  for (int k = 0; k < 1000; ++k) {
    log.say("control released by anna");
    CHECK(log.due(kStart_ns + k).empty());
    log.say("control acquired by anna");
  }
  log.say("control released by anna");
  CHECK(log.due(kStart_ns + kSecond_ns) == "control released by anna (the last of 2001 changes)");
  CHECK(log.due(kStart_ns + 9 * kSecond_ns).empty());
  log.say("control acquired by anna");
  CHECK(log.take() == "control acquired by anna");
  CHECK(log.take().empty());
}

TEST_CASE("States come at the rate asked for, and no more once it is 0", "[unit]") {
  Bench bench;
  bench.run();
  Client client(bench);
  client.ask({{"command", "subscribe"}, {"rate", 100}});
  const int64_t start_ns = rt::now_ns();
  for (int k = 1; k <= 600; ++k) {  // a second at 600 Hz
    bench.record.intended_ns = start_ns + k * 1'000'000'000LL / 600;
    bench.server.add(bench.record);
  }
  int states = 0;
  double last_s = 0;
  for (json message; !(message = client.next()).is_null(); ++states) {
    CHECK(message.at("state").at("time").get<double>() > last_s);
    last_s = message.at("state").at("time").get<double>();
  }
  CHECK((states == 100 || states == 101));  // the first comes at once
  CHECK(client.code({{"command", "subscribe"}, {"rate", 0}}) == "ok");
  bench.record.intended_ns += 1'000'000'000;
  bench.server.add(bench.record);
  CHECK(client.next().is_null());
}

}  // namespace tendril::app::control_server_test
