// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace tendril::app {

/// A mistake in a configuration file; what() reads "FILE:LINE: KEY: found ..., expected ...".
struct ConfigError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace tendril::app
