// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>

#ifndef TENDRIL_SANITIZED

#include <atomic>
#include <cstdlib>

#include "tests/qp/random_problem.h"

namespace {

std::atomic<bool> counting{false};
std::atomic<int> calls{0};

void count() {
  if (counting) ++calls;
}

}  // namespace

// Eigen allocates by malloc, everything else by new: both pass here.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}
void* realloc(void* pointer, std::size_t size) {
  count();
  return __libc_realloc(pointer, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}
}

namespace tendril::qp {

TEST_CASE("The heap counter sees an allocation", "[rt]") {
  calls = 0;
  counting = true;
  void* volatile pointer = std::malloc(16);
  counting = false;
  std::free(pointer);
  CHECK(calls == 1);
}

TEST_CASE("Preparing and solving allocate nothing, however they end", "[rt]") {
  std::mt19937_64 random(77);
  auto problem = std::make_unique<Problem>();
  auto solver = std::make_unique<Solver>();
  std::array<int, 4> ended{};
  for (int repeat = 0; repeat < 400; ++repeat) {
    const int n = 1 + repeat % kMaxVariables;
    Qp qp = random_qp(random, n, repeat % 2 == 0 ? Rows::kArbitrary : Rows::kFeasible);
    if (repeat % 7 == 0) qp.g[0] = std::numeric_limits<double>::quiet_NaN();
    const Vector hold = Vector::Zero(n);
    const int cap = repeat % 5 == 0 ? 3 : 500;
    calls = 0;
    counting = true;
    problem->prepare(qp.H, qp.A);
    const Solution& solution = solver->solve(*problem, qp.g, qp.bounds, hold, cap);
    counting = false;
    CAPTURE(n, repeat);
    REQUIRE(calls == 0);
    ++ended[static_cast<std::size_t>(solution.status)];
  }
  for (const int count : ended) CHECK(count > 0);
}

}  // namespace tendril::qp

#endif
