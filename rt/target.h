// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "rt/snapshot.h"

namespace tendril::rt {

/// Where the effectors are wanted: a piece of path, straight or of constant acceleration, so that a target
/// that arrives late or seldom still moves smoothly.
struct Target {
  EffectorVector position;  ///< at stamp_ns, e, m or m³
  EffectorVector velocity;  ///< at stamp_ns; it stays so without an acceleration, e, m/s or m³/s
  int64_t stamp_ns = 0;
  int64_t until_ns = 0;           ///< the target stands still from here on
  EffectorVector acceleration{};  ///< from stamp_ns until until_ns, e, m/s² or m³/s²; empty: none

  /// Wanted position at an instant, e, m or m³.
  /// Real-time: wait-free.
  EffectorVector at(int64_t now_ns) const noexcept {
    const int64_t elapsed_ns =
        std::clamp<int64_t>(now_ns - stamp_ns, 0, std::max<int64_t>(0, until_ns - stamp_ns));
    const double t = 1e-9 * static_cast<double>(elapsed_ns);
    EffectorVector result = position + velocity * t;
    if (acceleration.size() == result.size()) result += (t * t / 2) * acceleration;
    return result;
  }
};

}  // namespace tendril::rt
