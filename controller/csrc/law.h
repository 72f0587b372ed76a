/* The paper's law, equations (16)-(29): the same functions as those of controller/paper_law.py. */
#ifndef LAW_H
#define LAW_H

#include "real.h"

typedef struct {
    Real k_p1;    /* N/m3, on the primary region (16) */
    Real k_p2;    /* N m, on attitude (26) */
    Real k_q;     /* (22), (26); cancels in (25) and (27) */
    Real k_v1;    /* N s/m (26) */
    Real k_v2;    /* N m s/rad (26) */
    Real sigma_p; /* 1/(m2 s), of position in the adaptation (27) */
    Real sigma_a; /* rad/s, of attitude in the adaptation (27) */
    Real gamma;   /* s2/kg, s2/(kg m2) (27) */
} Gains;

/* Computes the wrench of one control period [N, N m, body frame], then propagates the estimate over it.
 *
 * quaternion, desired: unit, scalar first, from body to world; velocity: of the body over ground [m/s, rad/s];
 * goal_value, goal_gradient: f of the primary region (13) and df/dp; values, gradients: g_i of the n secondary regions
 * (14) and dg_i/dp; alphas: gain of each region times its weight; period: control period [s];
 * estimate: phi-hat [N, N m], updated after its use. */
void law_step(const Real quaternion[4], const Real velocity[6], const Real desired[4], Real goal_value,
              const Real goal_gradient[3], int n, const Real values[], const Real gradients[][3], const Real alphas[],
              const Gains *gains, Real period, Real estimate[4], Real wrench[6]);

#endif
