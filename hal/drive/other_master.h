// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hal/bus/frame.h"

namespace tendril::hal {

/// Listens for another controller of the same drives. Two controllers on one bus overwrite each other's
/// commands and set-up, so the one that comes later must not begin.
///
/// A bus does not give a controller its own frames back, so a frame that only a controller sends is another
/// one's. Three of them with one identifier within the time of listening count: a single one may be a stray.
/// Real-time: every function but the constructor (bounded, no allocation).
class OtherMaster {
 public:
  /// @param ids        11-bit identifiers of frames that only a controller sends, and that a running one
  /// repeats
  /// @param listen_ns  how long to listen before the first frame of one's own; 0: not at all
  OtherMaster(const std::vector<uint32_t>& ids, int64_t listen_ns);

  /// Processes a frame of the bus. @return whether only a controller sends such frames
  bool receive(const Frame& frame, int64_t arrival_ns) noexcept;

  /// Whether it is too early to send. The first call begins to listen.
  bool listening(int64_t now_ns) noexcept;

  /// Listens again, with nothing heard yet.
  void restart() noexcept;

  /// Ends listening: the drives follow us.
  void end() noexcept { ended_ = true; }

  /// Whether there is another controller; it stays.
  bool heard() const noexcept { return heard_id_ != kNone; }

  /// The identifier of its frames. Only where `heard`.
  uint32_t heard_id() const noexcept { return heard_id_; }

 private:
  static constexpr int kEnough = 3;
  static constexpr uint32_t kNone = ~0u;

  struct Count {
    uint32_t id;
    int frames = 0;
    int64_t since_ns = 0;
  };

  std::vector<Count> counts_;
  int64_t listen_ns_;
  int64_t begun_ns_ = 0;
  bool begun_ = false, ended_ = false;
  uint32_t heard_id_ = kNone;
};

}  // namespace tendril::hal
