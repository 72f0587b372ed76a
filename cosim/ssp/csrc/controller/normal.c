/* See normal.h. */
#include "normal.h"

#include <math.h>

#include "ziggurat.h" /* generated: the layers */

#define FACTOR_HIGH UINT64_C(2549297995355413924) /* of PCG's linear congruential generator of 128 bits */
#define FACTOR_LOW UINT64_C(4865540595714422341)

/* Returns the upper half of a product of 64 bits by 64. */
static uint64_t high_product(uint64_t a, uint64_t b)
{
    const uint64_t a0 = a & 0xffffffffu, a1 = a >> 32, b0 = b & 0xffffffffu, b1 = b >> 32;
    const uint64_t low = a0 * b0, cross = a1 * b0 + (low >> 32), other = a0 * b1 + (cross & 0xffffffffu);

    return a1 * b1 + (cross >> 32) + (other >> 32);
}

static uint64_t next_word(Normal *random)
{
    const uint64_t high = random->state[0], low = random->state[1];
    const uint64_t product = low * FACTOR_LOW, sum = product + random->increment[1];

    random->state[0] = high_product(low, FACTOR_LOW) + high * FACTOR_LOW + low * FACTOR_HIGH + random->increment[0] +
                       (sum < product);
    random->state[1] = sum;
    const uint64_t mixed = random->state[0] ^ random->state[1];
    const unsigned turn = (unsigned)(random->state[0] >> 58);
    return mixed >> turn | mixed << (-turn & 63u);
}

/* Uniform in [0, 1). */
static double next_uniform(Normal *random)
{
    return (double)(next_word(random) >> 11) / 9007199254740992.0;
}

/* Beyond the outermost layer: Marsaglia's method. */
static double draw_tail(Normal *random, int negative)
{
    double x, y;

    do {
        x = -log1p(-next_uniform(random)) / OUTERMOST;
        y = -log1p(-next_uniform(random));
    } while (!(y + y > x * x));
    return negative ? -(OUTERMOST + x) : OUTERMOST + x;
}

double normal_draw(Normal *random)
{
    for (;;) {
        const uint64_t word = next_word(random);
        const int layer = (int)(word & 0xff);
        const uint64_t size = word >> 9 & UINT64_C(0xfffffffffffff);
        const double x = (word & 0x100 ? -1.0 : 1.0) * (double)size * WIDTHS[layer];

        if (size < INNER[layer])
            return x;
        if (layer == 0)
            return draw_tail(random, (size >> 8 & 1) != 0);
        if ((HEIGHTS[layer - 1] - HEIGHTS[layer]) * next_uniform(random) + HEIGHTS[layer] < exp(-0.5 * x * x))
            return x;
    }
}
