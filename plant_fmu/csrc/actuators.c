/* What stands between commands and the body: limits, the thrusters' curves, lag, rate limits, and where forces act. */
#include "plant.h"

#include <math.h>

#include "linear.h"

/* The force that a command within the limits asks for: nothing in the dead band, then from linear to quadratic in the
 * rest of the range, up to the limit itself. */
static double after_curve(const Parameters *p, int i, double command)
{
    const double limit = command < 0.0 ? p->thrust_min[i] : p->thrust_max[i];
    const double dead = p->thrust_dead_band[i], curve = p->thrust_curve[i];

    if ((dead == 0.0 && curve == 0.0) || command == 0.0)
        return command;
    const double live = fmax(0.0, (command / limit - dead) / (1.0 - dead));
    return limit * live * (1.0 - curve + curve * live);
}

void actuators_target(const Parameters *p, const Inputs *inputs, Actuators *target, int thrust_cut[N_THRUSTERS],
                      int *wrench_cut)
{
    const double *w = inputs->wrench;

    for (int i = 0; i < N_THRUSTERS; i++) {
        const double limited = fmin(fmax(inputs->thrust[i], p->thrust_min[i]), p->thrust_max[i]);
        thrust_cut[i] = limited != inputs->thrust[i];
        target->thrust[i] = after_curve(p, i, limited);
    }

    const double norm = sqrt(dot3(w, w));
    *wrench_cut = norm > p->wrench_force_limit;
    const double scale = *wrench_cut ? p->wrench_force_limit / norm : 1.0;
    for (int i = 0; i < 3; i++) {
        target->wrench[i] = scale * w[i];
        target->wrench[3 + i] = w[3 + i];
    }
}

/* Shorter lags than a nanosecond are none: their rates would be beyond numbers. */
static double lag(double time_constant)
{
    return time_constant > 1e-9 ? time_constant : 0.0;
}

double actuators_thrust_lag(const Parameters *p, int i)
{
    const double T = lag(p->thrust_time_constant[i]);

    return p->thrust_rate_limit[i] > 0.0 ? fmax(T, LEAST_RATE_LAG) : T;
}

/* Solution of x' = (to - x) / T, |x'| at most `limit`: a ramp while the gap is wide, then an exponential. */
static double lagged(double from, double to, double dt, double time_constant, double limit)
{
    const double gap = to - from;

    if (limit > 0.0 && fabs(gap) > limit * time_constant) {
        const double ramp = fabs(gap) / limit - time_constant; /* time for which the limit holds */
        if (dt <= ramp)
            return from + copysign(limit * dt, gap);
        from = to - copysign(limit * time_constant, gap);
        dt -= ramp;
    }
    return time_constant > 0.0 ? from - (to - from) * expm1(-dt / time_constant) : to;
}

void actuators_after(const Parameters *p, const Actuators *start, const Actuators *target, double dt, Actuators *out)
{
    const double T_wrench = lag(p->wrench_time_constant);

    for (int i = 0; i < N_THRUSTERS; i++)
        out->thrust[i] = lagged(start->thrust[i], target->thrust[i], dt, actuators_thrust_lag(p, i),
                                p->thrust_rate_limit[i]);
    for (int i = 0; i < 6; i++)
        out->wrench[i] = lagged(start->wrench[i], target->wrench[i], dt, T_wrench, 0.0);
}

void actuators_rate(const Parameters *p, const Actuators *now, const Actuators *target, Actuators *rate)
{
    const double T_wrench = lag(p->wrench_time_constant);

    for (int i = 0; i < N_THRUSTERS; i++) {
        const double limit = p->thrust_rate_limit[i];
        const double T = actuators_thrust_lag(p, i);
        const double free = T > 0.0 ? (target->thrust[i] - now->thrust[i]) / T : 0.0;
        rate->thrust[i] = limit > 0.0 ? fmin(fmax(free, -limit), limit) : free;
    }
    for (int i = 0; i < 6; i++)
        rate->wrench[i] = T_wrench > 0.0 ? (target->wrench[i] - now->wrench[i]) / T_wrench : 0.0;
}

void actuators_wrench(const Parameters *p, const Actuators *now, double tau[6])
{
    for (int i = 0; i < 6; i++) {
        tau[i] = now->wrench[i];
        for (int j = 0; j < N_THRUSTERS; j++)
            tau[i] += p->thruster_matrix[i][j] * (p->thrust_effectiveness[j] * now->thrust[j]);
    }
}

/* ---- tangents ---------------------------------------------------------------------------------------------- */

static double curve_tangent(const Parameters *p, const Parameters *dp, int i, double command, double dcommand)
{
    const double limit = command < 0.0 ? p->thrust_min[i] : p->thrust_max[i];
    const double dlimit = command < 0.0 ? dp->thrust_min[i] : dp->thrust_max[i];
    const double dead = p->thrust_dead_band[i], ddead = dp->thrust_dead_band[i];
    const double curve = p->thrust_curve[i], dcurve = dp->thrust_curve[i];

    if (command == 0.0)
        return dead == 0.0 ? dcommand * (1.0 - curve) : 0.0;
    const double part = command / limit, live = (part - dead) / (1.0 - dead);
    if (live <= 0.0)
        return 0.0;
    const double limit_dlive = (dcommand - part * dlimit + limit * (live - 1.0) * ddead) / (1.0 - dead);
    return dlimit * live * (1.0 - curve + curve * live) + limit_dlive * (1.0 - curve + 2.0 * curve * live) +
           limit * live * (live - 1.0) * dcurve;
}

static void target_tangent(const Parameters *p, const Parameters *dp, const Inputs *inputs, const Inputs *dinputs,
                           Actuators *d)
{
    for (int i = 0; i < N_THRUSTERS; i++) {
        double command = inputs->thrust[i], dcommand = dinputs->thrust[i];
        if (command < p->thrust_min[i]) {
            command = p->thrust_min[i];
            dcommand = dp->thrust_min[i];
        } else if (command > p->thrust_max[i]) {
            command = p->thrust_max[i];
            dcommand = dp->thrust_max[i];
        }
        d->thrust[i] = curve_tangent(p, dp, i, command, dcommand);
    }

    const double *w = inputs->wrench, *dw = dinputs->wrench;
    const double norm = sqrt(dot3(w, w)), limit = p->wrench_force_limit;
    const int cut = norm > limit;
    const double scale = cut ? limit / norm : 1.0;
    const double dscale = cut ? (dp->wrench_force_limit - scale * dot3(w, dw) / norm) / norm : 0.0;
    for (int i = 0; i < 3; i++) {
        d->wrench[i] = scale * dw[i] + dscale * w[i];
        d->wrench[3 + i] = dw[3 + i];
    }
}

/* Tangent of x' = gap / T, at most the limit. */
static double lag_tangent(double gap, double dgap, double T, double dT, double limit, double dlimit)
{
    if (T == 0.0)
        return 0.0;
    if (limit > 0.0 && fabs(gap) > limit * T)
        return gap > 0.0 ? dlimit : -dlimit;
    return (dgap - gap / T * dT) / T;
}

void actuators_tangent(const Parameters *p, const Parameters *dp, const Inputs *inputs, const Inputs *dinputs,
                       const Actuators *now, const Actuators *dnow, Actuators *drate, Actuators *dforce, double dtau[6])
{
    Actuators target, dtarget;
    int thrust_cut[N_THRUSTERS], wrench_cut;
    double force[N_THRUSTERS];

    actuators_target(p, inputs, &target, thrust_cut, &wrench_cut);
    target_tangent(p, dp, inputs, dinputs, &dtarget);
    for (int i = 0; i < N_THRUSTERS; i++) {
        const double T = actuators_thrust_lag(p, i), whole = p->thrust_effectiveness[i];
        const double dT = T == p->thrust_time_constant[i] ? dp->thrust_time_constant[i] : 0.0;
        const double given = T > 0.0 ? now->thrust[i] : target.thrust[i];
        const double dgiven = T > 0.0 ? dnow->thrust[i] : dtarget.thrust[i];
        drate->thrust[i] = lag_tangent(target.thrust[i] - now->thrust[i], dtarget.thrust[i] - dnow->thrust[i], T, dT,
                                       p->thrust_rate_limit[i], dp->thrust_rate_limit[i]);
        force[i] = whole * given;
        dforce->thrust[i] = dp->thrust_effectiveness[i] * given + whole * dgiven;
    }
    for (int i = 0; i < 6; i++) {
        const double T = lag(p->wrench_time_constant);
        drate->wrench[i] = lag_tangent(target.wrench[i] - now->wrench[i], dtarget.wrench[i] - dnow->wrench[i], T,
                                       dp->wrench_time_constant, 0.0, 0.0);
        dforce->wrench[i] = T > 0.0 ? dnow->wrench[i] : dtarget.wrench[i];
        dtau[i] = dforce->wrench[i];
        for (int j = 0; j < N_THRUSTERS; j++)
            dtau[i] += dp->thruster_matrix[i][j] * force[j] + p->thruster_matrix[i][j] * dforce->thrust[j];
    }
}
