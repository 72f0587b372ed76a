/* Small linear algebra in three and six dimensions. */
#ifndef LINEAR_H
#define LINEAR_H

#include <math.h>

static inline double max2(double x, double y) { return x > y ? x : y; } /* y where either is NaN */
static inline double min2(double x, double y) { return x < y ? x : y; }

static inline double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Writes R^T x, a world vector in body axes. */
static inline void to_body(const double R[3][3], const double x[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = R[0][i] * x[0] + R[1][i] * x[1] + R[2][i] * x[2];
}

/* Writes R x, a body vector in world axes. */
static inline void to_world(const double R[3][3], const double x[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = dot3(R[i], x);
}

/* Writes E(e) w / 2, the rate of a quaternion that turns at w, body axes (10). */
static inline void quaternion_rate(const double e[4], const double w[3], double out[4])
{
    out[0] = -0.5 * (e[1] * w[0] + e[2] * w[1] + e[3] * w[2]);
    out[1] = 0.5 * (e[0] * w[0] - e[3] * w[1] + e[2] * w[2]);
    out[2] = 0.5 * (e[3] * w[0] + e[0] * w[1] - e[1] * w[2]);
    out[3] = 0.5 * (-e[2] * w[0] + e[1] * w[1] + e[0] * w[2]);
}

/* Writes the symmetric matrix of an upper triangle. */
static inline void symmetric6(const double upper[6][6], double whole[6][6])
{
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++)
            whole[i][j] = i < j ? upper[i][j] : upper[j][i];
}

/* Writes A x of a symmetric matrix, as a sum of its rows, which are contiguous in memory. */
static inline void multiply6(const double A[6][6], const double x[6], double out[6])
{
    for (int i = 0; i < 6; i++)
        out[i] = A[0][i] * x[0];
    for (int j = 1; j < 6; j++)
        for (int i = 0; i < 6; i++)
            out[i] += A[j][i] * x[j];
}

#endif
