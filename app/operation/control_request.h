// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "app/config/config.h"
#include "rt/snapshot.h"

namespace tendril::app {

/// The version of the control protocol; docs/control-protocol.md describes it.
inline constexpr int kControlProtocol = 1;

/// What a client is told where its request is refused: a word for programs, a sentence for people.
class RequestError : public std::runtime_error {
 public:
  /// @param code  "bad_json", "bad_request", "unknown_command", "version", "no_control", "outside_workspace",
  /// ...
  RequestError(std::string code, const std::string& message)
      : std::runtime_error(message), code_(std::move(code)) {}
  const std::string& code() const { return code_; }

  nlohmann::json id;  ///< of the request, as far as it could be read; null where not

 private:
  std::string code_;
};

enum class Command {
  kStatus,
  kSubscribe,
  kGeometry,
  kSurface,
  kAcquire,
  kRelease,
  kTarget,
  kPlay,
  kPause,
  kResume,
  kHold,
  kSet,
  kDisable,
  kEnable,
  kReset,
  kStop
};

/// A line of a client, checked as far as it can be without the state of the robot.
struct ControlRequest {
  nlohmann::json id;  ///< what the client calls it; goes into the reply. Null where it has none
  Command command = Command::kStatus;
  // Of `target`. Coordinates that are not named have no value and stay where they are wanted.
  std::vector<std::optional<double>> position;  ///< e, m or m³
  rt::EffectorVector velocity;                  ///< e, m/s or m³/s; 0 where none is given
  std::optional<double> in_s;                   ///< s until the position is reached
  std::optional<double> speed;                  ///< m/s on the way there
  double rate_hz = 0;                           ///< of `subscribe` and `surface`, 0 ends it
  bool steal = false;                           ///< of `acquire`
  std::optional<double> path_rate;              ///< of `set`, 0 to 1
};

/// Reads a line.
/// @param coordinates  their names, see coordinate_names()
/// @throws RequestError where it is no JSON object, or says what is not known or not possible
/// Real-time: no.
ControlRequest read_request(std::string_view line, const Config& config,
                            const std::vector<std::string>& coordinates);

/// What must hold before a command is obeyed.
struct Demands {
  bool control = false;  ///< the client has the control
  bool running = false;  ///< the robot follows targets
};
Demands demands_of(Command command);

}  // namespace tendril::app
