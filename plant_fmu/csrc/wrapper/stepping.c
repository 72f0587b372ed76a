/* Advance of time: steps of co-simulation, or an importer's own integrator in model exchange. */
#include <math.h>
#include <string.h>

#include "instance.h"

/* ---- co-simulation ----------------------------------------------------------------------------------------- */

/* Checks that a step from `time` fits the experiment, within the rounding of a master's summed time. */
static Status check_step(const Instance *instance, double time, double step)
{
    const Model *m = &instance->model;
    const double rounding = 1e-3 * step + 1e-14 * fabs(m->time);

    if (!isfinite(step) || step <= 0.0 || m->time + step == m->time)
        return instance_refuse(instance, "step size is %g s, expected a positive number", step);
    if (!(fabs(time - m->time) <= rounding))
        return instance_refuse(instance, "step from t = %.12g s, but %s is at %.12g s", time, COMPONENT.name, m->time);
    if (!(time + step > m->time))
        return instance_refuse(instance, "step of %g s from t = %.12g s does not advance", step, time);
    if (time + step > m->stop_time + rounding)
        return instance_refuse(instance, "step to t = %.12g s is beyond the stop time of %.12g s", time + step,
                               m->stop_time);

    if (time + step > MAX_TIME)
        return instance_refuse(instance, "step to t = %.12g s is beyond %g s", time + step, MAX_TIME);
    return COMPONENT.check_step_size(instance, step);
}

Status instance_step(Instance *instance, double time, double step)
{
    if (instance_require(instance, MODE_STEPPING, "stepping") != STATUS_OK || instance_prepare(instance) != STATUS_OK ||
        check_step(instance, time, step) != STATUS_OK)
        return STATUS_ERROR;
    variables_clear_clocks(&instance->model); /* of an importer that does not handle events */
    instance->outdated = true;
    return COMPONENT.advance(instance, time + step);
}

/* ---- events, and model exchange ---------------------------------------------------------------------------- */

/* Returns the address of the contiguous states, or of their derivatives. */
static double *states_address(Model *model, int first)
{
    return variable_real(model, &VARIABLES[first]);
}

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
    COMPONENT.apply_unlagged(&instance->model);
    instance->mode = MODE_EVENT;
    instance->outdated = true;
    return STATUS_OK;
}

static Status leave_event_mode(Instance *instance, Interface kind, Mode mode, const char *action)
{
    if (instance_require(instance, instance && instance->kind == kind ? MODE_EVENT : 0, action) != STATUS_OK ||
        instance_update(instance) != STATUS_OK) /* sets the discrete outputs for the next interval */
        return STATUS_ERROR;
    instance->mode = mode;
    return STATUS_OK;
}

Status instance_enter_continuous_mode(Instance *instance)
{
    return leave_event_mode(instance, MODEL_EXCHANGE, MODE_CONTINUOUS, "entering continuous-time mode");
}

Status instance_enter_step_mode(Instance *instance)
{
    return leave_event_mode(instance, CO_SIMULATION, MODE_STEPPING, "entering step mode");
}

Status instance_get_clock(Instance *instance, unsigned reference, bool *active)
{
    if (instance_check_count(instance, TYPE_CLOCK, &reference, 1, 1) != STATUS_OK)
        return STATUS_ERROR;
    *active = false;
    if (instance->mode != MODE_EVENT)
        return STATUS_OK;
    if (instance_prepare(instance) != STATUS_OK)
        return STATUS_ERROR;
    if (COMPONENT.tick(&instance->model)) /* in model exchange they tick now, or with the update */
        instance->outdated = true;
    *active = *variable_integer(&instance->model, &VARIABLES[reference]) != 0;
    return STATUS_OK;
}

Status instance_update_discrete(Instance *instance, bool *again, bool *states_changed, double *next_event_time)
{
    Model *m = &instance->model;

    if (instance_require(instance, MODE_EVENT, "updating discrete states") != STATUS_OK ||
        instance_prepare(instance) != STATUS_OK)
        return STATUS_ERROR;
    variables_clear_clocks(m);
    *states_changed = COMPONENT.apply_unlagged(m) != 0 && instance->kind == MODEL_EXCHANGE;
    if (COMPONENT.tick(m))
        instance_log(instance, LOG_EVENTS, "sampled at t = %.9g s", m->time);
    *again = variables_has_ticked(m);
    *next_event_time = COMPONENT.next_tick(m);
    instance->outdated = true;
    return STATUS_OK;
}

Status instance_set_time(Instance *instance, double time)
{
    const unsigned modes = instance && instance->kind == MODEL_EXCHANGE ? MODE_EVENT | MODE_CONTINUOUS : 0;
    if (instance_require(instance, modes, "setting the time") != STATUS_OK)
        return STATUS_ERROR;
    if (!(fabs(time) <= MAX_TIME))
        return instance_refuse(instance, "time is %g s, expected a number within %g", time, MAX_TIME);
    if (time < instance->start_time)
        return instance_refuse(instance, "time is %.12g s, expected the start time of %.12g s or later", time,
                               instance->start_time);
    instance->model.time = time;
    instance->outdated = true;
    return STATUS_OK;
}

Status instance_set_states(Instance *instance, const double states[], size_t n)
{
    Model *m = &instance->model;
    double before[N_STATES + 1]; /* C has no arrays of none */

    if (instance_require(instance, MODE_CONTINUOUS, "setting continuous states") != STATUS_OK ||
        require_count(instance, n, "setting continuous states") != STATUS_OK)
        return STATUS_ERROR;
    memcpy(before, states_address(m, FIRST_STATE), N_STATES * sizeof(double));
    memcpy(states_address(m, FIRST_STATE), states, N_STATES * sizeof(double));
    const Variable *invalid = variables_first_invalid_state(m);
    if (invalid) { /* an integrator may try again with a shorter step */
        const double value = *variable_real(m, invalid);
        memcpy(states_address(m, FIRST_STATE), before, N_STATES * sizeof(double));
        return instance_log(instance, LOG_DISCARDS, "%s = %.9g discarded: outside [%.9g, %.9g]", invalid->name, value,
                             invalid->min, invalid->max);
    }
    instance->outdated = true;
    return STATUS_OK;
}

Status instance_get_states(Instance *instance, double states[], size_t n)
{
    if (require_count(instance, n, "getting continuous states") != STATUS_OK)
        return STATUS_ERROR;
    if (n > 0)
        memcpy(states, states_address(&instance->model, FIRST_STATE), n * sizeof(double));
    return STATUS_OK;
}

Status instance_get_derivatives(Instance *instance, double derivatives[], size_t n)
{
    if (instance_require(instance, MODE_INITIALIZING | MODE_EVENT | MODE_CONTINUOUS | MODE_TERMINATED,
                         "getting derivatives") != STATUS_OK ||
        require_count(instance, n, "getting derivatives") != STATUS_OK || instance_update(instance) != STATUS_OK)
        return STATUS_ERROR;
    if (n > 0)
        memcpy(derivatives, states_address(&instance->model, FIRST_DERIVATIVE), n * sizeof(double));
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
