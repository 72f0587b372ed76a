/* Actuators between commands and the body: limits, thruster curves, lag, rate limits, and points of action. */
#include <string.h>

#include "elementary.h"
#include "linear.h"
#include "plant.h"

/* Returns the force of a command within the limits: 0 in the dead band, then linear to quadratic in the rest of the range,
 * up to the limit itself. */
static Real after_curve(const Parameters *p, int i, Real command)
{
    const Real dead = p->thrust_dead_band[i], curve = p->thrust_curve[i];
    const Mask straight = ((dead == 0.0) & (curve == 0.0)) | (command == 0.0);

    if (all(straight))
        return command;
    const Real limit = choose(command < 0.0, p->thrust_min[i], p->thrust_max[i]);
    const Real live = real_fmax((command / limit - dead) / (1.0 - dead), splat(0.0));
    return choose(straight, command, limit * live * (1.0 - curve + curve * live));
}

void actuators_target(const Parameters *p, const Inputs *inputs, Actuators *target, Mask thrust_cut[N_THRUSTERS],
                      Mask *wrench_cut)
{
    const Real *w = inputs->wrench;

    for (int i = 0; i < N_THRUSTERS; i++) {
        const Real limited = real_fmin(real_fmax(inputs->thrust[i], p->thrust_min[i]), p->thrust_max[i]);
        thrust_cut[i] = limited != inputs->thrust[i];
        target->thrust[i] = after_curve(p, i, limited);
    }

    const Real norm = real_sqrt(dot3(w, w));
    *wrench_cut = norm > p->wrench_force_limit;
    const Real scale = choose(*wrench_cut, p->wrench_force_limit / norm, splat(1.0));
    for (int i = 0; i < 3; i++) {
        target->wrench[i] = scale * w[i];
        target->wrench[3 + i] = w[3 + i];
    }
}

/* ---- lag and rate limit ------------------------------------------------------------------------------------ */

/* Lags below a nanosecond count as 0: their rates would overflow. */
static Real lag(Real time_constant)
{
    return choose(time_constant > 1e-9, time_constant, splat(0.0));
}

Real actuators_thrust_lag(const Parameters *p, int i)
{
    const Real T = lag(p->thrust_time_constant[i]);

    return choose(p->thrust_rate_limit[i] > 0.0, real_fmax(T, splat(LEAST_RATE_LAG)), T);
}

Real actuators_wrench_lag(const Parameters *p)
{
    return lag(p->wrench_time_constant);
}

void actuators_settle(const Plant *plant, const Actuators *start, const Actuators *target, Actuators *out)
{
    const Derived *d = &plant->derived;

    for (int i = 0; i < N_THRUSTERS; i++)
        out->thrust[i] = choose(d->thrust_lag[i] > 0.0, start->thrust[i], target->thrust[i]);
    for (int i = 0; i < 6; i++)
        out->wrench[i] = choose(d->wrench_lag > 0.0, start->wrench[i], target->wrench[i]);
}

/* exp(-dt / T) - 1, cached for the next actuator with the same lag. */
typedef struct {
    Real dt, T, value;
} Fade;

static Real fade(Fade *last, Real dt, Real T)
{
    if (any((dt != last->dt) | (T != last->T))) {
        last->dt = dt;
        last->T = T;
        last->value = real_expm1(-dt / T);
    }
    return last->value;
}

/* Solution of x' = (to - x) / T, |x'| at most `limit`: a ramp while the gap is wide, then an exponential. */
static Real lagged(Real from, Real to, Real dt, Real T, Real limit, Fade *last)
{
    const Real gap = to - from;
    const Mask ramps = (limit > 0.0) & (real_fabs(gap) > limit * T);

    if (!any(ramps))
        return choose(T > 0.0, from - gap * fade(last, dt, T), to);
    const Real ramp = choose(ramps, real_fabs(gap) / limit - T, splat(0.0)); /* time during which the rate limit acts */
    const Mask outlasts = ramps & (dt <= ramp);
    const Real on_ramp = from + real_copysign(limit * dt, gap);
    if (all(outlasts))
        return on_ramp;
    const Real start = choose(ramps, to - real_copysign(limit * T, gap), from);
    const Real after = choose(T > 0.0, start - (to - start) * fade(last, dt - ramp, T), to);
    return choose(outlasts, on_ramp, after);
}

void actuators_after(const Plant *plant, const Actuators *start, const Actuators *target, double dt, Actuators *out)
{
    const Derived *d = &plant->derived;
    const Real none = splat(0.0);
    Fade last = {none, splat(1.0), none};

    for (int i = 0; i < N_THRUSTERS; i++)
        out->thrust[i] = lagged(start->thrust[i], target->thrust[i], splat(dt), d->thrust_lag[i],
                                plant->parameters.thrust_rate_limit[i], &last);
    for (int i = 0; i < 6; i++)
        out->wrench[i] = lagged(start->wrench[i], target->wrench[i], splat(dt), d->wrench_lag, none, &last);
}

void actuators_rate(const Plant *plant, const Actuators *now, const Actuators *target, Actuators *rate)
{
    const Real none = splat(0.0), T_wrench = plant->derived.wrench_lag;

    for (int i = 0; i < N_THRUSTERS; i++) {
        const Real limit = plant->parameters.thrust_rate_limit[i], T = plant->derived.thrust_lag[i];
        const Real free = choose(T > 0.0, (target->thrust[i] - now->thrust[i]) / T, none);
        rate->thrust[i] = choose(limit > 0.0, real_fmin(real_fmax(free, -limit), limit), free);
    }
    for (int i = 0; i < 6; i++)
        rate->wrench[i] = choose(T_wrench > 0.0, (target->wrench[i] - now->wrench[i]) / T_wrench, none);
}

/* ---- where forces act -------------------------------------------------------------------------------------- */

void actuators_wrench(const Parameters *p, const Actuators *now, Real tau[6])
{
    memcpy(tau, now->wrench, sizeof now->wrench);
    for (int j = 0; j < N_THRUSTERS; j++) {
        const Real force = p->thrust_effectiveness[j] * now->thrust[j];
        if (any(force != 0.0)) /* saves the time where a direct wrench is used */
            for (int i = 0; i < 6; i++)
                tau[i] += p->thruster_matrix[i][j] * force;
    }
}
