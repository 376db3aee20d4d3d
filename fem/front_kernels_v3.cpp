#define TENDRIL_FRONT_KERNELS kFrontKernelsV3
#include "fem/front_kernels_body.h"
