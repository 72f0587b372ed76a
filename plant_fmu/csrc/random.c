/* Random numbers without a state: a keyed hash of stream and index. Runs repeat with any step size, saved states need no
 * generator, and streams are independent. */
#include "random.h"

#include <math.h>
#include <stdint.h>

#include "elementary.h"

/* Philox 4x32-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", SC11). */
static void philox(uint32_t c[4], uint32_t key0, uint32_t key1)
{
    for (int round = 0; round < 10; round++) {
        const uint64_t a = (uint64_t)0xD2511F53u * c[0], b = (uint64_t)0xCD9E8D57u * c[2];
        const uint32_t next[4] = {(uint32_t)(b >> 32) ^ c[1] ^ key0, (uint32_t)b, (uint32_t)(a >> 32) ^ c[3] ^ key1,
                                  (uint32_t)a};
        for (int i = 0; i < 4; i++)
            c[i] = next[i];
        key0 += 0x9E3779B9u;
        key1 += 0xBB67AE85u;
    }
}

/* Writes four words at index `count` of a stream. */
static void draw(int seed, unsigned stream, unsigned long long count, uint32_t c[4])
{
    c[0] = (uint32_t)count;
    c[1] = (uint32_t)(count >> 32);
    c[2] = stream;
    c[3] = 0;
    philox(c, (uint32_t)seed, 0);
}

/* Returns a number of 53 bits, uniform in [0, 1). */
static double uniform(const uint32_t high, const uint32_t low)
{
    return ((double)(high >> 5) * 67108864.0 + (double)(low >> 6)) / 9007199254740992.0;
}

void random_uniform(int seed, unsigned stream, unsigned long long count, double out[2])
{
    uint32_t c[4];

    draw(seed, stream, count, c);
    out[0] = uniform(c[0], c[1]);
    out[1] = uniform(c[2], c[3]);
}

double random_normal(int seed, unsigned stream, unsigned long long count)
{
    uint32_t c[4];

    draw(seed, stream, count, c);
    /* u in (0, 1], for the logarithm */
    const double u = ((double)(c[0] >> 5) * 67108864.0 + (double)(c[1] >> 6) + 1.0) / 9007199254740992.0;
    const double v = uniform(c[2], c[3]);
    return sqrt(-2.0 * elementary_log(u)) * elementary_cos_turns(v); /* Box-Muller */
}
