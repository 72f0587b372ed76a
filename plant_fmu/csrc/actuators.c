/* From commands to the body wrench: limits, thruster curves, lags, rate limits, thruster positions. */
#include <string.h>

#include "elementary.h"
#include "linear.h"
#include "plant.h"

/* Returns the force of a command within the limits: 0 in the dead band, then linear to quadratic in the rest of the range,
 * up to the limit itself. */
static double apply_curve(const Parameters *p, int i, double command)
{
    const double dead = p->thrust_dead_band[i], curve = p->thrust_curve[i];

    if ((dead == 0.0 && curve == 0.0) || command == 0.0)
        return command;
    const double limit = command < 0.0 ? p->thrust_min[i] : p->thrust_max[i];
    const double active = max2((command / limit - dead) / (1.0 - dead), 0.0);
    return limit * active * (1.0 - curve + curve * active);
}

void actuators_target(const Parameters *p, const Inputs *inputs, Actuators *target, int thrust_saturated[N_THRUSTERS],
                      int *wrench_saturated)
{
    const double *w = inputs->wrench;

    for (int i = 0; i < N_THRUSTERS; i++) {
        const double limited = min2(max2(inputs->thrust[i], p->thrust_min[i]), p->thrust_max[i]);
        thrust_saturated[i] = limited != inputs->thrust[i];
        target->thrust[i] = apply_curve(p, i, limited);
    }

    const double norm = sqrt(dot3(w, w));
    *wrench_saturated = norm > p->wrench_force_limit;
    const double scale = *wrench_saturated ? p->wrench_force_limit / norm : 1.0;
    for (int i = 0; i < 3; i++) {
        target->wrench[i] = scale * w[i];
        target->wrench[3 + i] = w[3 + i];
    }
}

/* ---- lag and rate limit ------------------------------------------------------------------------------------ */

/* Lags below a nanosecond count as 0: their rates would overflow. */
static double lag(double time_constant)
{
    return time_constant > 1e-9 ? time_constant : 0.0;
}

double actuators_thrust_lag(const Parameters *p, int i)
{
    const double T = lag(p->thrust_time_constant[i]);

    return p->thrust_rate_limit[i] > 0.0 ? max2(T, MIN_RATE_LAG) : T;
}

double actuators_wrench_lag(const Parameters *p)
{
    return lag(p->wrench_time_constant);
}

void actuators_apply_unlagged(const Plant *plant, const Actuators *start, const Actuators *target, Actuators *out)
{
    const Derived *d = &plant->derived;

    for (int i = 0; i < N_THRUSTERS; i++)
        out->thrust[i] = d->thrust_lag[i] > 0.0 ? start->thrust[i] : target->thrust[i];
    for (int i = 0; i < 6; i++)
        out->wrench[i] = d->wrench_lag > 0.0 ? start->wrench[i] : target->wrench[i];
}

/* exp(-dt / T) - 1, cached for the next actuator with the same lag. */
typedef struct {
    double dt, T, value;
} Decay;

static double decay(Decay *last, double dt, double T)
{
    if (dt != last->dt || T != last->T) {
        last->dt = dt;
        last->T = T;
        last->value = elementary_expm1(-dt / T);
    }
    return last->value;
}

/* Solution of x' = (to - x) / T, |x'| at most `limit`: a ramp while the gap is wide, then an exponential. */
static double advance_lag(double from, double to, double dt, double T, double limit, Decay *last)
{
    const double gap = to - from;

    if (!(limit > 0.0 && fabs(gap) > limit * T))
        return T > 0.0 ? from - gap * decay(last, dt, T) : to;
    const double ramp = fabs(gap) / limit - T; /* time during which the rate limit acts */
    if (dt <= ramp)
        return from + copysign(limit * dt, gap);
    const double start = to - copysign(limit * T, gap);
    return T > 0.0 ? start - (to - start) * decay(last, dt - ramp, T) : to;
}

void actuators_advance(const Plant *plant, const Actuators *start, const Actuators *target, double dt, Actuators *out)
{
    const Derived *d = &plant->derived;
    Decay last = {0.0, 1.0, 0.0};

    for (int i = 0; i < N_THRUSTERS; i++)
        out->thrust[i] = advance_lag(start->thrust[i], target->thrust[i], dt, d->thrust_lag[i],
                                plant->parameters.thrust_rate_limit[i], &last);
    for (int i = 0; i < 6; i++)
        out->wrench[i] = advance_lag(start->wrench[i], target->wrench[i], dt, d->wrench_lag, 0.0, &last);
}

void actuators_rate(const Plant *plant, const Actuators *now, const Actuators *target, Actuators *rate)
{
    const double T_wrench = plant->derived.wrench_lag;

    for (int i = 0; i < N_THRUSTERS; i++) {
        const double limit = plant->parameters.thrust_rate_limit[i], T = plant->derived.thrust_lag[i];
        const double free = T > 0.0 ? (target->thrust[i] - now->thrust[i]) / T : 0.0;
        rate->thrust[i] = limit > 0.0 ? min2(max2(free, -limit), limit) : free;
    }
    for (int i = 0; i < 6; i++)
        rate->wrench[i] = T_wrench > 0.0 ? (target->wrench[i] - now->wrench[i]) / T_wrench : 0.0;
}

/* ---- wrench on the body ------------------------------------------------------------------------------------ */

void actuators_wrench(const Plant *plant, const Actuators *now, double tau[6])
{
    memcpy(tau, now->wrench, sizeof now->wrench);
    for (int j = 0; j < N_THRUSTERS; j++) {
        const double force = plant->parameters.thrust_effectiveness[j] * now->thrust[j];
        if (force != 0.0) /* saves time with a direct wrench */
            for (int i = 0; i < 6; i++)
                tau[i] += plant->derived.thruster_wrench[j][i] * force;
    }
}
