/* See orientation.py; a part of regions.c. */
/* Gradients are by position alone: no force turns the vehicle for this shape. */
static Evaluation orientation(const Real p[3], const Real e[4], const Real q[], int size)
{
    (void)p, (void)size;
    Real scalar = q[0] * e[0] + q[1] * e[1] + q[2] * e[2] + q[3] * e[3];
    Real x = q[0] * e[1] - q[1] * e[0] - q[2] * e[3] + q[3] * e[2];
    Real y = q[0] * e[2] + q[1] * e[3] - q[2] * e[0] - q[3] * e[1];
    Real z = q[0] * e[3] - q[1] * e[2] + q[2] * e[1] - q[3] * e[0];
    Evaluation result;
    result.g = result.distance = 2.0 * arc_tangent(length3(x, y, z), real_fabs(scalar)) - q[4];
    result.gradient[0] = result.gradient[1] = result.gradient[2] = splat(0.0);
    return result;
}
