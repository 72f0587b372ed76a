#include "model.h"

#include "coupling.h"
#include "elementary.h"
#include "random.h"

#include <math.h>
#include <string.h>

static void evaluate_core(Model *m);

/* ---- clocks ------------------------------------------------------------------------------------------------ */

static const double MAX_PERIOD = 1e8; /* s */

static double clock_period(const Parameters *p, int clock)
{
    if (clock == CURRENT_CLOCK) {
        const double *v = p->current_variation;
        return v[0] > 0.0 || v[1] > 0.0 || v[2] > 0.0 ? p->current_variation_period : 0.0;
    }
    return p->sensor_rate[clock] > 0.0 ? fmin(1.0 / p->sensor_rate[clock], MAX_PERIOD) : 0.0;
}

/* Holds the current's variation at its present value until its next knot. */
static void hold_current(Model *m)
{
    Drift *drift = &m->held.drift;

    for (int i = 0; i < 3; i++) {
        drift->value[i] += drift->slope[i] * (fmin(m->time, drift->until) - drift->since);
        drift->slope[i] = 0.0;
    }
    drift->since = m->time;
}

static double clock_next_tick(const Clock *clock)
{
    return clock->period > 0.0 ? clock->since + clock->ticks * clock->period : INFINITY;
}

static void update_next_tick(Held *held)
{
    held->next_tick = INFINITY;
    for (int i = 0; i < N_CLOCKS; i++)
        held->next_tick = fmin(held->next_tick, clock_next_tick(&held->clocks[i]));
    for (int i = 0; i < N_SENSORS; i++)
        if (held->pending[i] > 0.0)
            held->next_tick = fmin(held->next_tick, held->queue[i][0].due);
}

const char *model_prepare(Model *m)
{
    const Parameters *p = &m->plant.parameters;
    Drift *drift = &m->held.drift;
    const char *error = plant_prepare(&m->plant);

    if (error)
        return error;
    for (int i = 0; i < N_CLOCKS; i++) {
        Clock *clock = &m->held.clocks[i];
        const double period = clock_period(p, i);
        /* a changed deviation of the current starts a new knot, too */
        const int restarts = period != clock->period ||
                         (i == CURRENT_CLOCK && memcmp(drift->deviation, p->current_variation, sizeof drift->deviation));
        if (!restarts)
            continue;
        if (i == CURRENT_CLOCK)
            hold_current(m);
        clock->period = period;
        clock->since = m->time;
        clock->ticks = 0.0;
    }
    for (int i = 0; i < 3; i++)
        if (p->current_variation[i] == 0.0)
            drift->value[i] = drift->slope[i] = drift->deviation[i] = 0.0;
    update_next_tick(&m->held);
    return NULL;
}

double model_next_tick(const Model *m)
{
    return m->held.next_tick;
}

/* Draws the next knot of the current's first-order Gauss-Markov variation (exact at the knots). */
static void tick_current(Model *m, unsigned long long count)
{
    const Parameters *p = &m->plant.parameters;
    Drift *drift = &m->held.drift;
    const double period = m->held.clocks[CURRENT_CLOCK].period, ratio = period / p->current_correlation_time;
    const double correlation = 1.0 + elementary_expm1(-ratio), innovation = sqrt(-elementary_expm1(-2.0 * ratio));

    hold_current(m);
    for (int i = 0; i < 3; i++) {
        const double deviation = p->current_variation[i];
        const unsigned stream = (unsigned)(CURRENT_STREAM + i);
        if (deviation == 0.0)
            continue;
        if (drift->deviation[i] == 0.0) /* an axis's first knot: from the stationary distribution */
            drift->value[i] = deviation * random_normal(p->seed, count ? stream + 3 : stream, count);
        const double next = correlation * drift->value[i] + innovation * deviation * random_normal(p->seed, stream, count + 1);
        drift->slope[i] = (next - drift->value[i]) / period;
        drift->deviation[i] = deviation;
    }
    drift->until = m->time + period;
}

/* Delivers the oldest pending sample of a sensor. */
static void deliver_sample(Held *held, int sensor)
{
    Pending *queue = held->queue[sensor];
    int next = 0;

    for (int i = 0; i < N_MEASURED; i++)
        if (sensors_of_channel(i) == sensor)
            held->samples[i] = queue[0].values[next++];
    held->sample_time[sensor] = queue[0].taken;
    held->delivered[sensor] += 1.0;
    held->ticked[sensor] = 1;
    held->pending[sensor] -= 1.0;
    memmove(queue, queue + 1, (MAX_PENDING - 1) * sizeof *queue);
}

/* Takes the sample number `count` of a sensor, to be delivered after its delay. */
static void take_sample(Model *m, int sensor, unsigned long long count, const double ideal[N_MEASURED])
{
    Held *held = &m->held;
    double sample[N_MEASURED];
    int next = 0;

    if (!sensors_sample(&m->plant.parameters, sensor, count, ideal, sample))
        return;
    if (held->pending[sensor] >= MAX_PENDING) /* the delay was longer when these samples were taken */
        deliver_sample(held, sensor);
    Pending *last = &held->queue[sensor][(int)held->pending[sensor]];
    for (int i = 0; i < N_MEASURED; i++)
        if (sensors_of_channel(i) == sensor)
            last->values[next++] = sample[i];
    last->taken = m->time;
    last->due = m->time + m->plant.parameters.delay[sensor];
    held->pending[sensor] += 1.0;
}

static int tick_core(Model *m)
{
    int ticked = 0, measured = 0;
    double ideal[N_MEASURED];

    if (m->held.next_tick == INFINITY) /* no clock runs */
        return 0;
    for (int i = N_CLOCKS - 1; i >= 0; i--) { /* the current before the sensors, which may measure it */
        Clock *clock = &m->held.clocks[i];
        /* importers sum up their time, which may be early by rounding */
        const double due = m->time + 1e-6 * clock->period + 1e-15 * (fabs(m->time) + fabs(clock->since));

        if (!(clock_next_tick(clock) <= due))
            continue;
        const double ticks = fmax(clock->ticks, floor((due - clock->since) / clock->period)) + 1.0;
        clock->samples += ticks - clock->ticks; /* missed ticks advance the stream too */
        clock->ticks = ticks;
        ticked = 1;
        const unsigned long long count = (unsigned long long)clock->samples - 1;
        if (i == CURRENT_CLOCK)
            tick_current(m, count);
        else {
            if (!measured) {
                evaluate_core(m);
                sensors_measure(&m->plant.parameters, m->state.rigid, m->outputs.rate.rigid, m->outputs.euler[2],
                                m->outputs.altitude, ideal);
            }
            measured = 1;
            take_sample(m, i, count, ideal);
        }
    }
    for (int i = 0; i < N_SENSORS; i++)
        while (m->held.pending[i] > 0.0 && m->held.queue[i][0].due <= m->time + 1e-9 + 1e-15 * fabs(m->time)) {
            deliver_sample(&m->held, i);
            ticked = 1;
        }
    update_next_tick(&m->held);
    return ticked;
}

int model_tick(Model *m)
{
    Model coupled;

    if (m->held.next_tick == INFINITY || !COUPLED || !coupling_is_active(m))
        return tick_core(m);
    coupling_apply(m, &coupled);
    const int ticked = tick_core(&coupled);
    m->held = coupled.held;
    m->outputs = coupled.outputs;
    return ticked;
}

/* ---- evaluation -------------------------------------------------------------------------------------------- */

/* Returns true if a sensor shows a sample. */
static int has_sample(const Model *m, int sensor)
{
    return m->held.clocks[sensor].period > 0.0 && m->held.delivered[sensor] > 0.0;
}

int model_shows_sample(const Model *m, int channel)
{
    return has_sample(m, sensors_of_channel(channel));
}

/* Writes roll, pitch, yaw (zyx) of a quaternion. */
static void euler_angles(const double e[4], double euler[3])
{
    double R[3][3];

    plant_rotation(e, R);
    const double cosine = elementary_hypot(R[2][1], R[2][2]);
    const int upright = cosine > MIN_COS_PITCH; /* at gimbal lock roll is 0 and yaw takes the whole angle */

    euler[0] = upright ? elementary_atan2(R[2][1], R[2][2]) : 0.0;
    euler[1] = elementary_atan2(-R[2][0], cosine);
    euler[2] = upright ? elementary_atan2(R[1][0], R[0][0]) : elementary_atan2(-R[0][1], R[1][1]);
}

static void evaluate_forces_core(Model *m, Actuators *target)
{
    const Parameters *p = &m->plant.parameters;
    Outputs *o = &m->outputs;
    Actuators now;

    actuators_target(p, &m->inputs, target, o->flags.thrust_saturated, &o->flags.wrench_saturated);
    actuators_apply_unlagged(&m->plant, &m->state.actuators, target, &now);
    actuators_wrench(&m->plant, &now, o->wrench);
    for (int i = 0; i < N_THRUSTERS; i++)
        o->thrust[i] = p->thrust_effectiveness[i] * now.thrust[i];
}

static void evaluate_core(Model *m)
{
    const Parameters *p = &m->plant.parameters;
    Outputs *o = &m->outputs;
    Actuators target;

    evaluate_forces_core(m, &target);
    plant_derivative(&m->plant, &m->held.drift, m->time, m->state.rigid, o->wrench, o->rate.rigid);
    actuators_rate(&m->plant, &m->state.actuators, &target, &o->rate.actuators);

    euler_angles(m->state.rigid + 3, o->euler);
    environment_current(p, &m->held.drift, m->time, m->state.rigid[2], o->water);
    o->altitude = p->bottom_depth - m->state.rigid[2];
    o->flags.bottom_touched = environment_penetration(p, m->state.rigid[2]) > 0.0;

    sensors_measure(p, m->state.rigid, o->rate.rigid, o->euler[2], o->altitude, o->measured);
    for (int i = 0; i < N_MEASURED; i++)
        if (model_shows_sample(m, i))
            o->measured[i] = m->held.samples[i];
    for (int i = 0; i < N_SENSORS; i++)
        o->stamp[i] = has_sample(m, i) ? m->held.sample_time[i] : m->held.clocks[i].period > 0.0 ? NO_SAMPLE : m->time;
}

void model_evaluate(Model *m)
{
    Model coupled;

    if (!COUPLED || !coupling_is_active(m)) {
        evaluate_core(m);
        return;
    }
    coupling_apply(m, &coupled);
    evaluate_core(&coupled);
    m->outputs = coupled.outputs;
}

void model_evaluate_forces(Model *m)
{
    Actuators target;

    if (COUPLED && coupling_is_active(m))
        model_evaluate(m);
    else
        evaluate_forces_core(m, &target);
}

static int apply_unlagged_core(Model *m)
{
    const Actuators before = m->state.actuators;
    Actuators target;
    int thrust_saturated[N_THRUSTERS], wrench_saturated;

    actuators_target(&m->plant.parameters, &m->inputs, &target, thrust_saturated, &wrench_saturated);
    actuators_apply_unlagged(&m->plant, &before, &target, &m->state.actuators);
    return memcmp(&before, &m->state.actuators, sizeof before) != 0;
}

int model_apply_unlagged(Model *m)
{
    Model coupled;

    if (!COUPLED || !coupling_is_active(m))
        return apply_unlagged_core(m);
    coupling_apply(m, &coupled);
    const int changed = apply_unlagged_core(&coupled);
    m->state.actuators = coupled.state.actuators;
    return changed;
}

/* ---- stepping ---------------------------------------------------------------------------------------------- */

static int has_ticked(const Held *held)
{
    int any = 0;

    for (int i = 0; i < N_SENSORS; i++)
        any |= held->ticked[i];
    return any;
}

static int advance_core(Model *m, double end, int stops, double *failed)
{
    const double min_segment = 1e-9 * (end - m->time); /* no segment is shorter */
    int thrust_saturated[N_THRUSTERS], wrench_saturated;
    Actuators target;

    tick_core(m);
    actuators_target(&m->plant.parameters, &m->inputs, &target, thrust_saturated, &wrench_saturated);
    while (m->time < end && !(stops && has_ticked(&m->held))) {
        const double tick = m->held.next_tick, until = tick < end - min_segment ? tick : end;

        if (!plant_advance(&m->plant, &m->held.drift, m->time, until, m->plant.parameters.substep, &target, &m->state,
                           failed))
            return 0;
        m->time = until;
        tick_core(m);
    }
    return 1;
}

int model_advance(Model *m, double end, int stops, double *failed)
{
    Model coupled;

    if (!COUPLED || !coupling_is_active(m))
        return advance_core(m, end, stops, failed);
    coupling_apply(m, &coupled);
    const int done = advance_core(&coupled, end, stops, failed);
    m->state = coupled.state;
    m->held = coupled.held;
    m->time = coupled.time;
    return done;
}
