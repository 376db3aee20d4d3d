// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace tendril::hal {

/// The object dictionary of the simulated CiA 402 drive as an electronic data sheet (EDS) for configuration
/// tools. [CiA 306] Real-time: no (allocates).
std::string simulated_drive_eds();

}  // namespace tendril::hal
