// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pthread.h>

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace tendril::rt {

/// Whether a thread must have its real-time priority or may run without.
enum class RtRights {
  kRequire,  // refuse to start without
  kIgnore    // run under SCHED_OTHER instead, for development and tests
};

struct ThreadConfig {
  std::string name;                   // what `top -H` and `ps -L` show; at most 15 bytes
  int priority = 80;                  // SCHED_FIFO, 1..98: 99 is for the kernel's own threads
  int cpu = -1;                       // the only CPU it may run on; -1: any
  std::size_t stack_bytes = 1 << 20;  // at least 64 KiB; all of it is touched before the body runs
};

/// A thread under SCHED_FIFO whose stack has no page fault left in it.
///
/// It has no way to be stopped from outside: the body watches a flag of its own. The destructor joins.
class RealtimeThread {
 public:
  /// Starts the thread.
  /// @param config  see there
  /// @param rights  what to do where SCHED_FIFO is refused
  /// @param body    runs once in the new thread; an exception that leaves it ends the process
  /// @throws RtError  where SCHED_FIFO is refused and required, or the CPU does not exist; says what to grant
  /// @throws std::invalid_argument  where a field of the configuration is out of range
  /// Real-time: no (allocates).
  RealtimeThread(const ThreadConfig& config, RtRights rights, std::function<void()> body);
  ~RealtimeThread();

  RealtimeThread(const RealtimeThread&) = delete;
  RealtimeThread& operator=(const RealtimeThread&) = delete;

  /// Waits until the body has returned; a second call does nothing.
  /// Real-time: no (blocks).
  void join() noexcept;

  /// Why the thread runs without real-time priority, as a sentence for the log; empty where it has it.
  /// Real-time: no.
  const std::string& refusal() const noexcept { return refusal_; }

 private:
  static void* enter(void* self) noexcept;
  int create(const ThreadConfig& config, bool fifo);

  std::function<void()> body_;
  std::string name_;
  std::string refusal_;
  pthread_t thread_{};
  bool joined_ = false;
};

/// Makes a thread run on one CPU only.
/// @param name  what the message calls it
/// @param cpu   -1: leaves it where it is
/// @throws RtError  where there is no such CPU or the process may not use it
/// Real-time: no.
void keep_to_cpu(pthread_t thread, const std::string& name, int cpu);

/// How the kernel schedules a thread.
struct Scheduling {
  std::string_view policy;  // "SCHED_FIFO", "SCHED_OTHER", ...
  int priority = 0;         // 1..99 under SCHED_FIFO and SCHED_RR, otherwise 0
};

/// Asks the kernel how it schedules the calling thread: what is, not what was asked for.
/// Real-time: two system calls, takes no lock.
Scheduling scheduling_of_this_thread() noexcept;

}  // namespace tendril::rt
