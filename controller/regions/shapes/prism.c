/* See prism.py; a part of regions.c. */
static Evaluation prism(const Real p[3], const Real e[4], const Real q[], int size)
{
    (void)e;
    int n = (size - 2) / 2;
    Real nearest = splat(INFINITY), gx = splat(0.0), gy = splat(0.0);
    Real corner_sign = splat(1.0), side = splat(1.0); /* -1 inside */
    for (int i = 0; i < n; i++) {
        const Real *a = q + 2 + 2 * i, *b = q + 2 + 2 * (i + 1 < n ? i + 1 : 0);
        Real ex = b[0] - a[0], ey = b[1] - a[1], length = length2(ex, ey);
        Real x = p[0] - a[0], y = p[1] - a[1];
        Real along = clamp((x * ex + y * ey) / (length * length), splat(0.0), splat(1.0));
        Real dx = x - along * ex, dy = y - along * ey, distance = length2(dx, dy);
        Mask kept = distance >= nearest; /* so that NaN stays NaN */
        Mask at_corner = (distance > 0.0) & ((along == 0.0) | (along == 1.0));
        /* on both sides of an edge the signed distance increases along its outward normal */
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
