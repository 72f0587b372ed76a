/* See visibility.py; a part of regions.c. */
static Evaluation visibility(const Real p[3], const Real e[4], const Real q[], int size)
{
    (void)size;
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

    /* the angle to the axis a, and its gradient by b: ((a . b) b / |b|^2 - a) / |a x b| */
    Real along = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    Real aside = length3(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
    Real k = ratio(along, square);
    for (int i = 0; i < 3; i++)
        s[i] = ratio(k * b[i] - a[i], aside);
    Real angle = choose(square == 0.0, splat(PI), arc_tangent(aside, along)); /* at the camera: as if behind it */

    /* db = -R^T dp */
    Evaluation result;
    to_world(R, s[0], s[1], s[2], result.gradient);
    for (int i = 0; i < 3; i++)
        result.gradient[i] = -result.gradient[i];
    result.g = result.distance = angle - q[9];
    return result;
}
