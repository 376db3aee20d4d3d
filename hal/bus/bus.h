// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

#include "hal/bus/frame.h"

namespace tendril::hal {

enum class SendResult : uint8_t {
  kSent,       // handed to the bus
  kQueueFull,  // dropped and counted: the bus is slower than its users, or does not carry such frames
  kDown        // dropped: there is no bus at present
};

/// Fault confinement of ISO 11898-1, plus "it takes no more frames at present", as nobody hears those that
/// wait, and "the interface or the host is gone".
enum class BusHealth : uint8_t { kActive, kStalled, kPassive, kOff, kDown };

/// "error-active", "stalled", "error-passive", "bus-off" or "down". Real-time: yes.
const char* name(BusHealth health) noexcept;

/// More frames than wait in the queue of a SocketCAN interface, whatever its users do: who has room for as
/// many in each `receive` leaves none behind, so that feedback is never older than the time between two of
/// them. The queue has room for 16 ms of a bus of 1 Mbit/s that carries nothing but frames for us.
inline constexpr int kMaxWaiting = 512;

/// A bus that cannot be opened; what() is one sentence that says where, why and what to do.
struct BusError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// One node's access to a bus. A node does not receive its own frames.
///
/// All functions but `describe` are for one thread: the one that owns the bus.
class Bus {
 public:
  virtual ~Bus() = default;

  /// Puts frames on the bus in their order, without waiting. Where one finds no room, or is longer than the
  /// bus carries, it and all after it are dropped: a SYNC never goes out without the targets before it.
  /// @return kSent where all were handed over, also where there were none
  /// Real-time: yes (one system call for each peer where nothing is in the way, never blocks, no allocation).
  virtual SendResult send(std::span<const Frame> frames) noexcept = 0;
  SendResult send(const Frame& frame) noexcept { return send(std::span(&frame, 1)); }

  /// Takes the oldest frames that have arrived.
  /// @return how many were written to the front of `frames`; fewer than fit only where no more had arrived
  /// Real-time: yes (bounded by the room in `frames`, never blocks, no allocation).
  virtual int receive(std::span<Frame> frames) noexcept = 0;
  bool receive(Frame& frame) noexcept { return receive(std::span(&frame, 1)) == 1; }

  /// State of the bus as far as the calls of `send` and `receive` have shown it: a caller that makes neither
  /// learns nothing new.
  /// Real-time: yes.
  virtual BusHealth health() const noexcept = 0;

  /// Frames lost in full queues on this side, sent and received, since the bus was opened.
  /// Real-time: yes.
  virtual uint64_t dropped() const noexcept = 0;

  /// A file descriptor that poll(2) reports readable when `receive` has work; -1 where there is none.
  /// Real-time: yes.
  virtual int descriptor() const noexcept { return -1; }

  /// From now on drops what finds so many frames of ours waiting for the bus. What waits cannot be taken
  /// back: when the bus works again, all of it comes before any newer frame, however old it is by then.
  /// Before the first `send`. Real-time: no (a system call).
  virtual void limit_waiting(int /*frames*/) {}

  /// Frames that may wait for the bus to take them; 0: no limit that is known. Real-time: no (a system call).
  virtual int transmit_queue() const { return 0; }

  /// What this is, for people: "CAN interface can0". Real-time: no (allocates).
  virtual std::string describe() const = 0;

 protected:
  Bus() = default;
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;
};

}  // namespace tendril::hal
