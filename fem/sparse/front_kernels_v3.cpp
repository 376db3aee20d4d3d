#define TENDRIL_FRONT_KERNELS kFrontKernelsV3
#include "fem/sparse/front_kernels_body.h"
