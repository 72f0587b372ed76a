/* The plant as a component behind the FMI wrappers: checks of parameters, end of initialization, validity of steps. */
#include <math.h>
#include <string.h>

#include "instance.h"

static const double MAX_SUBSTEPS = 1e6; /* in one step */

static void rewind_clocks(Model *m)
{
    memset(&m->held, 0, sizeof m->held);
}

/* Refuses contradictory parameters, by name. */
static Status check_parameters(const Instance *instance)
{
    static const struct {
        const char *noise;
        int deviation, sensor;
    } PAIRS[] = {
        {"depth_sensor.noise", DEPTH_NOISE, DEPTH_SENSOR}, {"dvl.velocity_noise", VELOCITY_NOISE, DVL},
        {"dvl.altitude_noise", ALTITUDE_NOISE, DVL},       {"imu.acceleration_noise", ACCELERATION_NOISE, IMU},
        {"imu.angular_velocity_noise", ANGULAR_VELOCITY_NOISE, IMU}, {"compass.noise", HEADING_NOISE, COMPASS},
        {"usbl.noise", POSITION_NOISE, USBL},
    };
    const Parameters *p = &instance->model.plant.parameters;

    for (int i = 0; i < N_THRUSTERS; i++)
        if (p->thrust_min[i] > p->thrust_max[i])
            return instance_refuse(instance, "thrust_min[%d] = %.9g is above thrust_max[%d] = %.9g", i + 1,
                                   p->thrust_min[i], i + 1, p->thrust_max[i]);
    for (int i = 0; i < N_NOISES; i++)
        if (p->noise[PAIRS[i].deviation] > 0.0 && !(p->sensor_rate[PAIRS[i].sensor] > 0.0))
            return instance_refuse(instance, "%s = %.9g needs the sensor's rate to be above 0, so that there are samples",
                                   PAIRS[i].noise, p->noise[PAIRS[i].deviation]);
    for (int i = 0; i < N_SENSORS; i++) {
        static const char *const NAMES[N_SENSORS] = {"depth_sensor", "dvl", "imu", "compass", "usbl"};
        if (p->delay[i] > 0.0 && !(p->sensor_rate[i] > 0.0))
            return instance_refuse(instance, "%s.delay = %.9g needs the sensor's rate to be above 0, so that there are samples",
                                   NAMES[i], p->delay[i]);
        if (p->delay[i] * p->sensor_rate[i] > MAX_PENDING)
            return instance_refuse(instance, "%s.delay = %.9g s at %.9g Hz leaves more than %d samples undelivered", NAMES[i],
                                   p->delay[i], p->sensor_rate[i], MAX_PENDING);
    }
    if (p->free_surface && !(p->hull_radius >= 1e-3))
        return instance_refuse(instance, "free_surface needs hull_radius to be 1 mm or more, so that buoyancy can fade");
    return STATUS_OK;
}

static Status prepare(Instance *instance)
{
    if (check_parameters(instance) != STATUS_OK)
        return STATUS_ERROR;
    const char *error = model_prepare(&instance->model);
    return error ? instance_refuse(instance, "%s", error) : STATUS_OK;
}

static Status begin(Instance *instance)
{
    Model *m = &instance->model;
    const double *e = m->state.rigid + 3;
    const double norm = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]);
    if (!plant_normalize(m->state.rigid))
        return instance_refuse(instance, "quaternion.e0 to e3 have length 0, expected a direction");
    if (fabs(norm - 1.0) > 1e-3)
        instance_log(instance, LOG_WARNINGS, "quaternion of length %.9g normalized", norm);
    const double penetration = m->state.rigid[2] + m->plant.parameters.hull_radius - m->plant.parameters.bottom_depth;
    if (penetration > 0.0)
        instance_log(instance, LOG_WARNINGS, "the hull starts %.9g m deep in the bottom", penetration);
    model_apply_unlagged(m);
    model_tick(m);
    return STATUS_OK;
}

static void evaluate(Instance *instance)
{
    Model *m = &instance->model;
    const Flags flags = m->outputs.flags;

    if (instance_is_starting(instance)) /* the first samples and the first current are drawn now */
        model_tick(m);
    model_evaluate(m);
    if (instance->mode == MODE_CONTINUOUS) /* discrete variables change only at events */
        m->outputs.flags = flags;
}

static Status check_step_size(const Instance *instance, double step)
{
    const Model *m = &instance->model;
    double substeps = step / m->plant.parameters.substep;
    for (int i = 0; i < N_CLOCKS; i++)
        if (m->held.clocks[i].period > 0.0)
            substeps += step / m->held.clocks[i].period;
    if (substeps > MAX_SUBSTEPS)
        return instance_refuse(instance, "step of %g s needs %.3g substeps (parameter substep and rates of sensors), expected at most %g",
                               step, substeps, MAX_SUBSTEPS);
    return STATUS_OK;
}

static Status advance(Instance *instance, double end)
{
    Model *m = &instance->model;
    const double before = m->time;
    const State state = m->state;
    const bool has_clocks = m->held.next_tick < INFINITY;
    Held held;
    double failed = 0.0;
    const Variable *invalid = NULL;

    if (has_clocks)
        held = m->held;
    if (model_advance(m, end, instance->returns_early, &failed) && !(invalid = variables_first_invalid_state(m)))
        return STATUS_OK;

    const double value = invalid ? *variable_real(m, invalid) : 0.0;
    m->time = before;
    m->state = state;
    if (has_clocks)
        m->held = held;
    if (invalid)
        return instance_refuse(instance, "step from t = %.9g s not taken: %s becomes %.9g, outside [%.9g, %.9g]", before,
                               invalid->name, value, invalid->min, invalid->max);
    return instance_refuse(instance,
                           "step from t = %.9g s not taken: integration steps of %g s are too long for this motion, its "
                           "forces or its damping (parameter substep)",
                           before, failed);
}

/* True if every clock runs forward and every held number is valid. */
static bool valid_state(const Model *m)
{
    bool valid = true;

    for (int i = 0; i < N_CLOCKS; i++) {
        const Clock *clock = &m->held.clocks[i];
        valid = valid && clock->period >= 0.0 && clock->period < 1e9 && fabs(clock->since) <= MAX_TIME &&
               clock->ticks >= 0.0 && clock->ticks < 1e15 && clock->samples >= 0.0 && clock->samples < 1e15;
    }
    for (int i = 0; i < N_MEASURED; i++)
        valid = valid && fabs(m->held.samples[i]) < 1e15;
    for (int i = 0; i < N_SENSORS; i++) {
        const double pending = m->held.pending[i];
        valid = valid && (m->held.ticked[i] == 0 || m->held.ticked[i] == 1) &&
                m->held.delivered[i] >= 0.0 && m->held.delivered[i] < 1e15 && fabs(m->held.sample_time[i]) <= MAX_TIME &&
               pending >= 0.0 && pending <= MAX_PENDING;
        for (int j = 0; valid && j < (int)pending; j++) {
            const Pending *sample = &m->held.queue[i][j];
            valid = fabs(sample->taken) <= MAX_TIME && fabs(sample->due) <= 2.0 * MAX_TIME;
            for (int k = 0; k < MAX_SENSOR_CHANNELS; k++)
                valid = valid && fabs(sample->values[k]) < 1e15;
        }
    }
    for (int i = 0; i < 3; i++)
        valid = valid && fabs(m->held.drift.value[i]) < 1e6 && fabs(m->held.drift.slope[i]) < 1e9 &&
               m->held.drift.deviation[i] >= 0.0 && m->held.drift.deviation[i] < 1e6;
    valid = valid && fabs(m->held.drift.since) <= MAX_TIME && fabs(m->held.drift.until) <= 2.0 * MAX_TIME;
    return valid;
}

const Component COMPONENT = {
    "the plant", rewind_clocks, prepare, begin, evaluate, check_step_size, advance, valid_state,
    model_apply_unlagged, model_tick, model_next_tick, model_tangent,
    {offsetof(Model, outputs.thrust), offsetof(Model, outputs.euler), model_evaluate_forces},
};
