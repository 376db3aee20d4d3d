#include <cstdint>

#include "tests/fuzz/fuzzed.h"

/// libFuzzer's entry: feeds one input to the reader that this program is built for. It must read or refuse
/// it; the sanitizers and the memory limit say whether it does so in bounds.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  tendril::fem::fuzz::read_or_refuse(TENDRIL_FUZZED_FORMAT, {data, data + size});
  return 0;
}
