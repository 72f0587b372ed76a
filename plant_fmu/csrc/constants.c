/* Constants derived from the parameters, and checks that the parameters describe a body. */
#include <string.h>

#include "linear.h"
#include "plant.h"

static const double MOST_MOBILE = 1e12; /* 1/kg, 1/(kg m), 1/(kg m2): of the inverse of the mass matrix */

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

/* Returns the greatest absolute row sum of a block of the inverse mass matrix, an upper bound of its eigenvalues. */
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
    const Parameters *p = &plant->parameters;
    Derived *d = &plant->derived;
    double L[6][6];

    rigid_mass_matrix(p, L);
    if (!cholesky(L))
        return "rigid-body mass matrix is not positive definite (mass, inertia, r_G)";
    plant_mass_matrix(p, d->mass_matrix);
    memcpy(L, d->mass_matrix, sizeof L);
    if (!cholesky(L))
        return "mass matrix with added mass is not positive definite (Property 1)";

    symmetric6(p->added_mass, d->added_mass);
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
    d->wrench_lag = actuators_wrench_lag(p);
    d->lags = d->wrench_lag > 0.0;
    for (int i = 0; i < N_THRUSTERS; i++) {
        d->thrust_lag[i] = actuators_thrust_lag(p, i);
        d->lags = d->lags || d->thrust_lag[i] > 0.0;
    }
    d->water_moves = 0;
    for (int i = 0; i < 3; i++)
        d->water_moves = d->water_moves || p->current[i] != 0.0 || p->current_shear[i] != 0.0 ||
                         p->current_variation[i] != 0.0;
    return NULL;
}
