// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

namespace tendril::app {

/// What systemd is told of the daemon, over the socket of sd_notify(3); without such a socket, nothing.
///
/// For the housekeeping thread alone: a socket that nobody reads may block it, and must not block the control
/// thread.
class ServiceManager {
 public:
  /// Takes from the environment how often the watchdog wants to be fed (WATCHDOG_USEC, WATCHDOG_PID).
  ServiceManager();

  /// The drives follow the control loop. Real-time: no.
  void ready();

  /// The end has begun; the watchdog no longer watches. Real-time: no.
  void stopping();

  /// One line for `systemctl status`. Real-time: no.
  void status(const std::string& line);

  /// Feeds the watchdog, where there is one, twice in its time, but only while the control thread's cycles go
  /// on: one that hangs is found out after one to one and a half times of the watchdog.
  /// @param now_ns  CLOCK_MONOTONIC
  /// @param cycles  of the control thread so far
  /// Real-time: no.
  void feed_watchdog(int64_t now_ns, int64_t cycles);

 private:
  int64_t interval_ns_ = 0;  // between two meals; 0: there is no watchdog
  int64_t due_ns_ = 0;
  int64_t cycles_fed_ = 0;  // with the last meal
};

}  // namespace tendril::app
