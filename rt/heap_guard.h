// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendril::rt {

/// Counts the heap calls of the calling thread while it lives: malloc, calloc, realloc, free and their kin,
/// and so operator new and delete, whoever makes them (our code, Eigen, the standard library).
///
/// A program that uses it gets its own malloc family, which counts and passes on to glibc's. The price is one
/// increment of a thread-local number a call, so it stays on in production: the daemon reports what it saw.
/// Guards nest. free(nullptr) does nothing and is not counted.
class HeapGuard {
 public:
  /// Real-time: wait-free.
  HeapGuard() noexcept;

  /// Heap calls since construction of the thread that asks, which must be the one that made the guard; 0
  /// where the guard is not available. Real-time: wait-free.
  int64_t calls() const noexcept;

  /// Whether heap calls are counted: false under a sanitizer, which has a malloc of its own, and without
  /// glibc. Real-time: wait-free.
  static bool available() noexcept;

 private:
  int64_t at_start_;
};

}  // namespace tendril::rt
