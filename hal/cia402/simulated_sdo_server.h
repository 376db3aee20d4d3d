// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "hal/canopen/canopen.h"
#include "hal/cia402/simulated_object_dictionary.h"

namespace tendril::hal {

/// The SDO server of a simulated drive: expedited reads and writes, and segmented reads of texts. Segmented
/// writes and block transfers are refused. [CiA 301] Real-time: every function (bounded, no allocation).
class SimulatedSdoServer {
 public:
  /// The result of a request.
  struct Response {
    std::optional<SdoAnswer> answer;                 // nothing to an abort
    SimulatedEntry written = SimulatedEntry::kNone;  // the entry that a write has changed
  };

  /// Serves a request.
  /// @param objects  up to date, where entries follow the axis
  /// @param state    PDO settings may be written in pre-operational alone
  Response serve(const SdoRequest& request, NmtState state, SimulatedObjectDictionary& objects) noexcept;

  /// Ends a segmented read, if there is one.
  void end_upload() noexcept { upload_left_ = {}; }

 private:
  Response write(const SdoRequest& request, NmtState state, SimulatedObjectDictionary& objects) noexcept;
  SdoAnswer read(ObjectAddress object, const SimulatedObjectDictionary& objects) noexcept;
  SdoAnswer next_segment(bool toggle) noexcept;

  ObjectAddress upload_;          // that is read in segments
  std::string_view upload_left_;  // empty: none is
  bool upload_toggle_ = false;    // of the next segment
};

}  // namespace tendril::hal
