// SPDX-License-Identifier: Apache-2.0
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <map>
#include <optional>
#include <vector>

#include "app/operation/line_server.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/inputs.h"
#include "tests/fuzz/scratch.h"

namespace tendril::fuzz {
namespace {

using app::LineServer;
using Lines = std::vector<std::optional<std::string>>;  // none: one that is too long

struct Listener final : LineServer::Listener {
  void connected(int client) override {
    must(lines.emplace(client, Lines{}).second, "a client has a number of its own");
    newest = client;
  }
  void received(int client, std::string_view line) override { lines.at(client).emplace_back(line); }
  void too_long(int client) override { lines.at(client).emplace_back(); }
  void gone(int client) override { lines.erase(client); }

  std::map<int, Lines> lines;
  int newest = 0;
};

/// The lines that some bytes hold.
Lines lines_in(const std::string& bytes) {
  Lines lines;
  for (size_t begin = 0, end; begin < bytes.size(); begin = end + 1) {
    end = std::min(bytes.find('\n', begin), bytes.size());
    if (end - begin >= LineServer::kMaxLine)
      lines.emplace_back();
    else if (end < bytes.size())
      lines.emplace_back(bytes.substr(begin, end - begin));
  }
  return lines;
}

class Client {
 public:
  Client(LineServer& server, Listener& listener, const std::string& path) : server_(server) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    socket_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    must(::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0,
         "a client can connect");
    server.serve();
    number = listener.newest;
  }
  ~Client() { ::close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t size = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (size < 0) must(errno == EAGAIN, "a client is served as long as it stays");
      if (size < 0) server_.serve();
      if (size < 0) continue;
      sent.append(bytes.substr(0, static_cast<size_t>(size)));
      bytes.remove_prefix(static_cast<size_t>(size));
    }
  }

  int number = 0;
  std::string sent;

 private:
  LineServer& server_;
  int socket_ = -1;
};

}  // namespace

bool feed_lines(const std::string& bytes) {
  const std::string path = scratch_path("lines");
  Listener listener;
  LineServer server(path, listener);
  std::array<std::optional<Client>, 3> clients;
  const auto serve_all = [&] {
    constexpr int kCalls = 4096;  // far more than what was sent can take, 16 KiB or 32 lines each
    for (int k = 0; k < kCalls && !std::ranges::all_of(clients,
                                                       [&](const auto& client) {
                                                         return !client ||
                                                                listener.lines.at(client->number) ==
                                                                    lines_in(client->sent);
                                                       });
         ++k)
      server.serve();
    for (const auto& client : clients)
      must(!client || listener.lines.at(client->number) == lines_in(client->sent),
           "lines arrive whole and in their order, too long ones as such");
  };
  for (Bytes left(bytes); !left.empty();) {
    const uint8_t step = left.byte();
    auto& client = clients[(step >> 4) % clients.size()];
    if (!client) client.emplace(server, listener, path);
    switch (step & 7) {
      case 0:
        client.reset();
        break;
      case 1:
        client->send(std::string(left.byte() * 512, 'a'));
        break;
      case 2:
        server.send(client->number, left.take(left.byte()));
        break;
      case 3:
        server.serve();
        break;
      case 4:
        serve_all();
        break;
      default:
        client->send(left.take(left.byte()));
        break;
    }
  }
  serve_all();
  return true;
}

}  // namespace tendril::fuzz
