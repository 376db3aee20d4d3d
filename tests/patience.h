// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdlib>
#include <thread>

namespace tendril::testing {

/// TENDRIL_PATIENCE of the environment, 1 where it says nothing: by how much this machine is slower than an
/// ordinary one. tools/vcan sets it in an emulated machine. bench.py in tests/peers reads it likewise.
inline double slowness() {
  const char* text = std::getenv("TENDRIL_PATIENCE");
  const double factor = text ? std::atof(text) : 1;
  return factor > 0 ? factor : 1;
}

/// How long a test waits for what must come, s: so long that only what hangs misses it, also sanitized and
/// beside other tests. Nothing is ever judged by how long it took.
inline const double kPatience_s = 60 * slowness();

/// Asks again and again whether something is so.
/// @return  false where it was not until patience ended
template <class Question>
bool comes_true(Question question, double patience_s = kPatience_s) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::duration<double>(patience_s);
  while (!question()) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

}  // namespace tendril::testing
