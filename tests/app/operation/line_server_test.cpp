// SPDX-License-Identifier: Apache-2.0
#include "app/operation/line_server.h"

#include <poll.h>
#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <list>
#include <vector>

#include "tests/app/operation/line_client.h"
#include "tests/app/robot_file.h"

namespace tendril::app::line_server_test {

/// Keeps all that is told.
struct Heard : LineServer::Listener {
  void connected(int client) override { clients.push_back(client); }
  void received(int client, std::string_view line) override { lines.emplace_back(client, line); }
  void too_long(int client) override { long_ones.push_back(client); }
  void gone(int client) override { lost.push_back(client); }

  std::vector<int> clients, long_ones, lost;
  std::vector<std::pair<int, std::string>> lines;
};

struct Bench {
  bool something_to_do() const {
    pollfd event{server.descriptor(), POLLIN, 0};
    return ::poll(&event, 1, 0) == 1;
  }
  /// As often as there is something to do.
  void serve() {
    for (int k = 0; k < 10'000 && something_to_do(); ++k) server.serve();
  }

  RobotFile folder{""};
  std::filesystem::path path = folder.folder() / "robot.sock";
  Heard heard;
  LineServer server{path, heard};
};

TEST_CASE("Lines arrive whole and in order, in whatever pieces they are sent", "[unit]") {
  Bench bench;
  LineClient client(bench.path);
  client.send("one\ntw");
  bench.serve();
  client.send("o\n\nthr");
  bench.serve();
  client.send("ee");
  bench.serve();
  REQUIRE(bench.heard.clients.size() == 1);
  const int number = bench.heard.clients[0];
  using Lines = std::vector<std::pair<int, std::string>>;
  CHECK(bench.heard.lines == Lines{{number, "one"}, {number, "two"}, {number, ""}});
  CHECK_FALSE(bench.something_to_do());
  CHECK(bench.server.send(number, "hello"));
  CHECK(client.receive() == "hello\n");
}

TEST_CASE("A client that goes is told of after its last line", "[unit]") {
  Bench bench;
  {
    LineClient client(bench.path);
    client.send(std::string(500, '\n') + "last\nunfinished");
  }
  bench.serve();
  CHECK(bench.heard.lines.size() == 501);
  CHECK(bench.heard.lines.back().second == "last");
  CHECK(bench.heard.lost == bench.heard.clients);
  CHECK_FALSE(bench.server.send(bench.heard.clients.at(0), "hello"));
}

TEST_CASE("A line that is too long is told of once and skipped, whatever follows is heard", "[unit]") {
  Bench bench;
  LineClient client(bench.path);
  const std::string line(3 * LineServer::kMaxLine, 'x');
  for (std::size_t sent = 0; sent < line.size();) {
    sent += client.send(line.substr(sent));
    bench.serve();
  }
  client.send("\nnext\n");
  bench.serve();
  CHECK(bench.heard.long_ones.size() == 1);
  REQUIRE(bench.heard.lines.size() == 1);
  CHECK(bench.heard.lines[0].second == "next");
}

TEST_CASE("A line is too long also where its end comes with the piece that makes it so", "[unit]") {
  Bench bench;
  LineClient client(bench.path);
  const auto send = [&](std::size_t size) {
    for (std::size_t sent = 0; sent < size;) {
      sent += client.send(std::string(size - sent, 'x'));
      bench.serve();
    }
  };
  send(LineServer::kMaxLine - 1);
  client.send("\n");
  bench.serve();
  send(LineServer::kMaxLine - 1);
  client.send("x\nnext\n");
  bench.serve();
  CHECK(bench.heard.long_ones.size() == 1);
  REQUIRE(bench.heard.lines.size() == 2);
  CHECK(bench.heard.lines[0].second.size() == LineServer::kMaxLine - 1);
  CHECK(bench.heard.lines[1].second == "next");
}

TEST_CASE("A client that does not read loses lines and holds up nobody", "[unit]") {
  Bench bench;
  LineClient deaf(bench.path), other(bench.path);
  bench.serve();
  const int number = bench.heard.clients[0];
  const std::string line(1000, 'x');
  int taken = 0;
  while (taken < 100'000 && bench.server.send(number, line)) ++taken;
  CHECK(taken < 100'000);
  CHECK(bench.server.send(bench.heard.clients[1], "hello"));
  CHECK(other.receive() == "hello\n");
  // What was taken arrives whole, once it reads.
  std::string all;
  for (std::string piece; !(piece = deaf.receive()).empty(); bench.serve()) all += piece;
  CHECK(all.size() == static_cast<std::size_t>(taken) * (line.size() + 1));
  CHECK(bench.server.send(number, line));
}

TEST_CASE("A client that floods is heard a bounded number of lines at a time, all others every time",
          "[law]") {
  Bench bench;
  LineClient flood(bench.path), other(bench.path);
  bench.serve();
  std::string lines;
  for (int k = 0; k < 10'000; ++k) lines += "x\n";
  for (int round = 0; round < 50; ++round) {
    flood.send(lines);
    other.send("me\n");
    bench.heard.lines.clear();
    bench.server.serve();
    bench.server.serve();
    int of_other = 0;
    for (const auto& [client, line] : bench.heard.lines) of_other += line == "me";
    CHECK(of_other == 1);
    CHECK(bench.heard.lines.size() <= 2 * 32 + 1);
    CHECK(bench.something_to_do());
  }
}

TEST_CASE("Clients that never say anything cannot keep others out", "[unit]") {
  Bench bench;
  LineClient speaks(bench.path);
  speaks.send("hello\n");
  bench.serve();
  std::list<LineClient> silent;
  for (int k = 0; k < 3 * LineServer::kMaxClients; ++k) {
    silent.emplace_back(bench.path);
    bench.serve();
  }
  LineClient late(bench.path);
  late.send("here\n");
  bench.serve();
  CHECK(bench.heard.lines.back().second == "here");
  speaks.send("still here\n");
  bench.serve();
  CHECK(bench.heard.lines.back().second == "still here");
  silent.front().receive();
  CHECK(silent.front().ended());
}

TEST_CASE("A socket may be used by user and group, and is gone with the server", "[unit]") {
  std::filesystem::path path;
  RobotFile folder("");
  {
    Heard heard;
    path = folder.folder() / "robot.sock";
    const LineServer server(path, heard);
    struct stat found {};
    REQUIRE(::stat(path.c_str(), &found) == 0);
    CHECK((found.st_mode & 0777) == 0660);
  }
  CHECK_FALSE(std::filesystem::exists(path));
}

TEST_CASE("A path at which nobody can listen is refused with what to do", "[unit]") {
  Heard heard;
  RobotFile folder("");
  const auto refusal = [&](const std::filesystem::path& path) -> std::string {
    try {
      const LineServer server(path, heard);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  const auto path = folder.folder() / "robot.sock";
  CHECK_THAT(refusal(folder.folder() / std::string(120, 'x')), Catch::Contains("1 to 107 bytes"));
  CHECK_THAT(refusal(folder.folder() / "nowhere" / "x.sock"), Catch::Contains("folder that exists"));
  CHECK_THAT(refusal(folder.path()), Catch::Contains("no socket"));
  CHECK(std::filesystem::is_regular_file(folder.path()));
  {
    const LineServer first(path, heard);
    CHECK_THAT(refusal(path), Catch::Contains("another process listens there"));
    const LineClient client(path);  // the first one still does
  }
  CHECK(refusal(path).empty());
}

TEST_CASE("A socket that a killed process left behind is taken over", "[unit]") {
  Heard heard;
  RobotFile folder("");
  const auto path = folder.folder() / "robot.sock", other = folder.folder() / "other.sock";
  {
    const LineServer first(path, heard);
    std::filesystem::create_hard_link(path, other);  // outlives it
  }
  REQUIRE(std::filesystem::is_socket(other));
  const LineServer second(other, heard);
  const LineClient client(other);
}

}  // namespace tendril::app::line_server_test
