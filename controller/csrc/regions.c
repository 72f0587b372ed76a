/* See regions.h. */
#include "regions.h"

#define PI 3.14159265358979323846

typedef struct {
    Real g, gradient[3], distance;
} Evaluation;

typedef struct {
    Real distance, of_first, of_second;
} Product;

/* Into [low, high]; NaN stays NaN. */
static Real clamp(Real x, Real low, Real high)
{
    Real above = choose(x < low, low, x);
    return choose(above > high, high, above);
}

/* numerator / denominator where the denominator is above zero, else 0. */
static Real ratio(Real numerator, Real denominator)
{
    Mask good = denominator > 0.0;
    return choose(good, numerator / choose(good, denominator, splat(1.0)), splat(0.0));
}

static Real length3(Real x, Real y, Real z)
{
    return real_sqrt(x * x + y * y + z * z);
}

static Real length2(Real x, Real y)
{
    return real_sqrt(x * x + y * y);
}

/* Lane by lane: it is rarely used. */
static Real arc_tangent(Real y, Real x)
{
    Real angle = y;
    for (int i = 0; i < (int)(sizeof(Real) / sizeof(double)); i++)
        set_lane(&angle, i, atan2(lane(y, i), lane(x, i)));
    return angle;
}

/* R^T (p - c) for a centre packed at q and a rotation matrix, row by row, behind it. */
static void to_local(const Real p[3], const Real q[12], Real local[3])
{
    const Real *R = q + 3;
    Real d0 = p[0] - q[0], d1 = p[1] - q[1], d2 = p[2] - q[2];
    for (int i = 0; i < 3; i++)
        local[i] = R[i] * d0 + R[i + 3] * d1 + R[i + 6] * d2;
}

/* R x for a rotation matrix, row by row. */
static void to_world(const Real R[9], Real x, Real y, Real z, Real world[3])
{
    for (int i = 0; i < 3; i++)
        world[i] = R[3 * i] * x + R[3 * i + 1] * y + R[3 * i + 2] * z;
}

/* Returns the signed distance to the product of two sets in perpendicular directions, given the signed distance to each, and
 * its derivatives by the two. */
static Product product_distance(Real first, Real second)
{
    Product result;
    Mask outside_both = (first > 0.0) & (second > 0.0);
    Mask farther = first >= second;
    Real corner = length2(first, second);
    result.distance = choose(outside_both, corner, choose(farther, first, second));
    result.of_first = choose(outside_both, ratio(first, corner), choose(farther, splat(1.0), splat(0.0)));
    result.of_second = choose(outside_both, ratio(second, corner), choose(farther, splat(0.0), splat(1.0)));
    /* NaN stays NaN: a lost position is not safe */
    Real sum = first + second;
    Mask whole = sum == sum;
    result.distance = choose(whole, result.distance, sum);
    result.of_first = choose(whole, result.of_first, sum);
    result.of_second = choose(whole, result.of_second, sum);
    return result;
}

static Real signed_like(Real size, Real sign)
{
    return choose(sign >= 0.0, size, -size);
}

#include "shape_functions.h" /* generated: the functions of the shapes, and their kinds */

void regions_evaluate(const Regions *regions, const Real position[3], const Real quaternion[4], Real value[],
                      Real gradient[][3], Real clearance[])
{
    for (int i = 0; i < regions->n; i++) {
        Real at[3];
        for (int j = 0; j < 3; j++)
            at[j] = position[j] - regions->shifts[i][j];
        int first = regions->offsets[i];
        double sign = regions->signs[i];
        Evaluation found =
            evaluate_shape(regions->kinds[i], at, quaternion, regions->numbers + first, regions->offsets[i + 1] - first);
        value[i] = sign * found.g;
        for (int j = 0; j < 3; j++)
            gradient[i][j] = sign * found.gradient[j];
        clearance[i] = -sign * found.distance;
    }
}

Real regions_ramp(Real clearance, Real width)
{
    Mask smooth = width > 0.0;
    Real fallen = clearance / choose(smooth, width, splat(1.0));
    Real between = choose(smooth, 1.0 - fallen, clearance); /* the last only for NaN */
    return choose(clearance <= 0.0, splat(1.0), choose(clearance >= width, splat(0.0), between));
}
