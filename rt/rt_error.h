// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace tendril::rt {

/// The machine does not grant what real time needs; what() is one sentence that says what to grant and where.
struct RtError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace tendril::rt
