/* See depth_band.py; a part of regions.c. */
static Evaluation depth_band(const Real p[3], const Real e[4], const Real q[], int size)
{
    (void)e, (void)size;
    Real z = p[2] - q[0];
    Evaluation result = {z * z - q[1] * q[1], {splat(0.0), splat(0.0), 2.0 * z}, real_fabs(z) - q[1]};
    return result;
}
