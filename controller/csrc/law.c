/* See law.h. */
#include "law.h"

/* max(0, g), as in (16), (17), (20) and (22); NaN stays NaN, so that a lost measurement does not look safe. */
static Real positive_part(Real value)
{
    return choose(value <= 0.0, splat(0.0), value);
}

/* Rotation from body to world (3), row by row. */
static void rotation_matrix(const Real e[4], Real R[9])
{
    R[0] = 1.0 - 2.0 * (e[2] * e[2] + e[3] * e[3]);
    R[1] = 2.0 * (e[1] * e[2] - e[0] * e[3]);
    R[2] = 2.0 * (e[1] * e[3] + e[0] * e[2]);
    R[3] = 2.0 * (e[1] * e[2] + e[0] * e[3]);
    R[4] = 1.0 - 2.0 * (e[1] * e[1] + e[3] * e[3]);
    R[5] = 2.0 * (e[2] * e[3] - e[0] * e[1]);
    R[6] = 2.0 * (e[1] * e[3] - e[0] * e[2]);
    R[7] = 2.0 * (e[2] * e[3] + e[0] * e[1]);
    R[8] = 1.0 - 2.0 * (e[1] * e[1] + e[2] * e[2]);
}

/* Writes R^T x, a world vector in body axes. */
static void to_body(const Real R[9], const Real x[3], Real out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = R[i] * x[0] + R[3 + i] * x[1] + R[6 + i] * x[2];
}

/* The error e_s (21), (22); k_q times it is (19). */
static void secondary_error(int n, const Real values[], const Real gradients[][3], const Real alphas[], Real k_q,
                            Real e_s[3])
{
    for (int j = 0; j < 3; j++)
        e_s[j] = splat(0.0);
    for (int i = 0; i < n; i++) {
        const Real *slope = gradients[i];
        Real norm = real_sqrt(slope[0] * slope[0] + slope[1] * slope[1] + slope[2] * slope[2]);
        /* a satisfied region, and one whose gradient is zero, contributes nothing */
        Mask silent = (values[i] <= 0.0) | (norm <= 0.0);
        Real scale = alphas[i] / k_q * values[i] / choose(silent, splat(1.0), norm);
        for (int j = 0; j < 3; j++)
            e_s[j] = choose(silent, e_s[j], e_s[j] + scale * slope[j]);
    }
}

/* Vector part of the error quaternion (23), of the shortest rotation. */
static void attitude_error(const Real d[4], const Real e[4], Real out[3])
{
    Real scalar = d[0] * e[0] + d[1] * e[1] + d[2] * e[2] + d[3] * e[3];
    out[0] = d[0] * e[1] - d[1] * e[0] - d[2] * e[3] + d[3] * e[2];
    out[1] = d[0] * e[2] + d[1] * e[3] - d[2] * e[0] - d[3] * e[1];
    out[2] = d[0] * e[3] - d[1] * e[2] + d[2] * e[1] - d[3] * e[0];
    for (int i = 0; i < 3; i++)
        out[i] = choose(scalar < 0.0, -out[i], out[i]);
}

void law_step(const Real quaternion[4], const Real velocity[6], const Real desired[4], Real goal_value,
              const Real goal_gradient[3], int n, const Real values[], const Real gradients[][3], const Real alphas[],
              const Gains *gains, Real period, Real estimate[4], Real wrench[6])
{
    Real R[9], e_p[3], e_s[3], e_att[3], asked[3], pull[3], drive[6];
    rotation_matrix(quaternion, R);
    const Real *k = R + 6; /* R^T e3, the direction of gravity in body axes, for Z = [-k 0; 0 S(k)] (12) */

    /* (20) to (23) */
    for (int j = 0; j < 3; j++)
        e_p[j] = positive_part(goal_value) * goal_gradient[j];
    secondary_error(n, values, gradients, alphas, gains->k_q, e_s);
    attitude_error(desired, quaternion, e_att);

    /* (25) with (26), (29) */
    for (int j = 0; j < 3; j++)
        asked[j] = gains->k_p1 * e_p[j] + gains->k_q * e_s[j];
    to_body(R, asked, pull);
    for (int j = 0; j < 3; j++)
        wrench[j] = -k[j] * estimate[0] - (pull[j] + gains->k_v1 * velocity[j]);
    wrench[3] = k[1] * estimate[3] - k[2] * estimate[2];
    wrench[4] = k[2] * estimate[1] - k[0] * estimate[3];
    wrench[5] = k[0] * estimate[2] - k[1] * estimate[1];
    for (int j = 0; j < 3; j++)
        wrench[3 + j] = wrench[3 + j] - (gains->k_p2 * e_att[j] + gains->k_v2 * velocity[3 + j]);

    /* (27) with (28), over one period by Euler's rule */
    for (int j = 0; j < 3; j++)
        asked[j] = e_p[j] + gains->k_q / gains->k_p1 * e_s[j];
    to_body(R, asked, pull);
    for (int j = 0; j < 3; j++) {
        drive[j] = velocity[j] + gains->sigma_p * pull[j];
        drive[3 + j] = velocity[3 + j] + gains->sigma_a * e_att[j];
    }
    /* -Z^T drive: k . force part, and S(k) of the moment part */
    Real along = k[0] * drive[0] + k[1] * drive[1] + k[2] * drive[2];
    Real turn[3] = {k[1] * drive[5] - k[2] * drive[4], k[2] * drive[3] - k[0] * drive[5],
                    k[0] * drive[4] - k[1] * drive[3]};
    estimate[0] = estimate[0] + period * (along / gains->gamma);
    for (int j = 0; j < 3; j++)
        estimate[1 + j] = estimate[1 + j] + period * (turn[j] / gains->gamma);
}
