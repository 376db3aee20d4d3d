// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <random>

#include "app/operation/control_server.h"
#include "app/operation/surface_messages.h"
#include "tests/app/operation/line_client.h"
#include "tests/app/operation/small_robot.h"
#include "tests/app/robot_file.h"

namespace tendril::app::body_watch_test {

using nlohmann::json;

struct Bench {
  void show() { server.show_body(R"({"surface":{"nodes_mm":[]}})", channel); }
  /// The model thread publishes a surface.
  void publish(double time_s, Eigen::Index points = 4) {
    rt::Surface& surface = channel.surfaces.back();
    surface.stamp_ns = static_cast<int64_t>(1e9 * time_s);
    surface.positions = Eigen::Matrix3Xf::Random(3, points);
    channel.surfaces.publish();
    server.serve();
  }

  RobotFile folder{""};
  std::filesystem::path path = folder.folder() / "robot.sock";
  Config config = small_robot();
  TargetSource targets{config, rt::EffectorVector::Zero(2)};
  rt::Requests requests;
  rt::SurfaceChannel channel;
  NoDrives drives;
  ControlServer server{path, config, targets, requests, drives};
};

class Client {
 public:
  explicit Client(Bench& bench) : bench_(bench), client_(bench.path) { (void)messages(); }

  /// All that has come.
  std::vector<json> messages() {
    std::string text;
    for (int k = 0; k < 3; ++k) bench_.server.serve();
    for (std::string piece; !(piece = client_.receive()).empty(); bench_.server.serve()) text += piece;
    std::vector<json> result;
    for (std::size_t begin = 0, end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1)
      result.push_back(json::parse(text.substr(begin, end - begin)));
    return result;
  }
  json ask(const json& request) {
    client_.send(request.dump() + "\n");
    const auto answers = messages();
    REQUIRE(answers.size() == 1);
    return answers[0];
  }

 private:
  Bench& bench_;
  LineClient client_;
};

std::string bytes_of(const std::string& text) {
  static const std::string kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  uint32_t bits = 0;
  int count = 0;
  for (const char letter : text) {
    const std::size_t value = kLetters.find(letter);
    if (value == std::string::npos) break;
    bits = bits << 6 | static_cast<uint32_t>(value);
    if ((count += 6) >= 8) bytes += static_cast<char>(bits >> (count -= 8) & 0xFF);
  }
  return bytes;
}

TEST_CASE("Base64 is that of the standard's own examples", "[unit]") {
  for (const auto& [bytes, text] : std::map<std::string, std::string>{{"", ""},
                                                                      {"f", "Zg=="},
                                                                      {"fo", "Zm8="},
                                                                      {"foo", "Zm9v"},
                                                                      {"foobar", "Zm9vYmFy"},
                                                                      {"\xff\xfe", "//4="}})
    CHECK(base64(bytes) == text);
}

TEST_CASE("A surface of 25 000 nodes fits 256 KiB, each within a step of where it is", "[law]") {
  rt::Surface surface;
  surface.stamp_ns = 1'500'000'000;
  surface.positions = 0.1F * Eigen::Matrix3Xf::Random(3, 25'000);
  const std::string line = surface_message(surface);
  CHECK(line.size() < LineServer::kMaxUnread);
  const json message = json::parse(line).at("surface");
  CHECK(message.at("time") == 1.5);
  const double step = message.at("step");
  CHECK(step < 0.21 / 65'535);
  const std::string bytes = bytes_of(message.at("positions"));
  REQUIRE(bytes.size() == 2 * 3 * 25'000);
  double farthest = 0;
  for (std::size_t k = 0; k < 3 * 25'000; ++k) {
    const int number = static_cast<uint8_t>(bytes[2 * k]) | static_cast<uint8_t>(bytes[2 * k + 1]) << 8;
    const double value = message.at("origin").at(k % 3).get<double>() + step * number;
    farthest = std::max(farthest, std::abs(value - static_cast<double>(surface.positions.data()[k])));
  }
  CHECK(farthest < 0.51 * step);
}

TEST_CASE("A surface without extent, or without points, is told without numbers that are none", "[unit]") {
  rt::Surface surface;
  surface.positions = Eigen::Matrix3Xf::Constant(3, 2, 0.5F);
  const json message = json::parse(surface_message(surface)).at("surface");
  CHECK(message.at("origin") == json{0.5, 0.5, 0.5});
  CHECK(bytes_of(message.at("positions")) == std::string(12, '\0'));
  surface.positions.resize(3, 0);
  CHECK(json::parse(surface_message(surface)).at("surface").at("positions") == "");
}

TEST_CASE("The body's geometry is told once it is known, with the id of the request", "[unit]") {
  Bench bench;
  Client client(bench);
  CHECK(client.ask({{"command", "geometry"}}).at("error").at("code") == "not_running");
  CHECK(client.ask({{"command", "surface"}, {"rate", 30}}).at("error").at("code") == "not_running");
  bench.show();
  const json answer = client.ask({{"id", {"a", "\""}}, {"command", "geometry"}});
  CHECK(answer ==
        json{{"id", {"a", "\""}}, {"ok", true}, {"geometry", {{"surface", {{"nodes_mm", json::array()}}}}}});
}

TEST_CASE("Surfaces are made as fast as the fastest subscriber wants, and not at all without one", "[unit]") {
  Bench bench;
  bench.show();
  CHECK(bench.channel.wanted_hz == 0);
  Client slow(bench);
  CHECK(slow.ask({{"command", "surface"}, {"rate", 5}}).at("ok") == true);
  {
    Client fast(bench);
    fast.ask({{"command", "surface"}, {"rate", 30}});
    CHECK(bench.channel.wanted_hz == 30);
    int of_slow = 0, of_fast = 0;
    for (int k = 1; k <= 30; ++k) {
      bench.publish(k / 30.0);
      of_slow += static_cast<int>(slow.messages().size());
      of_fast += static_cast<int>(fast.messages().size());
    }
    CHECK(of_fast == 30);
    CHECK(of_slow >= 5);
    CHECK(of_slow <= 6);
  }
  bench.server.serve();
  CHECK(bench.channel.wanted_hz == 5);
  slow.ask({{"command", "surface"}, {"rate", 0}});
  CHECK(bench.channel.wanted_hz == 0);
  bench.publish(2);
  CHECK(slow.messages().empty());
}

TEST_CASE("A client that does not read loses surfaces, and still gets what it asks for", "[unit]") {
  Bench bench;
  bench.show();
  Client client(bench);
  client.ask({{"command", "surface"}, {"rate", 30}});
  for (int k = 1; k <= 100; ++k) bench.publish(k / 10.0, 25'000);
  const std::size_t surfaces = client.messages().size();
  CHECK(surfaces >= 1);
  CHECK(surfaces < 10);
  bench.publish(20);
  const auto next = client.messages();
  REQUIRE(next.size() == 1);
  CHECK(next[0].at("surface").at("time") == 20);
  CHECK(client.ask({{"command", "status"}}).at("ok") == true);
}

}  // namespace tendril::app::body_watch_test
