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

/* numerator / denominator where that is above zero, else 0. */
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

/* Lane by lane: it is rare, and needs no speed. */
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

/* Signed distance to the product of two sets in perpendicular directions, of the signed distances to either, and how it
 * follows each. */
static Product product_distance(Real first, Real second)
{
    Product result;
    Mask outside_both = (first > 0.0) & (second > 0.0);
    Mask farther = first >= second;
    Real corner = length2(first, second);
    result.distance = choose(outside_both, corner, choose(farther, first, second));
    result.of_first = choose(outside_both, ratio(first, corner), choose(farther, splat(1.0), splat(0.0)));
    result.of_second = choose(outside_both, ratio(second, corner), choose(farther, splat(0.0), splat(1.0)));
    /* a lost position is no safe one */
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

static Evaluation sphere(const Real p[3], const Real q[])
{
    Real x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
    Real square = x * x + y * y + z * z;
    Evaluation result = {square - q[3] * q[3], {2.0 * x, 2.0 * y, 2.0 * z}, real_sqrt(square) - q[3]};
    return result;
}

static Evaluation depth_band(const Real p[3], const Real q[])
{
    Real z = p[2] - q[0];
    Evaluation result = {z * z - q[1] * q[1], {splat(0.0), splat(0.0), 2.0 * z}, real_fabs(z) - q[1]};
    return result;
}

static Evaluation half_space(const Real p[3], const Real q[])
{
    Real g = q[3] * (p[0] - q[0]) + q[4] * (p[1] - q[1]) + q[5] * (p[2] - q[2]);
    Evaluation result = {g, {q[3], q[4], q[5]}, g};
    return result;
}

static Evaluation box(const Real p[3], const Real q[])
{
    Real local[3];
    Evaluation result;
    to_local(p, q, local);
    Product flat = product_distance(real_fabs(local[0]) - q[12], real_fabs(local[1]) - q[13]);
    Product whole = product_distance(flat.distance, real_fabs(local[2]) - q[14]);
    result.g = result.distance = whole.distance;
    to_world(q + 3, signed_like(whole.of_first * flat.of_first, local[0]),
             signed_like(whole.of_first * flat.of_second, local[1]), signed_like(whole.of_second, local[2]),
             result.gradient);
    return result;
}

static Evaluation cylinder(const Real p[3], const Real q[])
{
    Real x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
    Real along = q[3] * x + q[4] * y + q[5] * z;
    Real aside[3] = {x - along * q[3], y - along * q[4], z - along * q[5]};
    Real radius = length3(aside[0], aside[1], aside[2]);
    Product whole = product_distance(radius - q[7], real_fabs(along) - q[6]);
    Real outward = ratio(whole.of_first, radius), axial = signed_like(whole.of_second, along);
    Evaluation result;
    result.g = result.distance = whole.distance;
    for (int i = 0; i < 3; i++)
        result.gradient[i] = outward * aside[i] + axial * q[3 + i];
    return result;
}

enum { MOST_STEPS = 200 }; /* more than the root below ever takes */

/* Distance from a point of the first octant to the surface: Newton's method from the left of the root of a function
 * that falls and is convex, so that it only grows, see controller/regions/ellipsoid.py. */
static Real surface_distance(const Real point[3], const Real axes[3])
{
    Real least = real_fmin(real_fmin(axes[0], axes[1]), axes[2]);
    Real excess[3], x[3], s;
    for (int i = 0; i < 3; i++) {
        excess[i] = axes[i] * axes[i] - least * least;
        /* a point in a plane of symmetry is moved out of it by less than rounding shows */
        Real smallest = 1e-14 * axes[i];
        x[i] = choose(point[i] < smallest, smallest, point[i]);
        Real start = axes[i] * x[i] - excess[i];
        s = i == 0 ? start : choose(start > s, start, s);
    }
    for (int step = 0; step < MOST_STEPS; step++) {
        Real value = splat(-1.0), slope = splat(0.0);
        for (int i = 0; i < 3; i++) {
            Real u = axes[i] * x[i] / (s + excess[i]);
            value = value + u * u;
            slope = slope + u * u / (s + excess[i]);
        }
        Real next = s + value / (2.0 * slope);
        Mask grows = next > s;
        if (!any(grows))
            break;
        s = choose(grows, next, s);
    }
    Real square = splat(0.0);
    for (int i = 0; i < 3; i++) {
        Real off = x[i] - x[i] * axes[i] * axes[i] / (s + excess[i]);
        square = square + off * off;
    }
    return real_sqrt(square);
}

static Evaluation ellipsoid(const Real p[3], const Real q[])
{
    const Real *axes = q + 12;
    Real local[3], octant[3], slope[3], g = splat(-1.0);
    Evaluation result;
    to_local(p, q, local);
    for (int i = 0; i < 3; i++) {
        Real part = local[i] / axes[i];
        g = g + part * part;
        slope[i] = 2.0 * local[i] / (axes[i] * axes[i]);
        octant[i] = real_fabs(local[i]);
    }
    result.g = g;
    to_world(q + 3, slope[0], slope[1], slope[2], result.gradient);
    Real distance = surface_distance(octant, axes);
    result.distance = choose(g > 0.0, distance, -distance);
    return result;
}

static Evaluation prism(const Real p[3], const Real q[], int size)
{
    int n = (size - 2) / 2;
    Real nearest = splat(INFINITY), gx = splat(0.0), gy = splat(0.0);
    Real corner_sign = splat(1.0), side = splat(1.0); /* -1 inside */
    for (int i = 0; i < n; i++) {
        const Real *a = q + 2 + 2 * i, *b = q + 2 + 2 * (i + 1 < n ? i + 1 : 0);
        Real ex = b[0] - a[0], ey = b[1] - a[1], length = length2(ex, ey);
        Real x = p[0] - a[0], y = p[1] - a[1];
        Real along = clamp((x * ex + y * ey) / (length * length), splat(0.0), splat(1.0));
        Real dx = x - along * ex, dy = y - along * ey, distance = length2(dx, dy);
        Mask kept = distance >= nearest; /* so that NaN comes through */
        Mask at_corner = (distance > 0.0) & ((along == 0.0) | (along == 1.0));
        /* on both sides of an edge the signed distance grows along its outward normal */
        gx = choose(kept, gx, choose(at_corner, ratio(dx, distance), ey / length));
        gy = choose(kept, gy, choose(at_corner, ratio(dy, distance), -ex / length));
        corner_sign = choose(kept, corner_sign, choose(at_corner, splat(-1.0), splat(1.0)));
        nearest = choose(kept, nearest, distance);
        /* a ray towards east crosses the edge */
        Mask crosses = ((a[0] > p[0]) != (b[0] > p[0])) & (p[1] < a[1] + (p[0] - a[0]) / ex * ey);
        side = choose(crosses, -side, side);
    }
    nearest = choose(side < 0.0, -nearest, nearest);
    corner_sign = choose(side < 0.0, corner_sign, splat(1.0));
    Real above = q[0] - p[2], below = p[2] - q[1];
    Mask lower = below >= above;
    Product whole = product_distance(nearest, choose(lower, below, above));
    Evaluation result;
    result.g = result.distance = whole.distance;
    result.gradient[0] = whole.of_first * (corner_sign * gx);
    result.gradient[1] = whole.of_first * (corner_sign * gy);
    result.gradient[2] = choose(lower, whole.of_second, -whole.of_second);
    return result;
}

static Evaluation pipe(const Real p[3], const Real q[], int size)
{
    Real nearest = splat(INFINITY), off[3] = {splat(0.0), splat(0.0), splat(0.0)};
    for (int i = 1; i < size - 3; i += 3) {
        Real e[3], d[3];
        for (int j = 0; j < 3; j++) {
            e[j] = q[i + 3 + j] - q[i + j];
            d[j] = p[j] - q[i + j];
        }
        Real along = clamp((d[0] * e[0] + d[1] * e[1] + d[2] * e[2]) / (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]),
                           splat(0.0), splat(1.0));
        for (int j = 0; j < 3; j++)
            d[j] = d[j] - along * e[j];
        Real distance = length3(d[0], d[1], d[2]);
        Mask kept = distance >= nearest; /* so that NaN comes through */
        nearest = choose(kept, nearest, distance);
        for (int j = 0; j < 3; j++)
            off[j] = choose(kept, off[j], d[j]);
    }
    Evaluation result;
    result.g = result.distance = nearest - q[0];
    for (int j = 0; j < 3; j++)
        result.gradient[j] = ratio(off[j], nearest);
    return result;
}

static Evaluation cone(const Real p[3], const Real q[])
{
    /* in the half-plane through the axis: `along` it, and `aside` from it */
    Real x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
    Real along = q[3] * x + q[4] * y + q[5] * z;
    Real off[3] = {x - along * q[3], y - along * q[4], z - along * q[5]};
    Real aside = length3(off[0], off[1], off[2]);
    Real sine = q[6], cosine = q[7], reach = q[8];
    Real from_feature = length2(along, aside), beyond = from_feature - reach;

    /* the nearest point of the flank */
    Real on_flank = clamp(aside * sine + along * cosine, splat(0.0), reach);
    Real to_aside = aside - on_flank * sine, to_along = along - on_flank * cosine;
    Real flank = length2(to_aside, to_along);
    Real outside = choose(cosine * aside - sine * along >= 0.0, splat(1.0), splat(-1.0));

    Mask cap = beyond > outside * flank, on_surface = flank <= 0.0;
    Real of_aside = choose(cap, ratio(aside, from_feature),
                           choose(on_surface, cosine, ratio(outside * to_aside, flank)));
    Real of_along = choose(cap, ratio(along, from_feature),
                           choose(on_surface, -sine, ratio(outside * to_along, flank)));
    Real outward = ratio(of_aside, aside);
    Evaluation result;
    result.g = result.distance = choose(cap, beyond, outside * flank);
    for (int i = 0; i < 3; i++)
        result.gradient[i] = outward * off[i] + of_along * q[3 + i];
    return result;
}

/* Gradients are by position alone: no force turns the vehicle for these two shapes. */
static Evaluation orientation(const Real e[4], const Real q[])
{
    Real scalar = q[0] * e[0] + q[1] * e[1] + q[2] * e[2] + q[3] * e[3];
    Real x = q[0] * e[1] - q[1] * e[0] - q[2] * e[3] + q[3] * e[2];
    Real y = q[0] * e[2] + q[1] * e[3] - q[2] * e[0] - q[3] * e[1];
    Real z = q[0] * e[3] - q[1] * e[2] + q[2] * e[1] - q[3] * e[0];
    Evaluation result;
    result.g = result.distance = 2.0 * arc_tangent(length3(x, y, z), real_fabs(scalar)) - q[4];
    result.gradient[0] = result.gradient[1] = result.gradient[2] = splat(0.0);
    return result;
}

static Evaluation visibility(const Real p[3], const Real e[4], const Real q[])
{
    const Real R[9] = {1.0 - 2.0 * (e[2] * e[2] + e[3] * e[3]), 2.0 * (e[1] * e[2] - e[0] * e[3]),
                       2.0 * (e[1] * e[3] + e[0] * e[2]),       2.0 * (e[1] * e[2] + e[0] * e[3]),
                       1.0 - 2.0 * (e[1] * e[1] + e[3] * e[3]), 2.0 * (e[2] * e[3] - e[0] * e[1]),
                       2.0 * (e[1] * e[3] - e[0] * e[2]),       2.0 * (e[2] * e[3] + e[0] * e[1]),
                       1.0 - 2.0 * (e[1] * e[1] + e[2] * e[2])};
    /* the feature in the body frame, from the camera */
    Real d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]}, b[3], s[3];
    const Real *a = q + 3;
    for (int i = 0; i < 3; i++)
        b[i] = R[i] * d[0] + R[i + 3] * d[1] + R[i + 6] * d[2] - q[6 + i];
    Real square = b[0] * b[0] + b[1] * b[1] + b[2] * b[2];

    /* the angle to the axis a, and how it follows b: ((a . b) b / |b|^2 - a) / |a x b| */
    Real along = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    Real aside = length3(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
    Real k = ratio(along, square);
    for (int i = 0; i < 3; i++)
        s[i] = ratio(k * b[i] - a[i], aside);
    Real angle = choose(square == 0.0, splat(PI), arc_tangent(aside, along)); /* in the camera itself: behind it */

    /* db = -R^T dp */
    Evaluation result;
    to_world(R, s[0], s[1], s[2], result.gradient);
    for (int i = 0; i < 3; i++)
        result.gradient[i] = -result.gradient[i];
    result.g = result.distance = angle - q[9];
    return result;
}

static Evaluation evaluate(int kind, const Real p[3], const Real e[4], const Real q[], int size)
{
    switch (kind) {
    case SHAPE_SPHERE:
        return sphere(p, q);
    case SHAPE_DEPTH_BAND:
        return depth_band(p, q);
    case SHAPE_HALF_SPACE:
        return half_space(p, q);
    case SHAPE_BOX:
        return box(p, q);
    case SHAPE_CYLINDER:
        return cylinder(p, q);
    case SHAPE_ELLIPSOID:
        return ellipsoid(p, q);
    case SHAPE_PRISM:
        return prism(p, q, size);
    case SHAPE_PIPE:
        return pipe(p, q, size);
    case SHAPE_CONE:
        return cone(p, q);
    case SHAPE_ORIENTATION:
        return orientation(e, q);
    default:
        return visibility(p, e, q);
    }
}

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
            evaluate(regions->kinds[i], at, quaternion, regions->numbers + first, regions->offsets[i + 1] - first);
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
    Real between = choose(smooth, 1.0 - fallen, clearance); /* NaN alone comes to the latter */
    return choose(clearance <= 0.0, splat(1.0), choose(clearance >= width, splat(0.0), between));
}
