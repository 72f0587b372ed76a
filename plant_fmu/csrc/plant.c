#include "plant.h"

#include <math.h>
#include <string.h>

#include "linear.h"

static const double MOST_DAMPED = 2.5; /* h times rate: beyond 2.785 the method grows what it should damp */
static const double MOST_TURNED = 1.0; /* rad in h: beyond 2.83 it grows what should swing, and is far off before */
static const double MOST_MOBILE = 1e12; /* 1/kg, 1/(kg m), 1/(kg m2): of the inverse of the mass matrix */

/* ---- attitude ---------------------------------------------------------------------------------------------- */

void plant_rotation(const double e[4], double R[3][3])
{
    const double square = e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3];
    const double s = square > LEAST_QUATERNION * LEAST_QUATERNION ? 2.0 / square : 0.0;

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

int plant_normalise(double rigid[N_RIGID])
{
    double *e = rigid + 3;
    const double norm = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]);

    if (!(norm > LEAST_QUATERNION && norm < 1.0 / LEAST_QUATERNION))
        return 0;
    for (int i = 0; i < 4; i++)
        e[i] /= norm;
    return 1;
}

void plant_euler(const double e[4], double euler[3])
{
    double R[3][3];

    plant_rotation(e, R);
    const double cosine = hypot(R[2][1], R[2][2]);
    const int upright = cosine > UPRIGHT; /* else roll and yaw are one, and all is called yaw */

    euler[0] = upright ? atan2(R[2][1], R[2][2]) : 0.0;
    euler[1] = atan2(-R[2][0], cosine);
    euler[2] = upright ? atan2(R[1][0], R[0][0]) : atan2(-R[0][1], R[1][1]);
}

/* ---- parameters -------------------------------------------------------------------------------------------- */

/* Lower Cholesky factor in place. Returns 0 if A is not positive definite. */
static int cholesky(double A[6][6])
{
    for (int j = 0; j < 6; j++) {
        for (int k = 0; k < j; k++)
            A[j][j] -= A[j][k] * A[j][k];
        if (!(A[j][j] > 0.0))
            return 0;
        A[j][j] = sqrt(A[j][j]);
        for (int i = j + 1; i < 6; i++) {
            for (int k = 0; k < j; k++)
                A[i][j] -= A[i][k] * A[j][k];
            A[i][j] /= A[j][j];
        }
    }
    return 1;
}

/* Solves L L^T x = b in place. */
static void solve(const double L[6][6], double b[6])
{
    for (int i = 0; i < 6; i++) {
        for (int k = 0; k < i; k++)
            b[i] -= L[i][k] * b[k];
        b[i] /= L[i][i];
    }
    for (int i = 5; i >= 0; i--) {
        for (int k = i + 1; k < 6; k++)
            b[i] -= L[k][i] * b[k];
        b[i] /= L[i][i];
    }
}

/* M_RB = [m I, -m S(r_G); m S(r_G), I_b] (Fossen 2011, 3.44) */
static void rigid_mass_matrix(const Parameters *p, double M[6][6])
{
    const double m = p->mass, *r = p->r_G, *I = p->inertia;
    const double rows[6][6] = {
        {m, 0.0, 0.0, 0.0, m * r[2], -m * r[1]},
        {0.0, m, 0.0, -m * r[2], 0.0, m * r[0]},
        {0.0, 0.0, m, m * r[1], -m * r[0], 0.0},
        {0.0, -m * r[2], m * r[1], I[0], I[3], I[4]},
        {m * r[2], 0.0, -m * r[0], I[3], I[1], I[5]},
        {-m * r[1], m * r[0], 0.0, I[4], I[5], I[2]},
    };
    memcpy(M, rows, sizeof rows);
}

void plant_mass_matrix(const Parameters *p, double M[6][6])
{
    double rigid[6][6];

    rigid_mass_matrix(p, rigid);
    symmetric6(p->added_mass, M);
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++)
            M[i][j] += rigid[i][j];
}

/* Greatest sum of the magnitudes in a row of a block of the inverse mass matrix: no eigenvalue of the block is above. */
static double mobility(const Derived *d, int first, int last, int *row)
{
    double greatest = 0.0;

    for (int i = first; i <= last; i++) {
        double sum = 0.0;
        for (int j = first; j <= last; j++)
            sum += fabs(d->mass_inverse[i][j]);
        if (sum > greatest) {
            greatest = sum;
            *row = i;
        }
    }
    return greatest;
}

const char *plant_prepare(Plant *plant)
{
    Parameters *p = &plant->parameters;
    Derived *d = &plant->derived;
    double L[6][6];

    rigid_mass_matrix(p, L);
    if (!cholesky(L))
        return "rigid-body mass matrix is not positive definite (mass, inertia, r_G)";
    plant_mass_matrix(p, L);
    if (!cholesky(L))
        return "mass matrix with added mass is not positive definite (Property 1)";

    for (int i = 0; i < 6; i++)
        for (int j = 0; j < i; j++)
            p->added_mass[i][j] = p->added_mass[j][i];
    for (int j = 0; j < 6; j++) {
        double column[6] = {0.0};
        column[j] = 1.0;
        solve((const double(*)[6])L, column);
        for (int i = 0; i < 6; i++) {
            if (!(fabs(column[i]) < MOST_MOBILE))
                return "mass matrix with added mass is too close to singular";
            d->mass_inverse[i][j] = column[i];
        }
    }

    int row;
    double arm[3];
    for (int i = 0; i < 3; i++)
        arm[i] = p->r_G[i] * p->weight - p->r_B[i] * p->buoyancy;
    const double floating = p->free_surface ? 0.75 * p->buoyancy / p->hull_radius : 0.0; /* N/m, at half submersion */
    const double r_B = sqrt(dot3(p->r_B, p->r_B));
    const double stiffness = sqrt(dot3(arm, arm)) + floating * (1.0 + r_B) * (1.0 + r_B);
    d->swing = sqrt(stiffness * mobility(d, 0, 5, &row));
    d->contact_mass = 1.0 / mobility(d, 0, 2, &d->stiffest);
    d->contact_time = fmax(p->bottom_time_constant, CONTACT_SUBSTEPS * p->substep);
    d->lags = p->wrench_time_constant > 0.0;
    for (int i = 0; i < N_THRUSTERS; i++)
        d->lags = d->lags || actuators_thrust_lag(p, i) > 0.0;
    return NULL;
}

/* ---- dynamics ---------------------------------------------------------------------------------------------- */

/* Subtracts C(v) v from the wrench, given the momentum a (linear) and b (angular): the Kirchhoff form, whose matrix
 * [0, -S(a); -S(a), -S(b)] is skew (Property 2). */
static void subtract_coriolis(const double a[3], const double b[3], const double v[3], const double omega[3],
                              double wrench[6])
{
    double force[3], moment_v[3], moment_omega[3];

    cross(omega, a, force);
    cross(v, a, moment_v);
    cross(omega, b, moment_omega);
    for (int i = 0; i < 3; i++) {
        wrench[i] -= force[i];
        wrench[3 + i] -= moment_v[i] + moment_omega[i];
    }
}

void plant_derivative(const Plant *plant, const Drift *drift, double time, const double rigid[N_RIGID],
                      const double tau[6], double rate[N_RIGID])
{
    const Parameters *p = &plant->parameters;
    const double *e = rigid + 3, *nu = rigid + 7, *omega = rigid + 10;
    double R[3][3], wrench[6];

    /* kinematics (10): p' = R v, e' = E(e) w / 2 */
    plant_rotation(e, R);
    to_world((const double(*)[3])R, nu, rate);
    quaternion_rate(e, omega, rate + 3);

    /* motion through the water, whose velocity v_c changes at R^T v_c' - w x R^T v_c, seen from the body */
    double water[3], water_rate[3], current[3], nu_r[6], nu_c_rate[6] = {0.0}, turning[3];
    environment_current(p, drift, time, rigid[2], water);
    for (int i = 0; i < 3; i++)
        water_rate[i] = drift->slope[i] + (rigid[2] > 0.0 ? p->current_shear[i] * rate[2] : 0.0);
    to_body((const double(*)[3])R, water, current);
    to_body((const double(*)[3])R, water_rate, nu_c_rate);
    cross(omega, current, turning);
    memcpy(nu_r, nu, sizeof nu_r);
    for (int i = 0; i < 3; i++) {
        nu_r[i] -= current[i];
        nu_c_rate[i] -= turning[i];
    }

    memcpy(wrench, tau, sizeof wrench);

    /* rigid body: momentum m (v + w x r_G), angular momentum m r_G x v + I_b w */
    const double *I = p->inertia;
    double a[3], b[3];
    cross(omega, p->r_G, a);
    cross(p->r_G, nu, b);
    for (int i = 0; i < 3; i++) {
        a[i] = p->mass * (nu[i] + a[i]);
        b[i] *= p->mass;
    }
    b[0] += I[0] * omega[0] + I[3] * omega[1] + I[4] * omega[2];
    b[1] += I[3] * omega[0] + I[1] * omega[1] + I[5] * omega[2];
    b[2] += I[4] * omega[0] + I[5] * omega[1] + I[2] * omega[2];
    subtract_coriolis(a, b, nu, omega, wrench);

    /* water that moves along: momentum M_A v_r, and the part of -M_A v_r' that is not in v' */
    double added[6], carried[6];
    multiply6(p->added_mass, nu_r, added);
    subtract_coriolis(added, added + 3, nu_r, omega, wrench);
    multiply6(p->added_mass, nu_c_rate, carried);

    for (int i = 0; i < 6; i++)
        wrench[i] += carried[i] - (p->linear_damping[i] + p->quadratic_damping[i] * fabs(nu_r[i])) * nu_r[i];

    /* restoring (12): weight at r_G and buoyancy at r_B along k = R^T e3 */
    const double k[3] = {R[2][0], R[2][1], R[2][2]};
    const double buoyancy = p->buoyancy * environment_submerged(p, rigid[2] + dot3(k, p->r_B));
    double lever[3], moment[3];
    for (int i = 0; i < 3; i++)
        lever[i] = p->r_G[i] * p->weight - p->r_B[i] * buoyancy;
    cross(lever, k, moment);
    for (int i = 0; i < 3; i++) {
        wrench[i] += (p->weight - buoyancy) * k[i];
        wrench[3 + i] += moment[i];
    }

    double contact_world[3], contact[3];
    if (environment_contact(plant, rigid[2], rate, contact_world)) {
        to_body((const double(*)[3])R, contact_world, contact);
        for (int i = 0; i < 3; i++)
            wrench[i] += contact[i];
    }

    multiply6(plant->derived.mass_inverse, wrench, rate + 7);
}

/* A bound of the fastest rate at which damping and bottom now make a velocity decay, 1/s. */
static double damping_rate(const Plant *plant, const Drift *drift, double time, const double rigid[N_RIGID])
{
    const Parameters *p = &plant->parameters;
    double R[3][3], water[3], current[3], root[6], bound = 0.0;

    plant_rotation(rigid + 3, R);
    environment_current(p, drift, time, rigid[2], water);
    to_body((const double(*)[3])R, water, current);
    for (int i = 0; i < 6; i++) {
        const double nu_r = rigid[7 + i] - (i < 3 ? current[i] : 0.0);
        root[i] = sqrt(p->linear_damping[i] + 2.0 * p->quadratic_damping[i] * fabs(nu_r));
    }
    /* eigenvalues of M^-1 D are those of D^1/2 M^-1 D^1/2, at most its greatest row sum */
    for (int i = 0; i < 6; i++) {
        double sum = 0.0;
        for (int j = 0; j < 6; j++)
            sum += fabs(plant->derived.mass_inverse[i][j]) * root[j];
        if (!(root[i] * sum <= bound)) /* also where it is no number */
            bound = root[i] * sum;
    }
    return bound + (rigid[2] + p->hull_radius > p->bottom_depth ? 2.0 / plant->derived.contact_time : 0.0);
}

int plant_follows(const Plant *plant, const Drift *drift, double time, double h, const double rigid[N_RIGID])
{
    const double *omega = rigid + 10;

    return h * damping_rate(plant, drift, time, rigid) < MOST_DAMPED &&
           h * (sqrt(dot3(omega, omega)) + plant->derived.swing) < MOST_TURNED;
}

/* ---- stepping ---------------------------------------------------------------------------------------------- */

static void advance(const double from[N_RIGID], const double rate[N_RIGID], double h, double to[N_RIGID])
{
    for (int i = 0; i < N_RIGID; i++)
        to[i] = from[i] + h * rate[i];
}

int plant_step(const Plant *plant, const Drift *drift, double time, const Actuators *target, double h, State *state)
{
    const Parameters *p = &plant->parameters;
    Actuators middle;
    double tau_start[6], tau_middle[6], tau_end[6];
    double k1[N_RIGID], k2[N_RIGID], k3[N_RIGID], k4[N_RIGID], trial[N_RIGID];

    /* lags do not depend on the body, so their stages are exact, and stable for any time constant; for one much below h
     * the step sees Simpson's mean of them, late by up to h/6 */
    actuators_after(p, &state->actuators, target, 0.0, &state->actuators);
    actuators_wrench(p, &state->actuators, tau_start);
    if (plant->derived.lags) {
        actuators_after(p, &state->actuators, target, 0.5 * h, &middle);
        actuators_after(p, &state->actuators, target, h, &state->actuators);
        actuators_wrench(p, &middle, tau_middle);
        actuators_wrench(p, &state->actuators, tau_end);
    } else {
        memcpy(tau_middle, tau_start, sizeof tau_middle);
        memcpy(tau_end, tau_start, sizeof tau_end);
    }

    plant_derivative(plant, drift, time, state->rigid, tau_start, k1);
    advance(state->rigid, k1, 0.5 * h, trial);
    plant_derivative(plant, drift, time + 0.5 * h, trial, tau_middle, k2);
    advance(state->rigid, k2, 0.5 * h, trial);
    plant_derivative(plant, drift, time + 0.5 * h, trial, tau_middle, k3);
    advance(state->rigid, k3, h, trial);
    if (!plant_follows(plant, drift, time + h, h, trial)) /* a step may end in rest by chance, but not all its stages */
        return 0;
    plant_derivative(plant, drift, time + h, trial, tau_end, k4);

    for (int i = 0; i < N_RIGID; i++)
        state->rigid[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
    return plant_normalise(state->rigid) && plant_follows(plant, drift, time + h, h, state->rigid);
}
