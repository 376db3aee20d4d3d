#define TENDRIL_FRONT_KERNELS kFrontKernelsV4
#include "fem/sparse/front_kernels_body.h"
