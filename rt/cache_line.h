// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace tendril::rt {

/// What two threads write is kept this many bytes apart, so that neither slows the other down.
/// 64 bytes is the line of x86-64 and of the Cortex-A; on a machine with longer lines only speed is lost.
/// std::hardware_destructive_interference_size is not used: its value may change with the compiler's flags,
/// and with it the layout of the channels.
inline constexpr std::size_t kCacheLine = 64;

}  // namespace tendril::rt
