// SPDX-License-Identifier: Apache-2.0
#include "fem/sparse/front_kernels.h"

namespace tendril::fem {

namespace v3 {
extern const FrontKernels kFrontKernels;
}
namespace v4 {
extern const FrontKernels kFrontKernels;
}

const FrontKernels& front_kernels(InstructionSet set) {
  if constexpr (kHasV4)
    if (set == InstructionSet::kV4) return v4::kFrontKernels;
  return v3::kFrontKernels;
}

}  // namespace tendril::fem
