// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace tendril::app {

/// A UNIX socket that many clients send lines of text to and get lines from. Never waits for a client: what
/// one does not read is dropped. Real-time: no, for all of it (allocates, system calls).
class LineServer {
 public:
  static constexpr int kMaxClients = 32;
  static constexpr std::size_t kMaxLine = 65'536;  ///< bytes of a client's line
  static constexpr std::size_t kMaxUnread =
      262'144;  ///< bytes that wait for a client; then it gets no further line

  /// What becomes of clients and their lines. A client is known by a number that no other one ever has.
  class Listener {
   public:
    virtual ~Listener() = default;
    virtual void connected(int client) = 0;
    virtual void received(int client, std::string_view line) = 0;
    virtual void too_long(
        int client) = 0;  ///< a line of more than kMaxLine bytes; what is left of it is skipped
    virtual void gone(int client) = 0;
  };

  /// Listens. The socket may be used by its user and group. One that a process left behind is replaced.
  /// @param path      of the socket
  /// @param listener  kept by reference
  /// @throws std::runtime_error with what to do where the path is taken, too long or not writable
  LineServer(const std::filesystem::path& path, Listener& listener);
  ~LineServer();
  LineServer(const LineServer&) = delete;
  LineServer& operator=(const LineServer&) = delete;

  /// Readable, as of poll(), where serve() has something to do.
  int descriptor() const { return epoll_; }

  /// Takes in what clients have sent: a bounded number of lines of each, so that one that floods keeps nobody
  /// waiting.
  void serve();

  /// Sends a line, which must not contain an end of line.
  /// @return  false where it was dropped: the client does not read, or is gone
  bool send(int client, std::string_view line);

  /// Bytes that a client has been sent and that the kernel has not taken yet.
  std::size_t unread(int client) const;

  /// Who is at the other end: "user anna (process 4711)", or the user's number where /etc/passwd has no name
  /// for it.
  std::string peer(int client) const;

 private:
  struct Client {
    int descriptor;
    uint32_t events = 0;  // of epoll that are watched for
    std::string in, out;
    bool lines_wait = false;  // in `in`
    bool skipping = false;    // the rest of a line that is too long
    bool spoke = false;       // it has sent a line
    bool ended = false;       // it sends no more
  };

  void accept_clients();
  bool make_room();
  void read(Client& client);
  void hand_over_lines(int number, Client& client);
  void write(Client& client);
  void watch(int number, Client& client) const;
  void drop(int number);

  std::filesystem::path path_;
  Listener& listener_;
  int socket_ = -1, epoll_ = -1;
  std::map<int, Client> clients_;
  int next_number_ = 1;
};

}  // namespace tendril::app
