// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "hal/bus/bus.h"

namespace tendril::app {

/// A local bus of one process: its socket lies in a folder of its own that goes with the object.
class PrivateBus {
 public:
  /// @throws std::runtime_error where the folder for temporary files cannot be written
  /// Real-time: no.
  PrivateBus();
  ~PrivateBus();
  PrivateBus(const PrivateBus&) = delete;
  PrivateBus& operator=(const PrivateBus&) = delete;

  /// What hal::open_bus calls it.
  std::string name() const { return "local:" + folder_ + "/bus"; }

 private:
  std::string folder_;
};

}  // namespace tendril::app
