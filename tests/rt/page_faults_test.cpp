// SPDX-License-Identifier: Apache-2.0
#include "rt/page_faults.h"

#include <sys/mman.h>

#include <catch2/catch.hpp>
#include <thread>

namespace tendril::rt::page_faults_test {

#ifndef TENDRIL_SANITIZED  // shadow memory faults too

constexpr std::size_t kPages = 64, kBytes = kPages * 4096;

// Fresh pages, in small units even where the kernel prefers huge ones.
volatile char* fresh_pages() {
  void* const pages = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  REQUIRE(pages != MAP_FAILED);
  madvise(pages, kBytes, MADV_NOHUGEPAGE);
  return static_cast<volatile char*>(pages);
}

void touch(volatile char* pages) {
  for (std::size_t at = 0; at < kBytes; at += 4096) pages[at] = 1;
}

void unmap(volatile char* pages) { munmap(const_cast<char*>(pages), kBytes); }

TEST_CASE("PageFaultCounter counts the first touch of a page and no other", "[rt]") {
  volatile char* const pages = fresh_pages();
  const PageFaultCounter first;
  touch(pages);
  const PageFaults of_first = first.faults();
  const PageFaultCounter second;
  touch(pages);
  const PageFaults of_second = second.faults();
  unmap(pages);
  CHECK(of_first.minor >= static_cast<int64_t>(kPages));
  CHECK(of_second.minor < static_cast<int64_t>(kPages));
}

TEST_CASE("PageFaultCounter leaves out the faults of other threads", "[rt]") {
  volatile char* const pages = fresh_pages();
  int64_t others = 0;
  std::thread other([&] {
    const PageFaultCounter faults;
    touch(pages);
    others = faults.faults().minor;
  });
  const PageFaultCounter faults;
  other.join();
  const int64_t ours = faults.faults().minor;
  unmap(pages);
  CHECK(others >= static_cast<int64_t>(kPages));
  CHECK(ours < static_cast<int64_t>(kPages));
}

#endif

}  // namespace tendril::rt::page_faults_test
