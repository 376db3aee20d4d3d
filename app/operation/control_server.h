// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "app/config/config.h"
#include "app/operation/body_watch.h"
#include "app/operation/control_request.h"
#include "app/operation/line_server.h"
#include "app/operation/rate_limited_log.h"
#include "app/operation/robot_state.h"
#include "app/operation/target_source.h"
#include "rt/channels.h"
#include "rt/trace_record.h"

namespace tendril::app {

/// Lets people and programs operate a running robot: answers requests on a UNIX socket, one JSON object a
/// line, as docs/control-protocol.md describes them. One client has the control, all may watch and stop.
/// Real-time: no, for all of it.
class ControlServer : private LineServer::Listener {
 public:
  /// Listens. Keeps references.
  /// @param path      of the socket
  /// @param targets   takes what the client with the control asks for
  /// @param requests  takes its wish to stop, or to have the drives with or without torque
  /// @param master    puts faults into words
  /// @throws std::runtime_error as LineServer
  ControlServer(const std::filesystem::path& path, const Config& config, TargetSource& targets,
                rt::Requests& requests, const hal::DriveMaster& master);
  ~ControlServer() override;

  /// Clients may see the body from now on.
  /// @param geometry  of robot_geometry()
  /// @param channel   kept by reference
  void show_body(std::string geometry, rt::SurfaceChannel& channel);

  /// Readable, as of poll(), where serve() has something to do.
  int descriptor() const { return server_.descriptor(); }

  /// Answers what has come.
  void serve();

  /// One cycle, in order: it goes to those who have asked for the state.
  void add(const rt::TraceRecord& record);

 private:
  struct Subscription {
    int64_t interval_ns = 0;  // 0: none
    int64_t due_ns = 0;
    uint64_t dropped = 0;  // states that the client did not read in time
  };

  void connected(int client) override;
  void received(int client, std::string_view line) override;
  void too_long(int client) override;
  void gone(int client) override;

  std::string answer(int client, const ControlRequest& request);
  void require(Demands demands, int client) const;
  BodyWatch& body();
  void acquire(int client, bool steal);
  void release(int client);
  void enable();
  void reset();
  void aim(const ControlRequest& request, int64_t now_ns);
  nlohmann::ordered_json state() const;

  const Config& config_;
  TargetSource& targets_;
  rt::Requests& requests_;
  RobotState robot_;
  rt::TraceRecord last_;
  std::map<int, Subscription> clients_;
  int holder_ = 0;           // the client that has the control; 0: none
  std::string holder_peer_;  // who that is
  RateLimitedLog log_;       // of who has the control
  LineServer server_;
  std::optional<BodyWatch> body_;
};

}  // namespace tendril::app
