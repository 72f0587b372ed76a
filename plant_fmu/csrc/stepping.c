/* How time goes on: steps of co-simulation, or an importer's own integrator in model exchange. */
#include <math.h>
#include <string.h>

#include "instance.h"

static const double MAX_SUBSTEPS = 1e6; /* in one step */

/* ---- co-simulation ----------------------------------------------------------------------------------------- */

/* Whether a step from `time` fits the experiment. Masters add up their time: they are allowed their rounding. */
static Status check_step(const Instance *instance, double time, double step)
{
    const Model *m = &instance->model;
    const double rounding = 1e-3 * step + 1e-14 * fabs(m->time);

    if (!isfinite(step) || step <= 0.0 || m->time + step == m->time)
        return instance_refuse(instance, "step size is %g s, expected a positive number", step);
    if (!(fabs(time - m->time) <= rounding))
        return instance_refuse(instance, "step from t = %.12g s, but the plant is at %.12g s", time, m->time);
    if (!(time + step > m->time))
        return instance_refuse(instance, "step of %g s from t = %.12g s does not advance", step, time);
    if (time + step > m->stop_time + rounding)
        return instance_refuse(instance, "step to t = %.12g s is beyond the stop time of %.12g s", time + step,
                               m->stop_time);

    if (time + step > MAX_TIME)
        return instance_refuse(instance, "step to t = %.12g s is beyond %g s", time + step, MAX_TIME);

    double substeps = step / m->plant.parameters.substep;
    for (int i = 0; i < N_CLOCKS; i++)
        if (m->held.clocks[i].period > 0.0)
            substeps += step / m->held.clocks[i].period;
    if (substeps > MAX_SUBSTEPS)
        return instance_refuse(instance, "step of %g s needs %.3g substeps (parameter substep and rates of sensors), %g at the most",
                               step, substeps, MAX_SUBSTEPS);
    return STATUS_OK;
}

Status instance_step(Instance *instance, double time, double step)
{
    Model *m = &instance->model;

    if (instance_require(instance, MODE_STEPPING, "stepping") != STATUS_OK || instance_prepare(instance) != STATUS_OK ||
        check_step(instance, time, step) != STATUS_OK)
        return STATUS_ERROR;

    const double before = m->time;
    const State state = m->state;
    const Held held = m->held;
    double failed = 0.0;
    const Variable *stray = NULL;

    instance->outdated = true;
    if (model_advance(m, time + step, &failed) && !(stray = variables_stray_state(m)))
        return STATUS_OK;

    const double value = stray ? *variable_real(m, stray) : 0.0;
    m->time = before;
    m->state = state;
    m->held = held;
    if (stray)
        return instance_refuse(instance, "step from t = %.9g s not taken: %s becomes %.9g, outside [%.9g, %.9g]", time,
                               stray->name, value, stray->min, stray->max);
    return instance_refuse(instance,
                           "step from t = %.9g s not taken: integration steps of %g s are too long for this motion, its "
                           "forces or its damping (parameter substep)",
                           time, failed);
}

/* ---- model exchange ---------------------------------------------------------------------------------------- */

static Status require_count(const Instance *instance, size_t n, const char *action)
{
    if (n == N_STATES)
        return STATUS_OK;
    return instance_refuse(instance, "%s: %zu values, expected %d", action, n, (int)N_STATES);
}

Status instance_enter_event_mode(Instance *instance, unsigned from)
{
    if (instance_require(instance, from, "entering event mode") != STATUS_OK ||
        instance_prepare(instance) != STATUS_OK)
        return STATUS_ERROR;
    model_settle(&instance->model);
    instance->mode = MODE_EVENT;
    instance->outdated = true;
    return STATUS_OK;
}

Status instance_enter_continuous_mode(Instance *instance)
{
    if (instance_require(instance, MODE_EVENT, "entering continuous-time mode") != STATUS_OK ||
        instance_update(instance) != STATUS_OK) /* sets the discrete outputs for the time that comes */
        return STATUS_ERROR;
    instance->mode = MODE_CONTINUOUS;
    return STATUS_OK;
}

Status instance_update_discrete(Instance *instance, bool *states_changed, double *next_event_time)
{
    Model *m = &instance->model;

    if (instance_require(instance, MODE_EVENT, "updating discrete states") != STATUS_OK ||
        instance_prepare(instance) != STATUS_OK)
        return STATUS_ERROR;
    *states_changed = model_settle(m) != 0;
    if (model_tick(m))
        instance_tell(instance, LOG_EVENTS, "sampled at t = %.9g s", m->time);
    *next_event_time = model_next_tick(m);
    instance->outdated = true;
    return STATUS_OK;
}

Status instance_set_time(Instance *instance, double time)
{
    if (instance_require(instance, MODE_EVENT | MODE_CONTINUOUS, "setting the time") != STATUS_OK)
        return STATUS_ERROR;
    if (!(fabs(time) <= MAX_TIME))
        return instance_refuse(instance, "time is %g s, expected a number within %g", time, MAX_TIME);
    instance->model.time = time;
    instance->outdated = true;
    return STATUS_OK;
}

Status instance_set_states(Instance *instance, const double states[], size_t n)
{
    Model *m = &instance->model;
    const State before = m->state;

    if (instance_require(instance, MODE_CONTINUOUS, "setting continuous states") != STATUS_OK ||
        require_count(instance, n, "setting continuous states") != STATUS_OK)
        return STATUS_ERROR;
    memcpy(&m->state, states, sizeof m->state);
    const Variable *stray = variables_stray_state(m);
    if (stray) { /* an integrator may try again with a shorter step */
        const double value = *variable_real(m, stray);
        m->state = before;
        return instance_tell(instance, LOG_DISCARDS, "%s = %.9g discarded: outside [%.9g, %.9g]", stray->name, value,
                             stray->min, stray->max);
    }
    instance->outdated = true;
    return STATUS_OK;
}

Status instance_get_states(Instance *instance, double states[], size_t n)
{
    if (require_count(instance, n, "getting continuous states") != STATUS_OK)
        return STATUS_ERROR;
    memcpy(states, &instance->model.state, sizeof(State));
    return STATUS_OK;
}

Status instance_get_derivatives(Instance *instance, double derivatives[], size_t n)
{
    if (instance_require(instance, MODE_INITIALISING | MODE_EVENT | MODE_CONTINUOUS | MODE_TERMINATED,
                         "getting derivatives") != STATUS_OK ||
        require_count(instance, n, "getting derivatives") != STATUS_OK || instance_update(instance) != STATUS_OK)
        return STATUS_ERROR;
    memcpy(derivatives, &instance->model.outputs.rate, sizeof(State));
    return STATUS_OK;
}

Status instance_get_nominals(Instance *instance, double nominals[], size_t n)
{
    if (require_count(instance, n, "getting nominals") != STATUS_OK)
        return STATUS_ERROR;
    for (size_t i = 0; i < n; i++)
        nominals[i] = VARIABLES[FIRST_STATE + i].nominal;
    return STATUS_OK;
}
