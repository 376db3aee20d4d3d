// SPDX-License-Identifier: Apache-2.0
#include "rt/idle_latency_limit.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "rt/rt_error.h"

namespace tendril::rt {

IdleLatencyLimit::IdleLatencyLimit(int32_t limit_us, const std::string& device)
    : device_(open(device.c_str(), O_WRONLY | O_CLOEXEC)) {
  // Four bytes are a number in binary; any other length would be read as hexadecimal text.
  if (device_ >= 0 && write(device_, &limit_us, sizeof limit_us) == sizeof limit_us) return;
  const int error = errno;
  if (device_ >= 0) close(device_);
  throw RtError("cannot keep the CPUs from deep sleep, from which they wake late (" + device + ": " +
                std::strerror(error) +
                "); grant the right to write there (a udev rule: config/tendril.rules is one for systemd)");
}

IdleLatencyLimit::~IdleLatencyLimit() { close(device_); }

}  // namespace tendril::rt
