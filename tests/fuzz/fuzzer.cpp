// SPDX-License-Identifier: Apache-2.0
#include <cstdint>

#include "tests/fuzz/inputs.h"

/// libFuzzer's entry: gives one input to the code that this program is built for. An exception ends the
/// program, as what the sanitizers find does.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  tendril::fuzz::TENDRIL_FUZZED({data, data + size});
  return 0;
}
