/* The water and what bounds it: a current, a free surface at z = 0, a flat bottom. */
#include "plant.h"

#include <math.h>

void environment_current(const Parameters *p, const Drift *drift, double time, double depth, double velocity[3])
{
    const double below = depth > 0.0 ? depth : 0.0, elapsed = time - drift->since;

    for (int i = 0; i < 3; i++)
        velocity[i] = p->current[i] + p->current_shear[i] * below + drift->value[i] + drift->slope[i] * elapsed;
}

double environment_submerged(const Parameters *p, double depth)
{
    const double r = p->hull_radius;

    if (!p->free_surface || depth >= r)
        return 1.0;
    if (depth <= -r)
        return 0.0;
    const double part = (depth + r) / (2.0 * r); /* of the diameter; a spherical cap's volume */
    return part * part * (3.0 - 2.0 * part);
}

/* What the spring of the bottom yields to, so that a hull found deep in it leaves at some 2 m/s: half the force at depth
 * x1, which never is less than what holds 50 m/s2. */
static double softening(double T)
{
    return fmax(4.0 * T, 50.0 * T * T);
}

/* A softening spring whose damping grows with the depth of contact x, so that the force sets in at zero, never pulls, and
 * gives no energy back beyond the spring's. With T the time constant and u = x', both rates stay below sqrt(5) / T at any
 * speed:  N = m max(0, x / (1 + x / x1) / T^2 + 2 / T u x / (x + T |u| / 2)) */
int environment_contact(const Plant *plant, double depth, const double velocity_world[3], double force[3])
{
    const Parameters *p = &plant->parameters;
    const double m = plant->derived.contact_mass, T = plant->derived.contact_time;
    const double x = depth + p->hull_radius - p->bottom_depth, u = velocity_world[2];

    if (!(x > 0.0))
        return 0;
    const double spring = x / (1.0 + x / softening(T)) / (T * T);
    const double normal = m * fmax(0.0, spring + 2.0 / T * u * x / (x + 0.5 * T * fabs(u)));

    /* Coulomb's friction at any speed of note, viscous below 1 cm/s, and never faster than the contact itself */
    const double speed = sqrt(velocity_world[0] * velocity_world[0] + velocity_world[1] * velocity_world[1] + 1e-4);
    const double drag = fmin(p->bottom_friction * normal / speed, m / T);
    force[0] = -drag * velocity_world[0];
    force[1] = -drag * velocity_world[1];
    force[2] = -normal;
    return 1;
}

/* ---- tangents ---------------------------------------------------------------------------------------------- */

double environment_submerged_tangent(const Parameters *p, const Parameters *dp, double depth, double ddepth)
{
    const double r = p->hull_radius, dr = dp->hull_radius;

    if (!p->free_surface || depth >= r || depth <= -r)
        return 0.0;
    const double part = (depth + r) / (2.0 * r), dpart = (ddepth + dr - 2.0 * part * dr) / (2.0 * r);
    return 6.0 * part * (1.0 - part) * dpart;
}

/* The contact's mass is the inverse of a row sum of M^-1, which changes by -M^-1 dM M^-1. */
static double contact_mass_tangent(const Derived *d, const double dM[6][6])
{
    const double *row = d->mass_inverse[d->stiffest];
    double dsum = 0.0;

    for (int j = 0; j < 3; j++)
        for (int k = 0; k < 6; k++)
            for (int l = 0; l < 6; l++)
                dsum -= copysign(1.0, row[j]) * row[k] * dM[k][l] * d->mass_inverse[l][j];
    return -d->contact_mass * d->contact_mass * dsum;
}

void environment_contact_tangent(const Plant *plant, const Parameters *dp, const double dM[6][6], double depth,
                                 double ddepth, const double v[3], const double dv[3], double dforce[3])
{
    const Parameters *p = &plant->parameters;
    const double m = plant->derived.contact_mass, dm = contact_mass_tangent(&plant->derived, dM);
    const double T = plant->derived.contact_time;
    const double dT = T == p->bottom_time_constant ? dp->bottom_time_constant : CONTACT_SUBSTEPS * dp->substep;
    const double x = depth + p->hull_radius - p->bottom_depth, dx = ddepth + dp->hull_radius - dp->bottom_depth;
    const double u = v[2], du = dv[2], speed_u = fabs(u), dspeed_u = u < 0.0 ? -du : du;

    const double x1 = softening(T), dx1 = (x1 == 4.0 * T ? 4.0 : 100.0 * T) * dT, q = 1.0 + x / x1;
    const double spring = x / q / (T * T);
    const double dspring = (dx - x * (dx - x * dx1 / x1) / x1 / q) / q / (T * T) - 2.0 * spring * dT / T;

    /* normal force m (spring + 2 g / T) with g = u x / s, s = x + T |u| / 2 */
    const double s = x + 0.5 * T * speed_u, ds = dx + 0.5 * (dT * speed_u + T * dspeed_u);
    const double g = u * x / s, dg = (du * x + u * dx - g * ds) / s;
    const double push = spring + 2.0 / T * g, dpush = dspring + 2.0 / T * (dg - g * dT / T);
    const double normal = m * fmax(0.0, push), dnormal = push > 0.0 ? dm * push + m * dpush : 0.0;

    const double speed = sqrt(v[0] * v[0] + v[1] * v[1] + 1e-4), dspeed = (v[0] * dv[0] + v[1] * dv[1]) / speed;
    const double friction = p->bottom_friction * normal / speed;
    const int slides = friction < m / T;
    const double drag = slides ? friction : m / T;
    const double ddrag = slides ? (dp->bottom_friction * normal + p->bottom_friction * dnormal - drag * dspeed) / speed
                                : (dm - m * dT / T) / T;
    dforce[0] = -ddrag * v[0] - drag * dv[0];
    dforce[1] = -ddrag * v[1] - drag * dv[1];
    dforce[2] = -dnormal;
}
