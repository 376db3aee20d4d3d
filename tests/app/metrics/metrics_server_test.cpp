// SPDX-License-Identifier: Apache-2.0
#include "app/metrics/metrics_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cerrno>
#include <list>

namespace tendril::app::metrics_server_test {

/// A browser in the same thread, which never waits.
class Client {
 public:
  explicit Client(const MetricsServer& server) {
    const std::string address = server.address();
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    REQUIRE(::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0);
  }
  ~Client() { ::close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void send(const std::string& text) { ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL); }
  /// All that has come.
  std::string receive() {
    std::string all;
    char piece[4096];
    ssize_t size;
    while ((size = ::recv(socket_, piece, sizeof piece, MSG_DONTWAIT)) > 0)
      all.append(piece, static_cast<std::size_t>(size));
    ended_ = size == 0 || (size < 0 && errno != EAGAIN);
    return all;
  }
  bool ended() const { return ended_; }

 private:
  int socket_;
  bool ended_ = false;
};

struct Bench {
  /// As often as there is something to do.
  void serve() {
    pollfd event{server.descriptor(), POLLIN, 0};
    for (int k = 0; k < 1000 && ::poll(&event, 1, 20) == 1; ++k) server.serve();
  }

  int asked = 0;
  std::string text = "up 1\n";
  MetricsServer server{"127.0.0.1:0", [this] {
                         ++asked;
                         return text;
                       }};
};

const std::string kGet = "GET /metrics HTTP/1.1\r\nHost: robot\r\n\r\n";

TEST_CASE("A request is answered with the text, in whatever pieces it comes, and the connection ends",
          "[unit]") {
  Bench bench;
  Client client(bench.server);
  client.send(kGet.substr(0, 10));
  bench.serve();
  CHECK(client.receive().empty());
  client.send(kGet.substr(10));
  bench.serve();
  const std::string answer = client.receive();
  CHECK_THAT(answer, Catch::StartsWith("HTTP/1.1 200 OK\r\nContent-Type: text/plain; version=0.0.4") &&
                         Catch::Contains("\r\nContent-Length: 5\r\n") && Catch::EndsWith("\r\n\r\nup 1\n"));
  CHECK(client.ended());
}

TEST_CASE("Other paths, other methods and endless requests are refused, and nothing is reckoned for them",
          "[unit]") {
  Bench bench;
  const auto answer = [&bench](const std::string& request) {
    Client client(bench.server);
    client.send(request);
    bench.serve();
    return client.receive();
  };
  CHECK_THAT(answer("GET / HTTP/1.1\r\n\r\n"), Catch::StartsWith("HTTP/1.1 404"));
  CHECK_THAT(answer("POST /metrics HTTP/1.1\r\n\r\n"), Catch::StartsWith("HTTP/1.1 405"));
  CHECK_THAT(answer("\r\n\r\n"), Catch::StartsWith("HTTP/1.1 405"));
  CHECK_THAT(answer(std::string(MetricsServer::kMaxRequest + 5000, 'x')), Catch::StartsWith("HTTP/1.1 431"));
  CHECK(bench.asked == 0);
  CHECK_THAT(answer("GET /metrics?name=a HTTP/1.0\r\n\r\n"), Catch::StartsWith("HTTP/1.1 200"));
}

TEST_CASE("Clients that never ask or never read keep nobody waiting or out", "[unit]") {
  Bench bench;
  bench.text = std::string(5'000'000, 'x');  // more than a socket takes at once
  std::list<Client> silent, deaf;
  for (int k = 0; k < 3 * static_cast<int>(MetricsServer::kMaxClients); ++k) {
    silent.emplace_back(bench.server);
    deaf.emplace_back(bench.server);
    deaf.back().send(kGet);
    bench.serve();
  }
  Client client(bench.server);
  client.send(kGet);
  std::string answer;
  for (int k = 0; k < 10'000 && !client.ended(); ++k) {
    bench.server.serve();
    answer += client.receive();
  }
  CHECK(answer.size() > bench.text.size());
}

TEST_CASE("A client is answered with one piece of work a call, whatever it sends", "[law]") {
  Bench bench;
  Client flood(bench.server);
  for (int k = 0; k < 100; ++k) flood.send(kGet);
  bench.serve();
  CHECK(bench.asked == 1);
}

TEST_CASE("A port alone is for this machine only, and an address that is none is refused", "[unit]") {
  const auto text = [] { return std::string(); };
  const MetricsServer local("0", text);
  CHECK(local.address().starts_with("127.0.0.1:"));
  CHECK(local.is_local());
  CHECK_FALSE(MetricsServer("0.0.0.0:0", text).is_local());
  for (const char* wrong :
       {"localhost:1", "127.0.0.1:", "127.0.0.1:70000", "127.0.0.1:9477x", ":9477", "9477 "})
    CHECK_THROWS_WITH(MetricsServer(wrong, text), Catch::Contains("--metrics 127.0.0.1:9477"));
  CHECK_THROWS_WITH(MetricsServer(local.address(), text), Catch::Contains("already in use"));
}

}  // namespace tendril::app::metrics_server_test
