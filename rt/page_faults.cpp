// SPDX-License-Identifier: Apache-2.0
#include "rt/page_faults.h"

#include <sys/resource.h>

namespace tendril::rt {

namespace {
PageFaults of_this_thread() noexcept {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {.minor = usage.ru_minflt, .major = usage.ru_majflt};
}
}  // namespace

PageFaultCounter::PageFaultCounter() noexcept : at_start_(of_this_thread()) {}

PageFaults PageFaultCounter::faults() const noexcept {
  const PageFaults now = of_this_thread();
  return {.minor = now.minor - at_start_.minor, .major = now.major - at_start_.major};
}

}  // namespace tendril::rt
