/* See ellipsoid.py; a part of regions.c. */
enum { MOST_STEPS = 200 }; /* more than the root search below ever needs */

/* Returns the distance from a point of the first octant to the surface, by Newton's method from the left of the root of a
 * decreasing convex function, so that its iterates increase; see ellipsoid.py. */
static Real surface_distance(const Real point[3], const Real axes[3])
{
    Real least = real_fmin(real_fmin(axes[0], axes[1]), axes[2]);
    Real excess[3], x[3], s;
    for (int i = 0; i < 3; i++) {
        excess[i] = axes[i] * axes[i] - least * least;
        /* moves a point out of a plane of symmetry, by less than rounding */
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

static Evaluation ellipsoid(const Real p[3], const Real e[4], const Real q[], int size)
{
    (void)e, (void)size;
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
