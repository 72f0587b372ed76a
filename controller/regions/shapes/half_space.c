/* See half_space.py; a part of regions.c. */
static Evaluation half_space(const Real p[3], const Real e[4], const Real q[], int size)
{
    (void)e, (void)size;
    Real g = q[3] * (p[0] - q[0]) + q[4] * (p[1] - q[1]) + q[5] * (p[2] - q[2]);
    Evaluation result = {g, {q[3], q[4], q[5]}, g};
    return result;
}
