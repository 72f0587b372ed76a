/* Sensing, regions and law as a component behind the FMI wrappers. A step computes the outputs from the inputs at its
 * beginning; before the first step all outputs are 0. */
#include <math.h>
#include <string.h>

#include "instance.h"
#include "loop.h" /* generated: the translated functions, and constants of the scenario */
#include "random.h"

/* Constraints among the parameters, beyond their ranges; one without a message ends the list. */
typedef struct Constraint {
    enum { HOLDS_UNIT, HOLDS_ROTATION, HOLDS_ABOVE } what;
    int index; /* of the first number */
    int more;  /* number of numbers, or the index of the one to exceed */
    const char *fault;
} Constraint;

static const Constraint CONSTRAINTS[] = SCENE_CONSTRAINTS;
static const int RAMPS[] = SCENE_RAMPS; /* memberships that decrease over arbiter.ramp; -1 ends the list */
static const struct {
    int index;
    int64_t maximum;
} COUNTERS[] = SCENE_COUNTERS;
enum { NOISE_STREAM = 64 }; /* and five more; the plant has those before it */

/* ---- numbers ----------------------------------------------------------------------------------------------- */

static bool is_finite(const double x[], int n)
{
    for (int i = 0; i < n; i++)
        if (!isfinite(x[i]))
            return false;
    return true;
}

static bool is_unit(const double x[], int n)
{
    double square = 0.0;

    for (int i = 0; i < n; i++)
        square += x[i] * x[i];
    return fabs(square - 1.0) < 1e-6;
}

static bool is_rotation(const double R[9])
{
    for (int i = 0; i < 3; i++) {
        const double *a = R + 3 * i, *b = R + 3 * ((i + 1) % 3);
        if (!is_unit(a, 3) || !(fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) < 1e-6))
            return false;
    }
    return true;
}

static bool holds(const double numbers[], const Constraint *c)
{
    if (c->what == HOLDS_ABOVE)
        return numbers[c->index] > numbers[c->more];
    return c->what == HOLDS_ROTATION ? is_rotation(numbers + c->index) : is_unit(numbers + c->index, c->more);
}

/* ---- before the first step --------------------------------------------------------------------------------- */

static void rewind_memory(Model *m)
{
    memset(&m->control, 0, sizeof m->control);
    control_rewind(m);
}

static Status prepare(Instance *instance)
{
    Model *m = &instance->model;

    for (const Constraint *c = CONSTRAINTS; c->fault; c++)
        if (!holds(m->numbers, c))
            return instance_refuse(instance, "%s", c->fault);
    for (const int *index = RAMPS; *index >= 0; index++)
        m->numbers[*index] = m->numbers[RAMP_INDEX];
    ticks_begin(&m->control, m->numbers[PERIOD_INDEX], m->time);
    return STATUS_OK;
}

static Status check_step_size(const Instance *instance, double step)
{
    const Ticks *control = &instance->model.control;

    if (ticks_would_skip(control, step))
        return instance_refuse(instance, "step of %g s is longer than time.control = %g s", step, control->period);
    return STATUS_OK;
}

/* ---- a step ------------------------------------------------------------------------------------------------ */

/* Draws the noise of position and velocity, which is constant until the law's next tick [m, m/s]. */
static void draw_noise(Model *m)
{
    static const double DEVIATIONS[6] = SCENE_DEVIATIONS;

    for (unsigned i = 0; i < 6; i++)
        if (DEVIATIONS[i] > 0.0)
            m->numbers[NOISE_INDEX + i] =
                DEVIATIONS[i] * random_normal(SCENE_SEED, NOISE_STREAM + i, (uint64_t)m->control.count - 1);
}

static Status take_step(Instance *instance, double end)
{
    Model *m = &instance->model;

    const double late = ticks_first_late(&m->control, m->time);
    if (late > 0.0)
        instance_log(instance, LOG_WARNINGS, "the law runs at t = %.9g s, %.3g s late: steps do not divide time.control = %.9g s",
                      m->time, late, m->control.period);
    const bool due = ticks_due(&m->control, m->time);
    if (due)
        draw_noise(m);
    m->numbers[NOW_INDEX] = m->time;
    m->numbers[END_INDEX] = end;
    m->integers[CONTROLS_INDEX] = due;
    control_step(m);
    if (!is_finite(m->numbers + N_SETTABLE, N_OUTPUTS))
        return instance_refuse(instance, "step from t = %.9g s not taken: a force, an estimate or a value of a region is no finite number",
                               m->time);
    m->time = end;
    return STATUS_OK;
}

static Status advance(Instance *instance, double end)
{
    instance->before = instance->model;
    const Status status = take_step(instance, end);
    if (status != STATUS_OK)
        instance->model = instance->before;
    return status;
}

/* ---- restored states --------------------------------------------------------------------------------------- */

static bool valid_state(const Model *m)
{
    const unsigned char *flags = (const unsigned char *)m->flags;

    for (int i = 0; i < N_FLAGS; i++)
        if (flags[i] > 1)
            return false;
    for (size_t i = 0; i < sizeof COUNTERS / sizeof COUNTERS[0]; i++)
        if (m->integers[COUNTERS[i].index] < 0 || m->integers[COUNTERS[i].index] > COUNTERS[i].maximum)
            return false;
    return ticks_valid(&m->control) && is_finite(m->numbers + N_SETTABLE, N_OUTPUTS);
}

const Component COMPONENT = {
    "the controller", rewind_memory, prepare, NULL, NULL, check_step_size, advance, valid_state, NULL, NULL, NULL, NULL,
    {0, 0, NULL},
};
