// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "hal/bus/bus.h"
#include "hal/bus/frame_batch.h"

namespace tendril::app {

/// The simulated robot's way to its bus, with all that can go wrong on it. The same calls give the same
/// losses. Real-time: every function but the constructor (bounded, no allocation).
class PlantLine {
 public:
  PlantLine() : waiting_(kWaiting) {}

  void set_off(bool off) noexcept { off_ = off; }  ///< neither sends nor hears
  void set_delay(int64_t delay_ns) noexcept {
    delay_ns_ = delay_ns;
  }                                                        ///< of what is sent; frames keep their order
  void set_loss(double share) noexcept { loss_ = share; }  ///< of all frames, both ways, 0..1

  /// Whether a frame that has arrived is heard: to be asked once for each.
  bool hears() noexcept { return !off_ && !lost(); }

  /// Sends frames now, or later, or never.
  void send(hal::Bus& bus, std::span<const hal::Frame> frames, int64_t now_ns) noexcept;

  /// Sends what has been delayed for long enough.
  void release(hal::Bus& bus, int64_t now_ns) noexcept;

 private:
  /// More than a bus of 1 Mbit/s carries in a second; what finds no room is lost.
  static constexpr std::size_t kWaiting = 16384;
  struct Waiting {
    hal::Frame frame;
    int64_t since_ns = 0;
  };

  bool lost() noexcept { return loss_ > 0 && std::bernoulli_distribution(loss_)(random_); }

  std::vector<Waiting> waiting_;  // ring
  std::size_t first_ = 0, count_ = 0;
  bool off_ = false;
  int64_t delay_ns_ = 0;
  double loss_ = 0;
  std::minstd_rand random_;  // always the same seed: runs can be repeated
};

}  // namespace tendril::app
