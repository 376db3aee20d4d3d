// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "tests/validation/report.h"

namespace tendril::validation {

// Each case compares the model with theory, with others' results, or with a law that it must obey. Limits
// stand at the top of the case's file. A case throws std::runtime_error where a body does not come to rest.
void patch(Report& report, Extent extent);
void cantilever(Report& report, Extent extent);
void lame(Report& report, Extent extent);
void locking(Report& report, Extent extent);
void elastica(Report& report, Extent extent);
void vibration(Report& report, Extent extent);
void references(Report& report, Extent extent);
void calculix(Report& report, Extent extent);

struct Case {
  const char* name;
  const char* title;
  void (*run)(Report&, Extent);
};

/// All cases, in the order of the page.
const std::vector<Case>& cases();

}  // namespace tendril::validation
