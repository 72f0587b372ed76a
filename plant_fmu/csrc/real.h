/* The number type of the model: a double or, compiled with -DLANES=n, n doubles side by side, one for each of n vehicles.
 *
 * Code written with Real serves both. Arithmetic and comparisons are C's own and act on each lane; a literal may stand
 * next to a Real (2.0 * x), but is no Real itself: splat(2.0) is. A comparison gives a Mask. Masks are combined by & and |,
 * inverted by mask_not, and used by choose, which evaluates both sides: in place of if, ?:, && and ||. Lanes are
 * independent, so each gets the bits that it would get alone. */
#ifndef REAL_H
#define REAL_H

#include <math.h>

#ifndef LANES

typedef double Real;
typedef int Mask;

static inline Real splat(double number) { return number; }
static inline double lane(Real x, int i) { return (void)i, x; }
static inline void set_lane(Real *x, int i, double number) { (void)i, *x = number; }

static inline Real choose(Mask which, Real yes, Real no) { return which ? yes : no; }
static inline Mask mask_not(Mask which) { return !which; }
static inline int any(Mask which) { return which; }
static inline int all(Mask which) { return which; }
static inline int mask_lane(Mask which, int i) { return (void)i, which; }
static inline void set_mask_lane(Mask *which, int i, int yes) { (void)i, *which = yes != 0; }

static inline Real real_sqrt(Real x) { return sqrt(x); }
static inline Real real_fabs(Real x) { return fabs(x); }
static inline Real real_fmax(Real x, Real y) { return x > y ? x : y; } /* y where either is NaN */
static inline Real real_fmin(Real x, Real y) { return x < y ? x : y; }
static inline Real real_copysign(Real x, Real sign) { return copysign(x, sign); }

#else /* vectors as GCC and Clang know them */

enum { N_LANES = LANES };

typedef double Real __attribute__((vector_size(8 * LANES)));
typedef long long Mask __attribute__((vector_size(8 * LANES)));

static inline Real splat(double number) { return number - (Real){0.0}; } /* the bits of -0.0, too */
static inline double lane(Real x, int i) { return x[i]; }
static inline void set_lane(Real *x, int i, double number) { (*x)[i] = number; }

static inline Real choose(Mask which, Real yes, Real no)
{
    return (Real)(((Mask)yes & which) | ((Mask)no & ~which));
}

static inline Mask mask_not(Mask which) { return ~which; }

static inline int any(Mask which)
{
    long long joined = 0;

    for (int i = 0; i < LANES; i++)
        joined |= which[i];
    return joined != 0;
}

static inline int all(Mask which) { return !any(~which); }
static inline int mask_lane(Mask which, int i) { return which[i] != 0; }
static inline void set_mask_lane(Mask *which, int i, int yes) { (*which)[i] = yes ? -1 : 0; }

static inline Real real_fabs(Real x) { return (Real)((Mask)x & 0x7fffffffffffffffLL); }
static inline Real real_fmax(Real x, Real y) { return choose(x > y, x, y); }
static inline Real real_fmin(Real x, Real y) { return choose(x < y, x, y); }

static inline Real real_copysign(Real x, Real sign)
{
    return (Real)(((Mask)x & 0x7fffffffffffffffLL) | ((Mask)sign & ~0x7fffffffffffffffLL));
}

static inline Real real_sqrt(Real x)
{
    for (int i = 0; i < LANES; i++)
        x[i] = sqrt(x[i]);
    return x;
}

#endif

#endif
