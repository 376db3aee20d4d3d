#define TENDRIL_WIDTH 4
#define TENDRIL_ELEMENT_KERNELS kElementKernelsV3
#include "fem/element/element_kernels_body.h"
