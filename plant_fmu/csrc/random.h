/* Random numbers of the vehicle's plant and of a packaged controller. */
#ifndef RANDOM_H
#define RANDOM_H

#include "model.h" /* names the functions */

/* Writes two independent numbers, uniform in [0, 1), at index `count` of a seeded stream. */
void random_uniform(int seed, unsigned stream, unsigned long long count, double out[2]);

/* Returns the standard normal number at index `count` of a seeded stream: the same at every call (Philox 4x32-10,
 * Box-Muller). */
double random_normal(int seed, unsigned stream, unsigned long long count);

#endif
