// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace tendril::app {

/// The other end of a LineServer in the same thread: it sends and reads bytes, and never waits.
class LineClient {
 public:
  /// Connects. @throws std::runtime_error where nobody listens
  explicit LineClient(const std::filesystem::path& socket);
  ~LineClient();
  LineClient(const LineClient&) = delete;
  LineClient& operator=(const LineClient&) = delete;

  /// @return  bytes that the kernel took
  std::size_t send(const std::string& bytes);

  /// All that has come and was not read yet.
  std::string receive();

  /// Whether the other end has closed, after all that it sent was read.
  bool ended() const { return ended_; }

 private:
  int socket_;
  bool ended_ = false;
};

}  // namespace tendril::app
