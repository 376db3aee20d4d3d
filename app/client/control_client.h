// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

namespace tendril::app {

/// A request that the daemon refused; what() is its sentence.
class RequestRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A connection to a running daemon. Waits for each answer. Real-time: no.
class ControlClient {
 public:
  /// Connects and reads the greeting.
  /// @throws std::runtime_error where nobody listens there, or not a daemon that speaks our version
  explicit ControlClient(const std::filesystem::path& socket);
  ~ControlClient();
  ControlClient(const ControlClient&) = delete;
  ControlClient& operator=(const ControlClient&) = delete;

  /// What the daemon said first: robot, version, coordinates.
  const nlohmann::ordered_json& greeting() const { return greeting_; }

  /// Asks, and waits for the answer; states that come in between are lost, events are not.
  /// @param request  without id
  /// @throws RequestRefused; std::runtime_error where the daemon is gone or does not answer
  nlohmann::ordered_json ask(const nlohmann::ordered_json& request);

  /// The next message that is no answer: a state or an event.
  /// @throws std::runtime_error where the daemon is gone, or none comes for 5 s
  nlohmann::ordered_json next();

 private:
  nlohmann::ordered_json read();

  std::string name_, received_;
  int socket_;
  int last_id_ = 0;
  std::deque<nlohmann::ordered_json> events_;  // that came before an answer
  nlohmann::ordered_json greeting_;
};

}  // namespace tendril::app
