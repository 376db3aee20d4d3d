#include "fem/sparse/front_kernels.h"

#include "fem/simd/simd.h"

namespace tendril::fem {

const FrontKernels& front_kernels() {
#ifdef __x86_64__
  static const bool v4 = runs_x86_64_v4();
  return v4 ? kFrontKernelsV4 : kFrontKernelsV3;
#else
  return kFrontKernelsV3;
#endif
}

}  // namespace tendril::fem
