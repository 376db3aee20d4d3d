// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>

#include "rt/triple_buffer.h"

namespace tendril::rt {

/// Where the surface of the body is at one pose, for whoever shows it. Nothing that controls uses it.
struct Surface {
  int64_t stamp_ns = 0;        ///< when the pose was read, CLOCK_MONOTONIC
  Eigen::Matrix3Xf positions;  ///< 3 × n, m; app::SurfaceSampler names the n points
};

/// How surfaces reach the main thread, and how many it wants.
struct SurfaceChannel {
  TripleBuffer<Surface> surfaces;    ///< model thread ▶ main thread, latest
  std::atomic<double> wanted_hz{0};  ///< main thread ▶ model thread: surfaces a second, 0: none
};

}  // namespace tendril::rt
