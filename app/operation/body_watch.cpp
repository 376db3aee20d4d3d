// SPDX-License-Identifier: Apache-2.0
#include "app/operation/body_watch.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/operation/surface_messages.h"

namespace tendril::app {

BodyWatch::BodyWatch(LineServer& server, std::string geometry, rt::SurfaceChannel& channel)
    : server_(server), geometry_(std::move(geometry)), channel_(channel) {}

void BodyWatch::subscribe(int client, double rate_hz) {
  if (rate_hz > 0)
    clients_[client] = {rate_hz};
  else
    clients_.erase(client);
  double wanted_hz = 0;
  for (const auto& [number, subscription] : clients_) wanted_hz = std::max(wanted_hz, subscription.rate_hz);
  channel_.wanted_hz.store(wanted_hz, std::memory_order_relaxed);
}

void BodyWatch::serve() {
  if (clients_.empty() || !channel_.surfaces.fresh()) return;
  const rt::Surface& surface = channel_.surfaces.latest();
  std::string line;
  for (auto& [client, subscription] : clients_) {
    if (surface.stamp_ns < subscription.due_ns || server_.unread(client) > 0) continue;
    // A little early counts as in time: the model thread's own steps are not those of the subscription.
    const int64_t interval_ns = std::llround(0.9e9 / subscription.rate_hz);
    subscription.due_ns = surface.stamp_ns + interval_ns;
    if (line.empty()) line = surface_message(surface);
    server_.send(client, line);
  }
}

}  // namespace tendril::app
