// SPDX-License-Identifier: Apache-2.0
#include "app/config/config.h"

#include <algorithm>

namespace tendril::app {

int EffectorConfig::coordinates() const {
  return cavity ? 1 : static_cast<int>(std::ranges::count(controlled, true));
}

}  // namespace tendril::app
