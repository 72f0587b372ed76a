/* See cone.py; a part of regions.c. */
static Evaluation cone(const Real p[3], const Real e[4], const Real q[], int size)
{
    (void)e, (void)size;
    /* in the half-plane through the axis: `along` it, and `aside` from it */
    Real x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
    Real along = q[3] * x + q[4] * y + q[5] * z;
    Real off[3] = {x - along * q[3], y - along * q[4], z - along * q[5]};
    Real aside = length3(off[0], off[1], off[2]);
    Real sine = q[6], cosine = q[7], reach = q[8];
    Real from_feature = length2(along, aside), beyond = from_feature - reach;

    /* the nearest point of the flank */
    Real on_flank = clamp(aside * sine + along * cosine, splat(0.0), reach);
    Real to_aside = aside - on_flank * sine, to_along = along - on_flank * cosine;
    Real flank = length2(to_aside, to_along);
    Real outside = choose(cosine * aside - sine * along >= 0.0, splat(1.0), splat(-1.0));

    Mask cap = beyond > outside * flank, on_surface = flank <= 0.0;
    Real of_aside = choose(cap, ratio(aside, from_feature),
                           choose(on_surface, cosine, ratio(outside * to_aside, flank)));
    Real of_along = choose(cap, ratio(along, from_feature),
                           choose(on_surface, -sine, ratio(outside * to_along, flank)));
    Real outward = ratio(of_aside, aside);
    Evaluation result;
    result.g = result.distance = choose(cap, beyond, outside * flank);
    for (int i = 0; i < 3; i++)
        result.gradient[i] = outward * off[i] + of_along * q[3 + i];
    return result;
}
