// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <spawn.h>

#include <atomic>
#include <thread>

namespace tendril::app {

/// Makes SIGTERM, SIGINT and SIGHUP ask for the end instead of ending the process, and lets a reader of our
/// output go away without harm (SIGPIPE). One that was ignored before, as under nohup, stays so.
///
/// The signals are blocked, in this thread and in all that it starts, and stop_signalled() takes them. No
/// handler runs, so a library that sets one of its own takes none away: METIS, within CHOLMOD's ordering,
/// does for SIGTERM. To be called once, before any thread is started.
void watch_stop_signals();

/// Whether one of them has come. For any thread. Real-time: no (a system call).
bool stop_signalled() noexcept;

/// How many have come so far; those that came together may count as one. As stop_signalled().
int stop_signals() noexcept;

/// Has a child process take these signals as usual.
/// @param attributes  initialised; flags are added to those that it has
void take_signals_as_usual(posix_spawnattr_t& attributes);

/// As long as it lives, a stop signal ends the process at once, with exit code 0: for the time in which the
/// robot has not been touched, and building the model may take longer than whoever sends the signal would
/// wait.
class ExitOnStopSignal {
 public:
  ExitOnStopSignal();
  ~ExitOnStopSignal();
  ExitOnStopSignal(const ExitOnStopSignal&) = delete;
  ExitOnStopSignal& operator=(const ExitOnStopSignal&) = delete;

 private:
  std::atomic<bool> quit_{false};
  std::thread thread_;
};

}  // namespace tendril::app
