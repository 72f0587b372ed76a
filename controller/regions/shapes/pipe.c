/* See pipe.py; a part of regions.c. */
static Evaluation pipe(const Real p[3], const Real e[4], const Real q[], int size)
{
    (void)e;
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
        Mask kept = distance >= nearest; /* so that NaN stays NaN */
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
