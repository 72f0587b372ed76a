/* See cylinder.py; a part of regions.c. */
static Evaluation cylinder(const Real p[3], const Real e[4], const Real q[], int size)
{
    (void)e, (void)size;
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
