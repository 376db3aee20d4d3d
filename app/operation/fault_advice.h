// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/control_law.h"

namespace tendril::app {

/// What a person can do about a latched fault, in one or two sentences. Real-time: no (for people).
const char* advice(const rt::LatchedFault& fault);

}  // namespace tendril::app
