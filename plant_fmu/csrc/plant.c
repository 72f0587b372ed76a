#include "plant.h"

#include <math.h>
#include <string.h>

static const double LEAST_QUATERNION = 1e-6; /* length below which a quaternion has no direction */

/* ---- small linear algebra ---------------------------------------------------------------------------------- */

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static void multiply6(const double A[6][6], const double x[6], double out[6])
{
    for (int i = 0; i < 6; i++) {
        out[i] = 0.0;
        for (int j = 0; j < 6; j++)
            out[i] += A[i][j] * x[j];
    }
}

/* Rotation from body to world (3); a quaternion off unit length still gives a pure rotation, and none at all identity. */
static void rotation(const double e[4], double R[3][3])
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

/* ---- parameters -------------------------------------------------------------------------------------------- */

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

const char *plant_prepare(Plant *plant)
{
    Parameters *p = &plant->parameters;
    double L[6][6];

    for (int i = 0; i < 6; i++)
        for (int j = 0; j < i; j++)
            p->added_mass[i][j] = p->added_mass[j][i];

    rigid_mass_matrix(p, L);
    if (!cholesky(L))
        return "rigid-body mass matrix is not positive definite (mass, inertia, r_G)";

    rigid_mass_matrix(p, L);
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++)
            L[i][j] += p->added_mass[i][j];
    if (!cholesky(L))
        return "mass matrix with added mass is not positive definite (Property 1)";

    for (int j = 0; j < 6; j++) {
        double column[6] = {0.0};
        column[j] = 1.0;
        solve((const double(*)[6])L, column);
        for (int i = 0; i < 6; i++)
            plant->derived.mass_inverse[i][j] = column[i];
    }
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

void plant_derivative(const Plant *plant, const double rigid[N_RIGID], const double tau[6], double rate[N_RIGID])
{
    const Parameters *p = &plant->parameters;
    const double *e = rigid + 3, *nu = rigid + 7, *omega = rigid + 10;
    double R[3][3], wrench[6];

    /* kinematics (10): p' = R v, e' = E(e) w / 2 */
    rotation(e, R);
    for (int i = 0; i < 3; i++)
        rate[i] = R[i][0] * nu[0] + R[i][1] * nu[1] + R[i][2] * nu[2];
    rate[3] = -0.5 * (e[1] * omega[0] + e[2] * omega[1] + e[3] * omega[2]);
    rate[4] = 0.5 * (e[0] * omega[0] - e[3] * omega[1] + e[2] * omega[2]);
    rate[5] = 0.5 * (e[3] * omega[0] + e[0] * omega[1] - e[1] * omega[2]);
    rate[6] = 0.5 * (-e[2] * omega[0] + e[1] * omega[1] + e[0] * omega[2]);

    /* motion through the water; the steady current, seen from the turning body, changes at -w x (R^T v_c) */
    double current[3], nu_r[6], current_turn[6] = {0.0};
    for (int i = 0; i < 3; i++)
        current[i] = R[0][i] * p->current[0] + R[1][i] * p->current[1] + R[2][i] * p->current[2];
    memcpy(nu_r, nu, sizeof nu_r);
    for (int i = 0; i < 3; i++)
        nu_r[i] -= current[i];
    cross(omega, current, current_turn);

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

    /* water that moves along: momentum M_A v_r, and -M_A v_r' less its part in v' */
    double added[6], turn[6];
    multiply6(p->added_mass, nu_r, added);
    subtract_coriolis(added, added + 3, nu_r, omega, wrench);
    multiply6(p->added_mass, current_turn, turn);

    for (int i = 0; i < 6; i++)
        wrench[i] -= turn[i] + (p->linear_damping[i] + p->quadratic_damping[i] * fabs(nu_r[i])) * nu_r[i];

    /* restoring (12): weight at r_G and buoyancy at r_B along k = R^T e3 */
    const double k[3] = {R[2][0], R[2][1], R[2][2]};
    double lever[3], moment[3];
    for (int i = 0; i < 3; i++)
        lever[i] = p->r_G[i] * p->weight - p->r_B[i] * p->buoyancy;
    cross(lever, k, moment);
    for (int i = 0; i < 3; i++) {
        wrench[i] += (p->weight - p->buoyancy) * k[i];
        wrench[3 + i] += moment[i];
    }

    multiply6(plant->derived.mass_inverse, wrench, rate + 7);
}

double plant_damping_rate(const Plant *plant, const double rigid[N_RIGID])
{
    const Parameters *p = &plant->parameters;
    double R[3][3], root[6], bound = 0.0;

    rotation(rigid + 3, R);
    for (int i = 0; i < 6; i++) {
        double nu_r = rigid[7 + i];
        if (i < 3)
            nu_r -= R[0][i] * p->current[0] + R[1][i] * p->current[1] + R[2][i] * p->current[2];
        root[i] = sqrt(p->linear_damping[i] + 2.0 * p->quadratic_damping[i] * fabs(nu_r));
    }
    /* eigenvalues of M^-1 D are those of D^1/2 M^-1 D^1/2, at most its greatest row sum */
    for (int i = 0; i < 6; i++) {
        double sum = 0.0;
        for (int j = 0; j < 6; j++)
            sum += fabs(plant->derived.mass_inverse[i][j]) * root[j];
        bound = fmax(bound, root[i] * sum);
    }
    return bound;
}

/* ---- stepping ---------------------------------------------------------------------------------------------- */

static void advance(const double from[N_RIGID], const double rate[N_RIGID], double h, double to[N_RIGID])
{
    for (int i = 0; i < N_RIGID; i++)
        to[i] = from[i] + h * rate[i];
}

int plant_step(const Plant *plant, const Actuators *target, double h, State *state)
{
    Actuators middle, end;
    double tau_start[6], tau_middle[6], tau_end[6];
    double k1[N_RIGID], k2[N_RIGID], k3[N_RIGID], k4[N_RIGID], trial[N_RIGID];

    /* beyond h * rate = 2.785 the method grows what it should damp, and may still look well */
    if (!(h * plant_damping_rate(plant, state->rigid) < 2.5))
        return 0;

    /* the lag is linear with a held command: its stages are exact, and stable for any time constant; for one much below h
     * the step sees Simpson's mean of them, late by up to h/6 */
    plant_lag(plant, &state->actuators, target, 0.0, &state->actuators);
    plant_lag(plant, &state->actuators, target, 0.5 * h, &middle);
    plant_lag(plant, &state->actuators, target, h, &end);
    plant_wrench(plant, &state->actuators, tau_start);
    plant_wrench(plant, &middle, tau_middle);
    plant_wrench(plant, &end, tau_end);

    plant_derivative(plant, state->rigid, tau_start, k1);
    advance(state->rigid, k1, 0.5 * h, trial);
    plant_derivative(plant, trial, tau_middle, k2);
    advance(state->rigid, k2, 0.5 * h, trial);
    plant_derivative(plant, trial, tau_middle, k3);
    advance(state->rigid, k3, h, trial);
    plant_derivative(plant, trial, tau_end, k4);

    for (int i = 0; i < N_RIGID; i++)
        state->rigid[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
    state->actuators = end;
    return plant_normalise(state->rigid) && h * plant_damping_rate(plant, state->rigid) < 2.5;
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

    rotation(e, R);
    const double cosine = hypot(R[2][1], R[2][2]);
    const int upright = cosine > 1e-12; /* else roll and yaw are one, and all is called yaw */

    euler[0] = upright ? atan2(R[2][1], R[2][2]) : 0.0;
    euler[1] = atan2(-R[2][0], cosine);
    euler[2] = upright ? atan2(R[1][0], R[0][0]) : atan2(-R[0][1], R[1][1]);
}
