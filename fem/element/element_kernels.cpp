#include "fem/element/element_kernels.h"

#include "fem/simd/simd.h"

namespace tendril::fem {

const ElementKernels& element_kernels() {
#ifdef __x86_64__
  static const bool v4 = runs_x86_64_v4();
  return v4 ? kElementKernelsV4 : kElementKernelsV3;
#else
  return kElementKernelsV3;
#endif
}

}  // namespace tendril::fem
