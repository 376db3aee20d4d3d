#define TENDRIL_PACKET_SIZE 4
#define TENDRIL_ELEMENT_KERNELS kElementKernelsV3
#include "fem/element/element_kernels_body.h"
