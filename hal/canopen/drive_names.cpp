// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/drive_names.h"

#include <algorithm>
#include <string_view>

namespace tendril::hal {

void DriveNames::start() noexcept {
  at_ = 0;
  upload_.start({kObjects[at_], 0});
}

bool DriveNames::advance(int64_t now_ns, FrameBatch& out) noexcept {
  const SdoUpload::Status status = upload_.advance(now_ns, out);
  if (status == SdoUpload::Status::kRunning) return false;
  const bool done = status == SdoUpload::Status::kDone;
  const std::string_view text = done ? upload_.text() : std::string_view{};
  std::copy(text.begin(), text.end(), texts_[at_].begin());
  sizes_[at_] = static_cast<int>(text.size());
  if (++at_ == kCount) return true;
  upload_.start({kObjects[at_], 0});
  return false;
}

/// Without control characters; some drives pad with blanks or zeros.
std::string DriveNames::printable(int which) const {
  const std::string_view text(texts_[which].data(), static_cast<size_t>(sizes_[which]));
  std::string result(text.substr(0, text.find('\0')));
  for (char& c : result)
    if (c < ' ' || c > '~') c = '?';
  result.erase(result.find_last_not_of(' ') + 1);
  return result;
}

std::string DriveNames::text() const {
  const std::string device = printable(0), hardware = printable(1), software = printable(2);
  return (device.empty() ? "a drive that does not tell its name" : device) +
         (hardware.empty() ? "" : ", hardware " + hardware) +
         (software.empty() ? "" : ", software " + software);
}

}  // namespace tendril::hal
