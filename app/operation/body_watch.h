// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "app/operation/line_server.h"
#include "rt/surface.h"

namespace tendril::app {

/// Shows the body to clients: what it looks like, once, and where its surface is, again and again. The model
/// thread makes surfaces only while a client wants them. Real-time: no, for all of it.
class BodyWatch {
 public:
  /// Keeps references.
  /// @param geometry  of robot_geometry()
  BodyWatch(LineServer& server, std::string geometry, rt::SurfaceChannel& channel);

  const std::string& geometry() const { return geometry_; }

  /// Sends a client so many surfaces a second from now on; 0 ends it.
  void subscribe(int client, double rate_hz);
  void gone(int client) { subscribe(client, 0); }

  /// Hands on a surface that has come. A client that has not read all that it was sent before goes without
  /// it.
  void serve();

 private:
  struct Subscription {
    double rate_hz;
    int64_t due_ns = 0;
  };

  LineServer& server_;
  std::string geometry_;
  rt::SurfaceChannel& channel_;
  std::map<int, Subscription> clients_;
};

}  // namespace tendril::app
