// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "rt/surface.h"

namespace tendril::app {

/// The line that tells a surface: positions as whole numbers of steps from an origin, three a point, 16 bits
/// each, so that 25 000 nodes need 200 kB.
/// Real-time: no (allocates).
std::string surface_message(const rt::Surface& surface);

/// Bytes as text. [RFC 4648, section 4]
std::string base64(std::string_view bytes);

}  // namespace tendril::app
