#include "elementary.h"

#include <math.h>

/* ln 2 in two parts, of which the first has 32 bits: its multiples by small integers are exact */
static const double LN2_HIGH = 0.6931471803691238, LN2_LOW = 1.9082149292705877e-10;
static const double HALF_PI = 1.5707963267948966, HALF_PI_LOW = 6.123233995736766e-17; /* the number is their sum */
static const double TURN = 6.283185307179586;

/* arctangents of the eighths, each as a double and its rounding error */
static const double ATAN[9][2] = {
    {0.0, 0.0},
    {0.12435499454676144, -3.1253241424539383e-18},
    {0.24497866312686414, 1.0698755618734451e-17},
    {0.35877067027057225, -2.4623815582638635e-17},
    {0.4636476090008061, 2.2698777452961687e-17},
    {0.5585993153435624, -5.4556305485916264e-18},
    {0.6435011087932844, 1.5834785051444286e-17},
    {0.7188299996216245, -2.1478388444456983e-17},
    {0.7853981633974483, 3.061616997868383e-17},
};

/* ln(m 2^k) = k ln 2 + 2 artanh(s), s = (m - 1) / (m + 1), with m within a factor of sqrt 2 of 1 */
double elementary_log(double x)
{
    int k;
    double m = frexp(x, &k), series = 0.0;

    if (m < 0.7071067811865476) {
        m *= 2.0;
        k--;
    }
    const double f = m - 1.0, s = f / (m + 1.0), square = s * s;
    for (int n = 25; n >= 3; n -= 2)
        series = square * (series + 2.0 / n);
    /* 2 s = f - s f, of which the first is exact */
    return k * LN2_HIGH + (f - (s * f - s * series - k * LN2_LOW));
}

/* exp(x) - 1 = 2^k (exp(r) - 1) + 2^k - 1, r = x - k ln 2 */
double elementary_expm1(double x)
{
    if (x < -60.0)
        return -1.0;
    const double k = floor(x / (LN2_HIGH + LN2_LOW) + 0.5);
    const double r = (x - k * LN2_HIGH) - k * LN2_LOW;
    double series = 0.0;

    for (int n = 14; n >= 2; n--)
        series = (series + 1.0) * r / n;
    const double scale = ldexp(1.0, (int)k);
    return scale * (r + r * series) + (scale - 1.0);
}

/* sine or cosine of the angle from the nearest quarter turn, at most an eighth of a turn */
double elementary_cos_turns(double turns)
{
    const double quarters = floor(4.0 * turns + 0.5);
    const double angle = TURN * (turns - 0.25 * quarters), square = angle * angle;
    const int odd = (int)quarters % 2, half = (int)quarters / 2 % 2;
    double series = 0.0;

    for (int n = odd ? 17 : 18; n >= 2; n -= 2)
        series = -square * (1.0 + series) / (n * (n - 1));
    const double value = odd ? -(angle + angle * series) : 1.0 + series;
    return half ? -value : value;
}

/* arctan z = arctan c + arctan t, t = (z - c) / (1 + z c), with c the nearest eighth and z at most 1 */
double elementary_atan2(double y, double x)
{
    const double a = fabs(x), b = fabs(y), large = fmax(a, b), z = large > 0.0 ? fmin(a, b) / large : 0.0;
    const int eighths = (int)(8.0 * z + 0.5);
    const double c = 0.125 * eighths, t = (z - c) / (1.0 + z * c), square = t * t;
    double series = 0.0, angle, rest;

    for (int n = 15; n >= 3; n -= 2)
        series = -square * (1.0 / n + series);
    angle = ATAN[eighths][0];
    rest = ATAN[eighths][1] + t * series + t;
    if (b > a) {
        angle = HALF_PI - angle;
        rest = HALF_PI_LOW - rest;
    }
    if (signbit(x)) {
        angle = 2.0 * HALF_PI - angle;
        rest = 2.0 * HALF_PI_LOW - rest;
    }
    return copysign(angle + rest, y);
}

double elementary_hypot(double x, double y)
{
    return sqrt(x * x + y * y);
}
