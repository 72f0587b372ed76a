/* The water and its boundaries: a current, a free surface at z = 0, a flat bottom. */
#include "linear.h"
#include "plant.h"

void environment_current(const Parameters *p, const Drift *drift, double time, double depth, double velocity[3])
{
    const double below = max2(depth, 0.0);
    const double elapsed = time - drift->since;

    for (int i = 0; i < 3; i++)
        velocity[i] = p->current[i] + p->current_shear[i] * below + drift->value[i] + drift->slope[i] * elapsed;
}

double environment_submerged(const Parameters *p, double depth)
{
    const double r = p->hull_radius;
    const double fraction = (depth + r) / (2.0 * r); /* submerged fraction of the diameter; volume of a spherical cap */

    if (!p->free_surface || depth >= r)
        return 1.0;
    return depth <= -r ? 0.0 : fraction * fraction * (3.0 - 2.0 * fraction);
}

double environment_penetration(const Parameters *p, double depth)
{
    return depth + p->hull_radius - p->bottom_depth;
}

double environment_softening_depth(double T)
{
    return max2(4.0 * T, 50.0 * T * T);
}

/* A softening spring whose damping grows with the penetration x, so that the force begins at zero, never pulls, and returns
 * no energy beyond the spring's. With the time constant T and u = x', both rates stay below sqrt(5) / T at any speed:  N = m max(0, x / (1 + x / x1) / T^2 + 2 / T u x / (x + T |u| / 2)) */
void environment_contact(const Plant *plant, double penetration, const double velocity_world[3], double force[3])
{
    const Parameters *p = &plant->parameters;
    const double m = plant->derived.contact_mass, T = plant->derived.contact_time;
    const double x = penetration, u = velocity_world[2];

    if (!(x > 0.0)) {
        force[0] = force[1] = force[2] = 0.0;
        return;
    }
    const double spring = x / (1.0 + x / environment_softening_depth(T)) / (T * T);
    const double normal = m * max2(spring + 2.0 / T * u * x / (x + 0.5 * T * fabs(u)), 0.0);

    /* Coulomb friction, viscous below 1 cm/s, and never faster than the contact itself */
    const double speed =
        sqrt(velocity_world[0] * velocity_world[0] + velocity_world[1] * velocity_world[1] + 1e-4);
    const double drag = min2(p->bottom_friction * normal / speed, m / T);
    force[0] = -drag * velocity_world[0];
    force[1] = -drag * velocity_world[1];
    force[2] = -normal;
}
