/* See box.py; a part of regions.c. */
static Evaluation box(const Real p[3], const Real e[4], const Real q[], int size)
{
    (void)e, (void)size;
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
