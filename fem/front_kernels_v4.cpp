#define TENDRIL_FRONT_KERNELS kFrontKernelsV4
#include "fem/front_kernels_body.h"
