// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/mcap/mcap_writer.h"

namespace tendril::app {

/// Files that a log is written into, one after the other. Real-time: no (may block).
class LogTarget : public ByteSink {
 public:
  /// Goes on with an empty file. @return  false where there is none; error() says why
  virtual bool next() = 0;
  /// Why next() or append() has failed last.
  virtual std::string error() const = 0;
};

}  // namespace tendril::app
