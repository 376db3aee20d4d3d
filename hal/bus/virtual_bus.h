// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hal/bus/bus.h"

namespace tendril::hal {

class VirtualBus;

/// One node of a VirtualBus, with the faults a test can inject.
class VirtualEndpoint final : public Bus {
 public:
  using Bus::receive, Bus::send;
  SendResult send(std::span<const Frame> frames) noexcept override;
  int receive(std::span<Frame> frames) noexcept override;
  BusHealth health() const noexcept override {
    return refused_ && health_ == BusHealth::kActive ? BusHealth::kStalled : health_;
  }
  void limit_waiting(int frames) override;
  uint64_t dropped() const noexcept override { return dropped_; }
  std::string describe() const override;

  /// Pulls or replaces the plug: while out, nothing this node sends is heard and nothing reaches it, and it
  /// notices nothing. Real-time: yes.
  void set_plugged(bool plugged) noexcept { plugged_ = plugged; }

  /// Puts the node in that state of fault confinement: bus-off and down nodes neither send nor receive.
  /// Real-time: yes.
  void set_health(BusHealth health) noexcept { health_ = health; }

  /// While stalled, what this node sends waits, up to its limit, and nothing reaches it, as on a bus that
  /// others hold. At its end all that waits is sent. Real-time: yes.
  void set_stalled(bool stalled) noexcept;

 private:
  friend class VirtualBus;
  VirtualEndpoint(VirtualBus& medium, std::string name, int capacity);
  bool connected() const noexcept;
  void push(const Frame& frame) noexcept;

  VirtualBus& medium_;
  std::string name_;
  std::vector<Frame> queue_;  // ring of fixed capacity
  size_t head_ = 0, size_ = 0;
  std::vector<Frame> waiting_;  // while stalled
  size_t waiting_limit_ = 0;
  bool plugged_ = true, stalled_ = false;
  bool refused_ = false;  // the last `send` found no room
  BusHealth health_ = BusHealth::kActive;
  uint64_t dropped_ = 0;
};

/// A bus inside one thread, under a clock of the caller's: for tests and for scenarios in virtual time.
///
/// Every frame reaches every other node after the same delay, in the order in which frames were sent; the
/// same calls give the same frames. The medium itself loses nothing: only a full queue, an unplugged node or
/// an injected fault does.
class VirtualBus {
 public:
  /// @param delay_ns  from send to arrival, for every frame
  /// @param capacity  frames each node can hold before it drops new ones
  explicit VirtualBus(int64_t delay_ns = 0, int capacity = 4096);

  /// Adds a node; it lives as long as the bus. A node that only receives is a recorder of the traffic.
  /// Real-time: no (allocates).
  VirtualEndpoint& attach(std::string name);

  /// Sets the clock; frames whose delay has passed can be received from now on. Real-time: yes.
  void set_time(int64_t now_ns) noexcept { now_ns_ = now_ns; }

  /// The clock, ns. Real-time: yes.
  int64_t time_ns() const noexcept { return now_ns_; }

 private:
  friend class VirtualEndpoint;
  void broadcast(const VirtualEndpoint& from, const Frame& frame) noexcept;

  int64_t delay_ns_;
  int capacity_;
  int64_t now_ns_ = 0;
  std::vector<std::unique_ptr<VirtualEndpoint>> endpoints_;
};

}  // namespace tendril::hal
