// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendril::hal::test {

/// Calls of operator new by this thread since it started. Counts only in builds without sanitizers, which
/// bring an operator new of their own.
uint64_t heap_calls() noexcept;

}  // namespace tendril::hal::test
