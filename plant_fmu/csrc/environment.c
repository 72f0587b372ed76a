/* The water and its boundaries: a current, a free surface at z = 0, a flat bottom. */
#include "plant.h"

void environment_current(const Parameters *p, const Drift *drift, double time, Real depth, Real velocity[3])
{
    const Real below = real_fmax(depth, splat(0.0));
    const double elapsed = time - drift->since;

    for (int i = 0; i < 3; i++)
        velocity[i] = p->current[i] + p->current_shear[i] * below + drift->value[i] + drift->slope[i] * elapsed;
}

Real environment_submerged(const Parameters *p, Real depth)
{
    const Real r = p->hull_radius;
    const Mask dry = depth <= -r, under = mask_not(p->free_surface) | (depth >= r);
    const Real part = (depth + r) / (2.0 * r); /* submerged fraction of the diameter; volume of a spherical cap */

    return choose(under, splat(1.0), choose(dry, splat(0.0), part * part * (3.0 - 2.0 * part)));
}

Real environment_sunk(const Parameters *p, Real depth)
{
    return depth + p->hull_radius - p->bottom_depth;
}

Real environment_softening(Real T)
{
    return real_fmax(4.0 * T, 50.0 * T * T);
}

/* A softening spring whose damping grows with the depth of contact x, so that the force sets in at zero, never pulls, and
 * gives no energy back beyond the spring's. With T the time constant and u = x', both rates stay below sqrt(5) / T at any
 * speed:  N = m max(0, x / (1 + x / x1) / T^2 + 2 / T u x / (x + T |u| / 2)) */
void environment_contact(const Plant *plant, Real sunk, const Real velocity_world[3], Real force[3])
{
    const Parameters *p = &plant->parameters;
    const Real m = plant->derived.contact_mass, T = plant->derived.contact_time, zero = splat(0.0);
    const Real x = sunk, u = velocity_world[2];
    const Mask touches = x > 0.0;

    const Real spring = x / (1.0 + x / environment_softening(T)) / (T * T);
    const Real normal = m * real_fmax(spring + 2.0 / T * u * x / (x + 0.5 * T * real_fabs(u)), zero);

    /* Coulomb friction, viscous below 1 cm/s, and never faster than the contact itself */
    const Real speed =
        real_sqrt(velocity_world[0] * velocity_world[0] + velocity_world[1] * velocity_world[1] + 1e-4);
    const Real drag = real_fmin(p->bottom_friction * normal / speed, m / T);
    force[0] = choose(touches, -drag * velocity_world[0], zero);
    force[1] = choose(touches, -drag * velocity_world[1], zero);
    force[2] = choose(touches, -normal, zero);
}
