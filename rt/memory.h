// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace tendril::rt {

/// Keeps every page of the process in memory, those of today and those to come, and stops malloc from giving
/// pages back to the kernel, so that the control thread meets no page fault.
/// @throws RtError  where the kernel refuses; what() says which right or limit to grant
/// Real-time: no (call once, in main, before threads start).
void lock_memory();

/// Touches the stack of the calling thread below the caller, so that its pages are there before they are
/// needed.
/// @param bytes  how deep; must fit into what is left of the stack
/// Real-time: no (page faults are its purpose).
void prefault_stack(std::size_t bytes) noexcept;

}  // namespace tendril::rt
