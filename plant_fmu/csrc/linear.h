/* Small linear algebra in three and six dimensions. */
#ifndef LINEAR_H
#define LINEAR_H

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

/* R^T x: a world vector seen from the body. */
static inline void to_body(const double R[3][3], const double x[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = R[0][i] * x[0] + R[1][i] * x[1] + R[2][i] * x[2];
}

/* R x: a body vector seen from the world. */
static inline void to_world(const double R[3][3], const double x[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = dot3(R[i], x);
}

/* E(e) w / 2: the rate of a quaternion that turns at w, seen from the body (10). */
static inline void quaternion_rate(const double e[4], const double w[3], double out[4])
{
    out[0] = -0.5 * (e[1] * w[0] + e[2] * w[1] + e[3] * w[2]);
    out[1] = 0.5 * (e[0] * w[0] - e[3] * w[1] + e[2] * w[2]);
    out[2] = 0.5 * (e[3] * w[0] + e[0] * w[1] - e[1] * w[2]);
    out[3] = 0.5 * (-e[2] * w[0] + e[1] * w[1] + e[0] * w[2]);
}

/* The symmetric matrix of which the upper triangle is given. */
static inline void symmetric6(const double upper[6][6], double whole[6][6])
{
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++)
            whole[i][j] = i < j ? upper[i][j] : upper[j][i];
}

static inline void multiply6(const double A[6][6], const double x[6], double out[6])
{
    for (int i = 0; i < 6; i++) {
        out[i] = 0.0;
        for (int j = 0; j < 6; j++)
            out[i] += A[i][j] * x[j];
    }
}

#endif
