/* The printed law and its regions as a component behind the FMI wrappers. Everything is worked out in a step, from the
 * inputs at its beginning; before the first all outputs are 0. */
#include <math.h>
#include <string.h>

#include "instance.h"
#include "regions.h"
#include "scene.h" /* generated: what kinds of regions there are */

static const int KINDS[N_ALL] = REGION_KINDS;
static const double SIGNS[N_ALL] = REGION_SIGNS;
static const int OFFSETS[N_ALL + 1] = REGION_OFFSETS;
static const int CRITERIA[N_ALL] = REGION_CRITERIA;
static const char *const NAMES[N_ALL] = REGION_NAMES;

/* What must hold among the numbers of all shapes, beyond their ranges; the last has no fault. */
typedef struct Constraint {
    enum { HOLDS_UNIT, HOLDS_ROTATION, HOLDS_ABOVE } what;
    int region, place;
    int more; /* how many numbers, or the place of the one to exceed */
    const char *fault;
} Constraint;

static const Constraint CONSTRAINTS[] = REGION_CONSTRAINTS;

static void rewind_memory(Model *m)
{
    memset(&m->memory, 0, sizeof m->memory);
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

static bool holds(const Constraint *c, const double numbers[])
{
    if (c->what == HOLDS_ABOVE)
        return numbers[c->place] > numbers[c->more];
    return c->what == HOLDS_ROTATION ? is_rotation(numbers + c->place) : is_unit(numbers + c->place, c->more);
}

static Status prepare(Instance *instance)
{
    Model *m = &instance->model;

    if (!is_unit(m->parameters.desired, 4))
        return instance_refuse(instance, "law.desired_quaternion is not of length 1");
    if (!is_unit(m->parameters.start + 3, 4))
        return instance_refuse(instance, "initial.quaternion is not of length 1");
    for (const Constraint *c = CONSTRAINTS; c->fault; c++)
        if (!holds(c, m->parameters.numbers))
            return instance_refuse(instance, "%s: %s", NAMES[c->region], c->fault);
    ticks_begin(&m->memory.control, m->parameters.period, m->time);
    return STATUS_OK;
}

static Status begin(Instance *instance)
{
    return (void)instance, STATUS_OK;
}

static void evaluate(Instance *instance)
{
    (void)instance;
}

static Status fits(const Instance *instance, double step)
{
    const Ticks *control = &instance->model.memory.control;

    if (ticks_left_out(control, step))
        return instance_refuse(instance, "step of %g s is longer than time.control = %g s", step, control->period);
    return STATUS_OK;
}

/* Where the vehicle is: as the inputs say; at the start while all of them are 0, as masters leave them that have not
 * heard of the plant yet. A quaternion of zeros is read as identity. */
static void motion_now(const Model *m, double motion[13])
{
    bool all_zero = true;

    memcpy(motion, m->inputs.motion, sizeof m->inputs.motion);
    for (int i = 0; i < 13; i++)
        all_zero = all_zero && motion[i] == 0.0;
    if (all_zero)
        memcpy(motion, m->parameters.start, sizeof m->parameters.start);
    const double *e = motion + 3;
    if (e[0] == 0.0 && e[1] == 0.0 && e[2] == 0.0 && e[3] == 0.0)
        motion[3] = 1.0;
}

/* To what degree each criterion matters: that of its most pressing region. */
static void pressing(const Model *m, double memberships[N_CRITERIA])
{
    for (int i = 0; i < N_CRITERIA; i++)
        memberships[i] = 0.0;
    for (int i = 1; i < N_ALL; i++)
        memberships[CRITERIA[i]] =
            fmax(memberships[CRITERIA[i]], regions_ramp(m->outputs.clearances[i], m->parameters.ramp));
}

static bool is_finite(const double x[], int n)
{
    for (int i = 0; i < n; i++)
        if (!isfinite(x[i]))
            return false;
    return true;
}

static Status advance(Instance *instance, double end)
{
    Model *m = &instance->model;
    const Memory memory = m->memory;
    const Outputs outputs = m->outputs;
    Parameters *p = &m->parameters;
    Outputs *out = &m->outputs;
    double motion[13], shifts[N_ALL][3], gradients[N_ALL][3], alphas[N_ALL];

    motion_now(m, motion);
    for (int i = 0; i < N_ALL; i++)
        for (int j = 0; j < 3; j++)
            shifts[i][j] = p->velocities[i][j] * m->time;
    const Regions regions = {N_ALL, KINDS, SIGNS, OFFSETS, p->numbers, (const double(*)[3])shifts};
    regions_evaluate(&regions, motion, motion + 3, out->values, gradients, out->clearances);
    pressing(m, out->memberships);

    const double late = ticks_first_late(&m->memory.control, m->time);
    if (late > 0.0)
        instance_tell(instance, LOG_WARNINGS, "the law runs at t = %.9g s, %.3g s late: steps do not divide time.control = %.9g s",
                      m->time, late, p->period);
    if (ticks_due(&m->memory.control, m->time)) {
        for (int i = 1; i < N_ALL; i++)
            alphas[i] = p->alphas[i] * m->inputs.weights[CRITERIA[i]];
        memcpy(out->estimate, m->memory.estimate, sizeof out->estimate);
        law_step(motion + 3, motion + 7, p->desired, out->values[0], gradients[0], N_REGIONS, out->values + 1,
                 (const double(*)[3])(gradients + 1), alphas + 1, &p->gains, p->period, m->memory.estimate, out->wrench);
    }
    if (!is_finite(out->wrench, 6) || !is_finite(m->memory.estimate, 4)) {
        m->memory = memory;
        m->outputs = outputs;
        return instance_refuse(instance, "step from t = %.9g s not taken: wrench or estimate is no finite number", m->time);
    }
    m->time = end;
    return STATUS_OK;
}

static bool possible(const Model *m)
{
    return ticks_possible(&m->memory.control) && is_finite(m->memory.estimate, 4) &&
           is_finite((const double *)&m->outputs, (int)(sizeof m->outputs / sizeof(double)));
}

const Component COMPONENT = {
    "the controller", rewind_memory, prepare, begin, evaluate, fits, advance, possible, NULL, NULL, NULL, NULL,
};
