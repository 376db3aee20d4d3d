// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>

#include "hal/canopen/sdo_upload.h"

namespace tendril::hal {

/// The names that a drive gives itself: device name, hardware version, software version. [CiA 301, objects
/// 1008, 1009, 100A] All are optional: where a drive refuses one, or does not answer, its text is empty.
class DriveNames {
 public:
  /// See SdoUpload.
  DriveNames(int node, int64_t timeout_ns, int attempts) noexcept : upload_(node, timeout_ns, attempts) {}

  /// Begins to read them. Real-time: yes.
  void start() noexcept;

  /// Processes an answer of the drive. Real-time: yes.
  void receive(const SdoAnswer& answer) noexcept { upload_.receive(answer); }

  /// Sends the next request if one is due: at most one frame. Not after all are known.
  /// @return  whether all are known
  /// Real-time: yes (bounded, no allocation).
  bool advance(int64_t now_ns, FrameBatch& out) noexcept;

  /// Whether all were read, refused or not answered; none changes then until `start`. Real-time: yes.
  bool known() const noexcept { return at_ == kCount; }

  /// "EPOS4 Module 50/5, hardware 6551, software 0170". Real-time: no (allocates).
  std::string text() const;

 private:
  static constexpr int kCount = 3;
  static constexpr uint16_t kObjects[kCount] = {0x1008, 0x1009, 0x100A};

  std::string printable(int which) const;

  SdoUpload upload_;
  std::array<std::array<char, SdoUpload::kCapacity>, kCount> texts_{};
  std::array<int, kCount> sizes_{};
  int at_ = 0;  // of kObjects
};

}  // namespace tendril::hal
