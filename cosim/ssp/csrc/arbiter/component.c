/* The fuzzy arbiter as a component behind the FMI wrappers. A step computes the weights from the inputs at its beginning;
 * before the first step they are 0. */
#include <math.h>
#include <string.h>

#include "instance.h"
#include "rules.h" /* generated from the arbiter's definition */

static void rewind_ticks(Model *m)
{
    memset(&m->ticks, 0, sizeof m->ticks);
}

static Status prepare(Instance *instance)
{
    Model *m = &instance->model;

    ticks_begin(&m->ticks, m->period, m->time);
    return STATUS_OK;
}

static Status check_step_size(const Instance *instance, double step)
{
    const Ticks *ticks = &instance->model.ticks;

    if (ticks_would_skip(ticks, step))
        return instance_refuse(instance, "step of %g s is longer than time.arbiter = %g s", step, ticks->period);
    return STATUS_OK;
}

static Status advance(Instance *instance, double end)
{
    Model *m = &instance->model;
    double weights[N_CRITERIA];
    const Ticks ticks = m->ticks;

    const double late = ticks_first_late(&m->ticks, m->time);
    if (late > 0.0)
        instance_log(instance, LOG_WARNINGS, "the arbiter runs at t = %.9g s, %.3g s late: steps do not divide time.arbiter = %.9g s",
                      m->time, late, m->ticks.period);
    if (ticks_due(&m->ticks, m->time)) {
        if (EVALUATE_RULES(m->inputs, weights) != 0) {
            m->ticks = ticks;
            return instance_refuse(instance, "step from t = %.9g s not taken: no weights follow from these inputs",
                                   m->time);
        }
        memcpy(m->weights, weights, sizeof m->weights);
    }
    m->time = end;
    return STATUS_OK;
}

static bool valid_state(const Model *m)
{
    for (int i = 0; i < N_CRITERIA; i++)
        if (!isfinite(m->weights[i]))
            return false;
    return ticks_valid(&m->ticks);
}

const Component COMPONENT = {
    "the arbiter", rewind_ticks, prepare, NULL, NULL, check_step_size, advance, valid_state, NULL, NULL, NULL, NULL,
    {0, 0, NULL},
};
