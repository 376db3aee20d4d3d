// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <string>

namespace tendril::app {

/// Answers GET /metrics over HTTP. Never waits for a client, does a bounded piece of work at a time, and ends
/// the connection after the answer. Real-time: no, for all of it (allocates, system calls).
class MetricsServer {
 public:
  static constexpr std::size_t kMaxClients = 8;
  static constexpr std::size_t kMaxRequest = 8'192;  ///< bytes

  /// Listens.
  /// @param address  "127.0.0.1:9477", "[::1]:9477", or a port alone for 127.0.0.1; port 0: any free one
  /// @param text     gives what is told, at most once a client and call of serve()
  /// @throws std::runtime_error with what to do where the address is none, or is taken
  MetricsServer(const std::string& address, std::function<std::string()> text);
  ~MetricsServer();
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;

  /// Readable, as of poll(), where serve() has something to do.
  int descriptor() const { return epoll_; }

  /// Answers what has come.
  void serve();

  /// Where it listens: "127.0.0.1:9477".
  std::string address() const;
  /// Whether only programs on this machine can reach it.
  bool is_local() const;

 private:
  struct Client {
    int descriptor;
    std::string in, out;
    bool ended = false;
  };

  void accept_clients();
  void read(Client& client);
  void write(Client& client);
  std::string answer(const std::string& request) const;

  std::function<std::string()> text_;
  int socket_ = -1, epoll_ = -1;
  std::list<Client> clients_;  // the one that has been here for longest first
};

}  // namespace tendril::app
