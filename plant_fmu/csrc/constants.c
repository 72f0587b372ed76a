/* Constants derived from the parameters, and checks that the parameters describe a body. */
#include <string.h>

#include "linear.h"
#include "plant.h"

static const double MAX_MOBILITY = 1e12; /* 1/kg, 1/(kg m), 1/(kg m2): of the inverse of the mass matrix */

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

/* Returns the maximum absolute row sum of a block of the inverse mass matrix, an upper bound of its eigenvalues. */
static double mobility(const Derived *d, int first, int last, int *row)
{
    double max_sum = 0.0;

    for (int i = first; i <= last; i++) {
        double sum = 0.0;
        for (int j = first; j <= last; j++)
            sum += fabs(d->mass_inverse[i][j]);
        if (sum > max_sum) {
            max_sum = sum;
            *row = i;
        }
    }
    return max_sum;
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
            if (!(fabs(column[i]) < MAX_MOBILITY))
                return "mass matrix with added mass is too close to singular";
            d->mass_inverse[i][j] = column[i];
        }
    }

    int row;
    double lever[3];
    for (int i = 0; i < 3; i++)
        lever[i] = p->r_G[i] * p->weight - p->r_B[i] * p->buoyancy;
    const double surface_stiffness = p->free_surface ? 0.75 * p->buoyancy / p->hull_radius : 0.0; /* N/m, at half submersion */
    const double r_B = sqrt(dot3(p->r_B, p->r_B));
    const double stiffness = sqrt(dot3(lever, lever)) + surface_stiffness * (1.0 + r_B) * (1.0 + r_B);
    d->max_oscillation = sqrt(stiffness * mobility(d, 0, 5, &row));
    d->contact_mass = 1.0 / mobility(d, 0, 2, &d->contact_mass_row);
    d->contact_time = fmax(p->bottom_time_constant, CONTACT_SUBSTEPS * p->substep);
    d->wrench_lag = actuators_wrench_lag(p);
    d->has_lag = d->wrench_lag > 0.0;
    for (int i = 0; i < N_THRUSTERS; i++) {
        d->thrust_lag[i] = actuators_thrust_lag(p, i);
        d->has_lag = d->has_lag || d->thrust_lag[i] > 0.0;
        for (int j = 0; j < 6; j++)
            d->thruster_wrench[i][j] = p->thruster_matrix[j][i];
    }
    d->has_current = 0;
    for (int i = 0; i < 3; i++)
        d->has_current = d->has_current || p->current[i] != 0.0 || p->current_shear[i] != 0.0 ||
                         p->current_variation[i] != 0.0;
    return NULL;
}
