// SPDX-License-Identifier: Apache-2.0
#include "fem/simd/simd.h"

namespace tendril::fem {

InstructionSet best_instruction_set() {
#ifdef __x86_64__
  const bool v4 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                  __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                  __builtin_cpu_supports("avx512vl");
  return v4 ? InstructionSet::kV4 : InstructionSet::kV3;
#else
  return InstructionSet::kV3;
#endif
}

}  // namespace tendril::fem
