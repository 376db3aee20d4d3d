// SPDX-License-Identifier: Apache-2.0
// The counting malloc family stands in the file of HeapGuard's own functions on purpose: a linker takes from
// a static library only the files that define something still missing, and a program may well have no other
// need of ours.
#include "rt/heap_guard.h"

#include <cerrno>
#include <cstddef>
#include <cstdlib>

#if defined(__GLIBC__) && !defined(TENDRIL_SANITIZED)
#define TENDRIL_COUNTS_HEAP_CALLS
#endif

namespace tendril::rt {

namespace {
// initial-exec: the number lies at a fixed offset in the block that every thread has before it runs its first
// instruction, so reaching it never allocates (which would call malloc again) and works in the first malloc
// of the process, which comes from the dynamic linker before main and before any constructor.
[[gnu::tls_model("initial-exec")]] constinit thread_local int64_t heap_calls = 0;
}  // namespace

HeapGuard::HeapGuard() noexcept : at_start_(heap_calls) {}

int64_t HeapGuard::calls() const noexcept { return heap_calls - at_start_; }

#ifdef TENDRIL_COUNTS_HEAP_CALLS
namespace {
void count() noexcept { ++heap_calls; }
}  // namespace
bool HeapGuard::available() noexcept { return true; }
#else
bool HeapGuard::available() noexcept { return false; }
#endif

}  // namespace tendril::rt

#ifdef TENDRIL_COUNTS_HEAP_CALLS
// A program may replace these functions if it replaces the whole set.  [glibc manual, Replacing malloc]
// The names with __libc_ are the same functions under names that nobody replaces; unlike dlsym(RTLD_NEXT),
// they need no look-up, which would itself allocate.
extern "C" {
void* __libc_malloc(std::size_t size) noexcept;
void* __libc_calloc(std::size_t count, std::size_t size) noexcept;
void* __libc_realloc(void* block, std::size_t size) noexcept;
void* __libc_memalign(std::size_t alignment, std::size_t size) noexcept;
void* __libc_valloc(std::size_t size) noexcept;
void* __libc_pvalloc(std::size_t size) noexcept;
void __libc_free(void* block) noexcept;

void* malloc(std::size_t size) noexcept {
  tendril::rt::count();
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) noexcept {
  tendril::rt::count();
  return __libc_calloc(count, size);
}

void* realloc(void* block, std::size_t size) noexcept {
  tendril::rt::count();
  return __libc_realloc(block, size);
}

void* reallocarray(void* block, std::size_t count, std::size_t size) noexcept {
  tendril::rt::count();
  std::size_t bytes = 0;
  if (__builtin_mul_overflow(count, size, &bytes)) {
    errno = ENOMEM;
    return nullptr;
  }
  return __libc_realloc(block, bytes);
}

void free(void* block) noexcept {
  if (block == nullptr) return;
  tendril::rt::count();
  __libc_free(block);
}

void* memalign(std::size_t alignment, std::size_t size) noexcept {
  tendril::rt::count();
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  tendril::rt::count();
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** block, std::size_t alignment, std::size_t size) noexcept {
  tendril::rt::count();
  const bool power_of_two = alignment != 0 && (alignment & (alignment - 1)) == 0;
  if (!power_of_two || alignment % sizeof(void*) != 0) return EINVAL;
  void* const made = __libc_memalign(alignment, size);
  if (made == nullptr) return ENOMEM;
  *block = made;
  return 0;
}

void* valloc(std::size_t size) noexcept {
  tendril::rt::count();
  return __libc_valloc(size);
}

void* pvalloc(std::size_t size) noexcept {
  tendril::rt::count();
  return __libc_pvalloc(size);
}
}  // extern "C"
#endif
