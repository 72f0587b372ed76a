/* Standard normal numbers, those of numpy.random.default_rng: PCG64 (XSL-RR 128/64) and a ziggurat of 256 layers. */
#ifndef NORMAL_H
#define NORMAL_H

#include <stdint.h>

typedef struct {
    uint64_t state[2], increment[2]; /* of 128 bits, the upper half first */
} Normal;

/* The next number. */
double normal_draw(Normal *random);

#endif
