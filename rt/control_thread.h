// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "rt/control_loop.h"
#include "rt/thread.h"

namespace tendril::rt {

/// The control loop in a real-time thread of its own.
class ControlThread {
 public:
  /// Starts the thread. Keeps references to loop and channels.
  /// @param rate_hz  of the loop, as DeadlineGrid takes it
  /// @throws as RealtimeThread
  /// Real-time: no (allocates).
  ControlThread(const ThreadConfig& config, RtRights rights, double rate_hz, ControlLoop& loop,
                Channels& channels);
  /// Asks the loop to stop, and waits until it has.
  ~ControlThread();

  /// Whether the loop has ended by itself or because it was asked. Real-time: wait-free, any thread.
  bool ended() const noexcept { return channels_.progress.ended.load(std::memory_order_acquire); }

  /// Waits until the loop has ended. Real-time: no (blocks).
  void join() noexcept { thread_.join(); }

  /// See RealtimeThread::refusal. Real-time: no.
  const std::string& refusal() const noexcept { return thread_.refusal(); }

  /// Complete once the thread is joined. Real-time: no.
  const LoopCounts& counts() const noexcept { return *counts_; }

 private:
  Channels& channels_;
  std::unique_ptr<LoopCounts> counts_;  // 208 KiB
  RealtimeThread thread_;
};

}  // namespace tendril::rt
