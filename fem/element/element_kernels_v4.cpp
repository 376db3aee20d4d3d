#define TENDRIL_PACKET_SIZE 8
#define TENDRIL_ELEMENT_KERNELS kElementKernelsV4
#include "fem/element/element_kernels_body.h"
