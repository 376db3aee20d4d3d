// SPDX-License-Identifier: Apache-2.0
#include "rt/memory.h"

#include <alloca.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "rt/rt_error.h"

namespace tendril::rt {

namespace {

std::string memlock_limit() {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  return limit.rlim_cur == RLIM_INFINITY ? "unlimited" : std::to_string(limit.rlim_cur / 1024) + " KiB";
}

}  // namespace

void lock_memory() {
  // Freed memory at the top of the heap goes back to the kernel by default, and the next allocation faults it
  // in anew; -1 turns that off.
  const bool keeps_top = mallopt(M_TRIM_THRESHOLD, -1) == 1;
  // Large blocks get a mapping of their own by default, which free() unmaps; taken from the heap, they stay.
  const bool keeps_large = mallopt(M_MMAP_MAX, 0) == 1;
  // Threads that contend for the heap get heaps of their own by default, which go back whole when they are
  // empty, whatever the two above say. The control thread makes no heap call, so it contends with nobody.
  const bool keeps_one = mallopt(M_ARENA_MAX, 1) == 1;
  if (!keeps_top || !keeps_large || !keeps_one)
    throw RtError(
        "cannot make malloc keep its pages (mallopt refused); tendril needs the allocator of glibc");

  // MCL_CURRENT faults in and pins what is mapped now: code, libraries, heap. MCL_FUTURE does so for what
  // comes when it is mapped, not when it is first used: the stacks of threads, growth of the heap.
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    const int error = errno;
    throw RtError("cannot lock memory (mlockall: " + std::string(std::strerror(error)) +
                  "; RLIMIT_MEMLOCK is " + memlock_limit() +
                  "); grant CAP_IPC_LOCK or an unlimited RLIMIT_MEMLOCK (systemd: LimitMEMLOCK=infinity; "
                  "shell: a memlock line in /etc/security/limits.conf), or run with --allow-non-rt");
  }
}

// noinline: in a caller's frame the memory would be released only when the caller returns.
[[gnu::noinline]] void prefault_stack(std::size_t bytes) noexcept {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  auto* const bottom = static_cast<volatile char*>(alloca(bytes));
  // Written, not read: reading a page that was never written maps the shared zero page and leaves the fault
  // for the first write. From the top down, as the kernel lets the main thread's stack grow.
  for (std::size_t below_top = 0; below_top < bytes; below_top += page) bottom[bytes - 1 - below_top] = 0;
  if (bytes > 0) bottom[0] = 0;
}

}  // namespace tendril::rt
