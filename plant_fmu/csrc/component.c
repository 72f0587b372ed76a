/* The plant as a component behind the FMI wrappers: checks of parameters, end of initialisation, validity of steps. */
#include <math.h>
#include <string.h>

#include "instance.h"

static const double MAX_SUBSTEPS = 1e6; /* in one step */

static void rewind_clocks(Model *m)
{
    memset(&m->held, 0, sizeof m->held);
}

/* Refuses parameters that contradict each other, by name. */
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
            return instance_refuse(instance, "%s.delay = %.9g s at %.9g Hz leaves more than %d samples under way", NAMES[i],
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
    const char *fault = model_prepare(&instance->model);
    return fault ? instance_refuse(instance, "%s", fault) : STATUS_OK;
}

static Status begin(Instance *instance)
{
    Model *m = &instance->model;
    const double *e = m->state.rigid + 3;
    const double norm = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]);
    if (!plant_normalise(m->state.rigid))
        return instance_refuse(instance, "quaternion.e0 to e3 have length 0, expected a direction");
    if (fabs(norm - 1.0) > 1e-3)
        instance_log(instance, LOG_WARNINGS, "quaternion of length %.9g made a unit quaternion", norm);
    const double deep = m->state.rigid[2] + m->plant.parameters.hull_radius - m->plant.parameters.bottom_depth;
    if (deep > 0.0)
        instance_log(instance, LOG_WARNINGS, "the hull begins %.9g m deep in the bottom", deep);
    model_settle(m);
    model_tick(m);
    return STATUS_OK;
}

static void evaluate(Instance *instance)
{
    Model *m = &instance->model;
    const Flags flags = m->outputs.flags;

    if (instance_starting(instance)) /* the first samples and the first current are drawn now */
        model_tick(m);
    model_evaluate(m);
    if (instance->mode == MODE_CONTINUOUS) /* discrete variables change only at events */
        m->outputs.flags = flags;
}

static Status fits(const Instance *instance, double step)
{
    const Model *m = &instance->model;
    double substeps = step / m->plant.parameters.substep;
    for (int i = 0; i < N_CLOCKS; i++)
        if (m->held.clocks[i].period > 0.0)
            substeps += step / m->held.clocks[i].period;
    if (substeps > MAX_SUBSTEPS)
        return instance_refuse(instance, "step of %g s needs %.3g substeps (parameter substep and rates of sensors), %g at the most",
                               step, substeps, MAX_SUBSTEPS);
    return STATUS_OK;
}

static Status advance(Instance *instance, double end)
{
    Model *m = &instance->model;
    const double before = m->time;
    const State state = m->state;
    const Held held = m->held;
    double failed = 0.0;
    const Variable *stray = NULL;

    if (model_advance(m, end, &failed) && !(stray = variables_stray_state(m)))
        return STATUS_OK;

    const double value = stray ? *variable_real(m, stray) : 0.0;
    m->time = before;
    m->state = state;
    m->held = held;
    if (stray)
        return instance_refuse(instance, "step from t = %.9g s not taken: %s becomes %.9g, outside [%.9g, %.9g]", before,
                               stray->name, value, stray->min, stray->max);
    return instance_refuse(instance,
                           "step from t = %.9g s not taken: integration steps of %g s are too long for this motion, its "
                           "forces or its damping (parameter substep)",
                           before, failed);
}

/* True if every clock runs forward and every held number is valid. */
static bool possible(const Model *m)
{
    bool good = true;

    for (int i = 0; i < N_CLOCKS; i++) {
        const Clock *clock = &m->held.clocks[i];
        good = good && clock->period >= 0.0 && clock->period < 1e9 && fabs(clock->since) <= MAX_TIME &&
               clock->ticks >= 0.0 && clock->ticks < 1e15 && clock->samples >= 0.0 && clock->samples < 1e15;
    }
    for (int i = 0; i < N_MEASURED; i++)
        good = good && fabs(m->held.samples[i]) < 1e15;
    for (int i = 0; i < N_SENSORS; i++) {
        const double pending = m->held.pending[i];
        good = good && m->held.delivered[i] >= 0.0 && m->held.delivered[i] < 1e15 && fabs(m->held.sample_time[i]) <= MAX_TIME &&
               pending >= 0.0 && pending <= MAX_PENDING;
        for (int j = 0; good && j < (int)pending; j++) {
            const Pending *sample = &m->held.queue[i][j];
            good = fabs(sample->taken) <= MAX_TIME && fabs(sample->due) <= 2.0 * MAX_TIME;
            for (int k = 0; k < MAX_SENSOR_CHANNELS; k++)
                good = good && fabs(sample->values[k]) < 1e15;
        }
    }
    for (int i = 0; i < 3; i++)
        good = good && fabs(m->held.drift.value[i]) < 1e6 && fabs(m->held.drift.slope[i]) < 1e9 &&
               m->held.drift.deviation[i] >= 0.0 && m->held.drift.deviation[i] < 1e6;
    good = good && fabs(m->held.drift.since) <= MAX_TIME && fabs(m->held.drift.until) <= 2.0 * MAX_TIME;
    return good;
}

const Component COMPONENT = {
    "the plant", rewind_clocks, prepare, begin, evaluate, fits, advance, possible,
    model_settle, model_tick, model_next_tick, model_tangent,
};
