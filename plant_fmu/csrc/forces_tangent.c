/* Exact directional derivatives of the forces: actuators.c and environment.c, differentiated line by line. */
#include "linear.h"
#include "plant.h"

/* ---- actuators ------------------------------------------------------------------------------------------------- */

static double curve_tangent(const Parameters *p, const Parameters *dp, int i, double command, double dcommand)
{
    const double limit = command < 0.0 ? p->thrust_min[i] : p->thrust_max[i];
    const double dlimit = command < 0.0 ? dp->thrust_min[i] : dp->thrust_max[i];
    const double dead = p->thrust_dead_band[i], ddead = dp->thrust_dead_band[i];
    const double curve = p->thrust_curve[i], dcurve = dp->thrust_curve[i];

    if (command == 0.0)
        return dead == 0.0 ? dcommand * (1.0 - curve) : 0.0;
    const double fraction = command / limit, active = (fraction - dead) / (1.0 - dead);
    if (active <= 0.0)
        return 0.0;
    const double limit_dactive = (dcommand - fraction * dlimit + limit * (active - 1.0) * ddead) / (1.0 - dead);
    return dlimit * active * (1.0 - curve + curve * active) + limit_dactive * (1.0 - curve + 2.0 * curve * active) +
           limit * active * (active - 1.0) * dcurve;
}

static void target_tangent(const Parameters *p, const Parameters *dp, const Inputs *inputs, const Inputs *dinputs,
                           Actuators *d)
{
    for (int i = 0; i < N_THRUSTERS; i++) {
        double command = inputs->thrust[i], dcommand = dinputs->thrust[i];
        if (command < p->thrust_min[i]) {
            command = p->thrust_min[i];
            dcommand = dp->thrust_min[i];
        } else if (command > p->thrust_max[i]) {
            command = p->thrust_max[i];
            dcommand = dp->thrust_max[i];
        }
        d->thrust[i] = curve_tangent(p, dp, i, command, dcommand);
    }

    const double *w = inputs->wrench, *dw = dinputs->wrench;
    const double norm = sqrt(dot3(w, w)), limit = p->wrench_force_limit;
    const int saturated = norm > limit;
    const double scale = saturated ? limit / norm : 1.0;
    const double dscale = saturated ? (dp->wrench_force_limit - scale * dot3(w, dw) / norm) / norm : 0.0;
    for (int i = 0; i < 3; i++) {
        d->wrench[i] = scale * dw[i] + dscale * w[i];
        d->wrench[3 + i] = dw[3 + i];
    }
}

/* Tangent of x' = gap / T, at most the limit. */
static double lag_tangent(double gap, double dgap, double T, double dT, double limit, double dlimit)
{
    if (T == 0.0)
        return 0.0;
    if (limit > 0.0 && fabs(gap) > limit * T)
        return gap > 0.0 ? dlimit : -dlimit;
    return (dgap - gap / T * dT) / T;
}

void actuators_tangent(const Parameters *p, const Parameters *dp, const Inputs *inputs, const Inputs *dinputs,
                       const Actuators *now, const Actuators *dnow, Actuators *drate, Actuators *dforce, double dtau[6])
{
    Actuators target, dtarget;
    int thrust_saturated[N_THRUSTERS], wrench_saturated;
    double force[N_THRUSTERS];

    actuators_target(p, inputs, &target, thrust_saturated, &wrench_saturated);
    target_tangent(p, dp, inputs, dinputs, &dtarget);
    for (int i = 0; i < N_THRUSTERS; i++) {
        const double T = actuators_thrust_lag(p, i), effectiveness = p->thrust_effectiveness[i];
        const double dT = T == p->thrust_time_constant[i] ? dp->thrust_time_constant[i] : 0.0;
        const double force_now = T > 0.0 ? now->thrust[i] : target.thrust[i];
        const double dforce_now = T > 0.0 ? dnow->thrust[i] : dtarget.thrust[i];
        drate->thrust[i] = lag_tangent(target.thrust[i] - now->thrust[i], dtarget.thrust[i] - dnow->thrust[i], T, dT,
                                       p->thrust_rate_limit[i], dp->thrust_rate_limit[i]);
        force[i] = effectiveness * force_now;
        dforce->thrust[i] = dp->thrust_effectiveness[i] * force_now + effectiveness * dforce_now;
    }
    for (int i = 0; i < 6; i++) {
        const double T = actuators_wrench_lag(p);
        drate->wrench[i] = lag_tangent(target.wrench[i] - now->wrench[i], dtarget.wrench[i] - dnow->wrench[i], T,
                                       dp->wrench_time_constant, 0.0, 0.0);
        dforce->wrench[i] = T > 0.0 ? dnow->wrench[i] : dtarget.wrench[i];
        dtau[i] = dforce->wrench[i];
        for (int j = 0; j < N_THRUSTERS; j++)
            dtau[i] += dp->thruster_matrix[i][j] * force[j] + p->thruster_matrix[i][j] * dforce->thrust[j];
    }
}

/* ---- water and bottom ------------------------------------------------------------------------------------------ */

double environment_submerged_tangent(const Parameters *p, const Parameters *dp, double depth, double ddepth)
{
    const double r = p->hull_radius, dr = dp->hull_radius;

    if (!p->free_surface || depth >= r || depth <= -r)
        return 0.0;
    const double fraction = (depth + r) / (2.0 * r), dpart = (ddepth + dr - 2.0 * fraction * dr) / (2.0 * r);
    return 6.0 * fraction * (1.0 - fraction) * dpart;
}

/* The contact's mass is the inverse of a row sum of M^-1, which changes by -M^-1 dM M^-1. */
static double contact_mass_tangent(const Derived *d, const double dM[6][6])
{
    const double *row = d->mass_inverse[d->contact_mass_row];
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
    const double x = environment_penetration(p, depth), dx = ddepth + dp->hull_radius - dp->bottom_depth;
    const double u = v[2], du = dv[2], speed_u = fabs(u), dspeed_u = u < 0.0 ? -du : du;

    const double x1 = environment_softening_depth(T), dx1 = (x1 == 4.0 * T ? 4.0 : 100.0 * T) * dT, q = 1.0 + x / x1;
    const double spring = x / q / (T * T);
    const double dspring = (dx - x * (dx - x * dx1 / x1) / x1 / q) / q / (T * T) - 2.0 * spring * dT / T;

    /* normal force m (spring + 2 g / T) with g = u x / s, s = x + T |u| / 2 */
    const double s = x + 0.5 * T * speed_u, ds = dx + 0.5 * (dT * speed_u + T * dspeed_u);
    const double g = u * x / s, dg = (du * x + u * dx - g * ds) / s;
    const double push = spring + 2.0 / T * g, dpush = dspring + 2.0 / T * (dg - g * dT / T);
    const double normal = m * fmax(0.0, push), dnormal = push > 0.0 ? dm * push + m * dpush : 0.0;

    const double speed = sqrt(v[0] * v[0] + v[1] * v[1] + 1e-4), dspeed = (v[0] * dv[0] + v[1] * dv[1]) / speed;
    const double friction = p->bottom_friction * normal / speed;
    const int sliding = friction < m / T;
    const double drag = sliding ? friction : m / T;
    const double ddrag = sliding ? (dp->bottom_friction * normal + p->bottom_friction * dnormal - drag * dspeed) / speed
                                : (dm - m * dT / T) / T;
    dforce[0] = -ddrag * v[0] - drag * dv[0];
    dforce[1] = -ddrag * v[1] - drag * dv[1];
    dforce[2] = -dnormal;
}
