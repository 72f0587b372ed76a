#include "plant.h"

#include <string.h>

#include "linear.h"

static const double RK4_STABILITY_LIMIT = 2.5; /* h times rate: unstable beyond 2.785 */
static const double RK4_TURN_LIMIT = 1.0; /* rad in h: unstable beyond 2.83, inaccurate well before */

/* ---- attitude ---------------------------------------------------------------------------------------------- */

void plant_rotation(const double e[4], double R[3][3])
{
    const double square = e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3];
    const double s = square > MIN_QUATERNION_NORM * MIN_QUATERNION_NORM ? 2.0 / square : 0.0;

    R[0][0] = 1.0 - s * (e[2] * e[2] + e[3] * e[3]);
    R[0][1] = s * (e[1] * e[2] - e[0] * e[3]);
    R[0][2] = s * (e[1] * e[3] + e[0] * e[2]);
    R[1][0] = s * (e[1] * e[2] + e[0] * e[3]);
    R[1][1] = 1.0 - s * (e[1] * e[1] + e[3] * e[3]);
    R[1][2] = s * (e[2] * e[3] - e[0] * e[1]);
    R[2][0] = s * (e[1] * e[3] - e[0] * e[2]);
    R[2][1] = s * (e[2] * e[3] + e[0] * e[1]);
    R[2][2] = 1.0 - s * (e[1] * e[1] + e[2] * e[2]);
}

int plant_normalize(double rigid[N_RIGID])
{
    double *e = rigid + 3;
    const double norm = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]);
    const int has_direction = norm > MIN_QUATERNION_NORM && norm < 1.0 / MIN_QUATERNION_NORM;
    const double divisor = has_direction ? norm : 1.0;

    for (int i = 0; i < 4; i++)
        e[i] /= divisor;
    return has_direction;
}

/* ---- dynamics ---------------------------------------------------------------------------------------------- */

/* Adds the effects of water that moves at v_c, which in body axes changes at R^T v_c' - w x R^T v_c. Writes the relative
 * velocity v_r and the momentum M_RB v + M_A v_r; adds to the wrench the part of -M_A v_r' that is not in v', and the
 * difference of v_r x M_A v_r from v x M_A v_r. */
static void add_current_effects(const Plant *plant, const Drift *drift, double time, const double rigid[N_RIGID],
                         const double R[3][3], const double velocity_world[3], double nu_r[6], double momentum[6], double wrench[6])
{
    const Parameters *p = &plant->parameters;
    const double(*added_mass)[6] = plant->derived.added_mass;
    double water[3], water_rate[3], nu_c[6], nu_c_rate[6], turning[3], added[6], current_momentum[6], moment[3];

    environment_current(p, drift, time, rigid[2], water);
    for (int i = 0; i < 3; i++)
        water_rate[i] = drift->slope[i] + (rigid[2] > 0.0 ? p->current_shear[i] * velocity_world[2] : 0.0);
    if (plant->external.active)
        for (int i = 0; i < 3; i++) {
            water[i] += plant->external.current_rate[i] * (time - plant->external.since);
            water_rate[i] += plant->external.current_rate[i];
        }
    to_body(R, water, nu_c);
    to_body(R, water_rate, nu_c_rate);
    cross(rigid + 10, nu_c, turning);
    for (int i = 0; i < 3; i++) {
        nu_r[i] -= nu_c[i];
        nu_c_rate[i] -= turning[i];
        nu_c[3 + i] = nu_c_rate[3 + i] = 0.0;
    }
    multiply6(added_mass, nu_c, current_momentum);
    multiply6(added_mass, nu_r, added);
    cross(nu_c, added, moment);
    for (int i = 0; i < 3; i++)
        wrench[3 + i] += moment[i];
    multiply6(added_mass, nu_c_rate, added);
    for (int i = 0; i < 6; i++) {
        momentum[i] -= current_momentum[i];
        wrench[i] += added[i];
    }
}

/* Adds the external wrench of other components. */
static void add_external(const External *external, const double R[3][3], double wrench[6])
{
    double force[3], moment[3], lever[3];

    to_body(R, external->force, force);
    to_body(R, external->moment, moment);
    cross(external->point, force, lever);
    for (int i = 0; i < 3; i++) {
        wrench[i] += force[i] + external->wrench[i];
        wrench[3 + i] += moment[i] + lever[i] + external->wrench[3 + i];
    }
}

void plant_derivative(const Plant *plant, const Drift *drift, double time, const double rigid[N_RIGID],
                      const double tau[6], double rate[N_RIGID])
{
    const Parameters *p = &plant->parameters;
    const double *e = rigid + 3, *nu = rigid + 7, *omega = rigid + 10;
    double R[3][3], nu_r[6], momentum[6], wrench[6];

    /* kinematics (10): p' = R v, e' = E(e) w / 2 */
    plant_rotation(e, R);
    to_world((const double(*)[3])R, nu, rate);
    quaternion_rate(e, omega, rate + 3);

    memcpy(nu_r, nu, sizeof nu_r);
    for (int i = 0; i < 6; i++)
        wrench[i] = tau[i] + p->trim[i];
    multiply6(plant->derived.mass_matrix, nu, momentum);
    if (plant->derived.has_current)
        add_current_effects(plant, drift, time, rigid, (const double(*)[3])R, rate, nu_r, momentum, wrench);

    /* C(v) v of body and added mass in Kirchhoff form: its matrix [0, -S(a); -S(a), -S(b)], with linear momentum a and
     * angular momentum b, is skew (Property 2), so it does no work */
    double force[3], moment_v[3], moment_omega[3];
    cross(omega, momentum, force);
    cross(nu, momentum, moment_v);
    cross(omega, momentum + 3, moment_omega);

    /* restoring (12): weight at r_G and buoyancy at r_B along k = R^T e3 */
    const double *k = R[2];
    double buoyancy = p->buoyancy, lever[3], moment[3];
    if (p->free_surface)
        buoyancy *= environment_submerged(p, rigid[2] + dot3(k, p->r_B));
    for (int i = 0; i < 3; i++)
        lever[i] = p->r_G[i] * p->weight - p->r_B[i] * buoyancy;
    cross(lever, k, moment);

    for (int i = 0; i < 3; i++) {
        wrench[i] += (p->weight - buoyancy) * k[i] - force[i];
        wrench[3 + i] += moment[i] - (moment_v[i] + moment_omega[i]);
    }
    for (int i = 0; i < 6; i++)
        wrench[i] -= (p->linear_damping[i] + p->quadratic_damping[i] * fabs(nu_r[i])) * nu_r[i];

    const double penetration = environment_penetration(p, rigid[2]);
    if (penetration > 0.0) {
        double contact_world[3], contact[3];
        environment_contact(plant, penetration, rate, contact_world);
        to_body((const double(*)[3])R, contact_world, contact);
        for (int i = 0; i < 3; i++)
            wrench[i] += contact[i];
    }

    if (plant->external.active)
        add_external(&plant->external, (const double(*)[3])R, wrench);

    multiply6(plant->derived.mass_inverse, wrench, rate + 7);
}

/* ---- stability of steps ------------------------------------------------------------------------------------- */

/* Returns an upper bound [1/s] of the present decay rates of the velocities by damping and bottom. */
static double damping_rate(const Plant *plant, const Drift *drift, double time, const double rigid[N_RIGID])
{
    const Parameters *p = &plant->parameters;
    double R[3][3], water[3], current[3], root[6], bound = 0.0;

    plant_rotation(rigid + 3, R);
    environment_current(p, drift, time, rigid[2], water);
    to_body((const double(*)[3])R, water, current);
    for (int i = 0; i < 6; i++) {
        const double nu_r = i < 3 ? rigid[7 + i] - current[i] : rigid[7 + i];
        root[i] = sqrt(p->linear_damping[i] + 2.0 * p->quadratic_damping[i] * fabs(nu_r));
    }
    /* eigenvalues of M^-1 D are those of D^1/2 M^-1 D^1/2, at most its maximum row sum */
    for (int i = 0; i < 6; i++) {
        double sum = 0.0;
        for (int j = 0; j < 6; j++)
            sum += fabs(plant->derived.mass_inverse[i][j]) * root[j];
        bound = root[i] * sum <= bound ? bound : root[i] * sum; /* NaN propagates */
    }
    return bound + (environment_penetration(p, rigid[2]) > 0.0 ? 2.0 / plant->derived.contact_time : 0.0);
}

/* Returns true if steps of h are well within the limit of damping_rate, by a cheaper bound: the trace of D^1/2 M^-1 D^1/2.
 * No row sum of a positive matrix of six rows exceeds its trace by more than a factor (1 + sqrt 6) / 2. */
static int is_clearly_stable(const Plant *plant, const Drift *drift, double time, double h, const double rigid[N_RIGID])
{
    const Parameters *p = &plant->parameters;
    double water[3], current = 0.0, trace = 0.0;

    if (plant->derived.has_current) {
        environment_current(p, drift, time, rigid[2], water);
        current = fabs(water[0]) + fabs(water[1]) + fabs(water[2]);
    }
    for (int i = 0; i < 6; i++) {
        const double speed = i < 3 ? fabs(rigid[7 + i]) + current : fabs(rigid[7 + i]);
        trace += plant->derived.mass_inverse[i][i] * (p->linear_damping[i] + 2.0 * p->quadratic_damping[i] * speed);
    }
    return 1.75 * h * trace < RK4_STABILITY_LIMIT && environment_penetration(p, rigid[2]) <= 0.0;
}

/* Returns true if steps of h are stable for the present damping, oscillation and rotation. */
static int is_stable(const Plant *plant, const Drift *drift, double time, double h, const double rigid[N_RIGID])
{
    const double *omega = rigid + 10;

    if (!(h * (sqrt(dot3(omega, omega)) + plant->derived.max_oscillation) < RK4_TURN_LIMIT))
        return 0;
    return is_clearly_stable(plant, drift, time, h, rigid) ||
           h * damping_rate(plant, drift, time, rigid) < RK4_STABILITY_LIMIT;
}

/* ---- stepping ---------------------------------------------------------------------------------------------- */

static void add_scaled(const double from[N_RIGID], const double rate[N_RIGID], double h, double to[N_RIGID])
{
    for (int i = 0; i < N_RIGID; i++)
        to[i] = from[i] + h * rate[i];
}

/* Makes one fourth-order Runge-Kutta step. Checks stability at its end; the caller has checked its start. */
static int step(const Plant *plant, const Drift *drift, double time, const Actuators *target, double h, State *state)
{
    Actuators middle;
    double tau_start[6], tau_middle[6], tau_end[6];
    double k1[N_RIGID], k2[N_RIGID], k3[N_RIGID], k4[N_RIGID], trial[N_RIGID];

    /* lags do not depend on the body, so their stages are exact, and stable for any time constant; with one much below h
     * the step integrates Simpson's mean of the forces, late by up to h/6 */
    actuators_apply_unlagged(plant, &state->actuators, target, &state->actuators);
    actuators_wrench(plant, &state->actuators, tau_start);
    if (plant->derived.has_lag) {
        actuators_advance(plant, &state->actuators, target, 0.5 * h, &middle);
        actuators_advance(plant, &state->actuators, target, h, &state->actuators);
        actuators_wrench(plant, &middle, tau_middle);
        actuators_wrench(plant, &state->actuators, tau_end);
    } else {
        memcpy(tau_middle, tau_start, sizeof tau_middle);
        memcpy(tau_end, tau_start, sizeof tau_end);
    }

    plant_derivative(plant, drift, time, state->rigid, tau_start, k1);
    add_scaled(state->rigid, k1, 0.5 * h, trial);
    plant_derivative(plant, drift, time + 0.5 * h, trial, tau_middle, k2);
    add_scaled(state->rigid, k2, 0.5 * h, trial);
    plant_derivative(plant, drift, time + 0.5 * h, trial, tau_middle, k3);
    add_scaled(state->rigid, k3, h, trial);
    if (!is_stable(plant, drift, time + h, h, trial)) /* a step may end at rest by chance, but not all of its stages */
        return 0;
    plant_derivative(plant, drift, time + h, trial, tau_end, k4);

    for (int i = 0; i < N_RIGID; i++)
        state->rigid[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
    return plant_normalize(state->rigid) && is_stable(plant, drift, time + h, h, state->rigid);
}

int plant_advance(const Plant *plant, const Drift *drift, double start, double end, double substep,
                   const Actuators *target, State *state, double *h)
{
    const double rounding = 1e-9 + 1e-15 * fabs(end) / substep;
    const int n = (int)fmax(1.0, ceil((end - start) / substep - rounding));

    *h = (end - start) / n;
    int stable = is_stable(plant, drift, start, *h, state->rigid);
    for (int i = 0; i < n && stable; i++)
        stable = step(plant, drift, start + i * *h, target, *h, state);
    return stable;
}
