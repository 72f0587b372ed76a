/* See sphere.py; a part of regions.c. */
static Evaluation sphere(const Real p[3], const Real e[4], const Real q[], int size)
{
    (void)e, (void)size;
    Real x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
    Real square = x * x + y * y + z * z;
    Evaluation result = {square - q[3] * q[3], {2.0 * x, 2.0 * y, 2.0 * z}, real_sqrt(square) - q[3]};
    return result;
}
