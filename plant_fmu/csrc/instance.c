#include "instance.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_SUBSTEPS = 1000000 };

/* ---- the table of variables -------------------------------------------------------------------------------- */

typedef enum { TIME, STATE, INPUT, OUTPUT, PARAMETER } Role;

typedef struct {
    const char *name;
    Role role;
    size_t offset; /* into Model */
    double start, min, max;
} Variable;

#define AT(member) offsetof(Model, member)

static const Variable REALS[] = {VEHICLE_REALS};   /* value reference: the index */
static const Variable FLAGS[] = {VEHICLE_FLAGS};   /* value reference: N_REALS + the index */

enum { N_REALS = sizeof REALS / sizeof REALS[0], N_FLAGS = sizeof FLAGS / sizeof FLAGS[0] };

static double *real_at(Model *model, const Variable *variable)
{
    return (double *)((char *)model + variable->offset);
}

/* ---- messages ---------------------------------------------------------------------------------------------- */

Status instance_refuse(const Instance *instance, const char *format, ...)
{
    char message[MAX_MESSAGE];
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    instance->log(instance, STATUS_ERROR, "logStatusError", message);
    return STATUS_ERROR;
}

Status instance_unsupported(Instance *instance, const char *function)
{
    return instance_refuse(instance, "%s: not offered by this FMU", function);
}

static Status require_mode(const Instance *instance, unsigned allowed, const char *action)
{
    if ((unsigned)instance->mode & allowed)
        return STATUS_OK;
    return instance_refuse(instance, "%s: not allowed %s", action,
                         instance->mode == MODE_INSTANTIATED    ? "before initialisation"
                         : instance->mode == MODE_INITIALISING ? "during initialisation"
                         : instance->mode == MODE_STEPPING     ? "once initialisation has ended"
                                                               : "after termination");
}

/* ---- life -------------------------------------------------------------------------------------------------- */

static void set_start_values(Instance *instance)
{
    memset(&instance->model, 0, sizeof instance->model);
    for (int i = 0; i < N_REALS; i++)
        if (REALS[i].role != OUTPUT)
            *real_at(&instance->model, &REALS[i]) = REALS[i].start;
    instance->model.stop_time = INFINITY;
    instance->mode = MODE_INSTANTIATED;
    instance->unprepared = true;
    instance->outdated = true;
}

Instance *instance_create(const char *name, const char *token, LogCallback *log, void *environment,
                          void (*logger)(void))
{
    const char *shown = name ? name : "";
    Instance *instance = calloc(1, sizeof *instance);

    if (!instance)
        return NULL;
    instance->name = malloc(strlen(shown) + 1);
    if (!instance->name) {
        free(instance);
        return NULL;
    }
    strcpy(instance->name, shown);
    instance->log = log;
    instance->environment = environment;
    instance->logger = logger;
    if (!token || strcmp(token, INSTANTIATION_TOKEN) != 0) {
        instance_refuse(instance, "instantiation token is \"%s\", expected \"%s\"", token ? token : "",
                      INSTANTIATION_TOKEN);
        instance_free(instance);
        return NULL;
    }
    set_start_values(instance);
    return instance;
}

void instance_free(Instance *instance)
{
    if (!instance)
        return;
    free(instance->name);
    free(instance);
}

Status instance_reset(Instance *instance)
{
    set_start_values(instance);
    return STATUS_OK;
}

/* Brings the derived constants up to date; tells what is wrong with the parameters. */
static Status prepare(Instance *instance)
{
    const Parameters *p = &instance->model.plant.parameters;

    if (!instance->unprepared)
        return STATUS_OK;
    for (int i = 0; i < N_THRUSTERS; i++)
        if (p->thrust_min[i] > p->thrust_max[i])
            return instance_refuse(instance, "thrust_min[%d] = %.9g is above thrust_max[%d] = %.9g", i + 1,
                                   p->thrust_min[i], i + 1, p->thrust_max[i]);
    const char *fault = plant_prepare(&instance->model.plant);
    if (fault)
        return instance_refuse(instance, "%s", fault);
    instance->unprepared = false;
    return STATUS_OK;
}

Status instance_set_experiment(Instance *instance, double start_time, double stop_time)
{
    if (require_mode(instance, MODE_INSTANTIATED, "setting the experiment") != STATUS_OK)
        return STATUS_ERROR;
    if (!isfinite(start_time))
        return instance_refuse(instance, "start time is %g s, expected a finite number", start_time);
    if (!(stop_time >= start_time))
        return instance_refuse(instance, "stop time is %g s, expected %g s (start time) or later", stop_time, start_time);
    instance->model.time = start_time;
    instance->model.stop_time = stop_time;
    return STATUS_OK;
}

Status instance_enter_initialisation(Instance *instance)
{
    if (require_mode(instance, MODE_INSTANTIATED, "entering initialisation") != STATUS_OK)
        return STATUS_ERROR;
    instance->mode = MODE_INITIALISING;
    return STATUS_OK;
}

Status instance_exit_initialisation(Instance *instance)
{
    if (require_mode(instance, MODE_INITIALISING, "leaving initialisation") != STATUS_OK ||
        prepare(instance) != STATUS_OK)
        return STATUS_ERROR;
    if (!plant_normalise(instance->model.state.rigid))
        return instance_refuse(instance, "quaternion.e0 to e3 have length 0, expected a direction");
    instance->mode = MODE_STEPPING;
    instance->outdated = true;
    return STATUS_OK;
}

Status instance_terminate(Instance *instance)
{
    if (require_mode(instance, MODE_STEPPING, "terminating") != STATUS_OK)
        return STATUS_ERROR;
    instance->mode = MODE_TERMINATED;
    return STATUS_OK;
}

/* ---- variables --------------------------------------------------------------------------------------------- */

static void update_outputs(Instance *instance)
{
    Model *m = &instance->model;
    Actuators target;

    if (!instance->outdated)
        return;
    plant_limit(&m->plant, &m->inputs, &target, m->outputs.thrust_cut, &m->outputs.wrench_cut);
    plant_lag(&m->plant, &m->state.actuators, &target, 0.0, &m->outputs.actuators);
    plant_wrench(&m->plant, &m->outputs.actuators, m->outputs.wrench);
    plant_euler(m->state.rigid + 3, m->outputs.euler);
    instance->outdated = false;
}

Status instance_get_reals(Instance *instance, const unsigned references[], size_t n, double values[])
{
    update_outputs(instance);
    for (size_t i = 0; i < n; i++) {
        if (references[i] >= N_REALS)
            return instance_refuse(instance, "value reference %u is no real variable", references[i]);
        values[i] = *real_at(&instance->model, &REALS[references[i]]);
    }
    return STATUS_OK;
}

Status instance_get_flag(Instance *instance, unsigned reference, bool *value)
{
    if (reference < N_REALS || reference >= N_REALS + N_FLAGS)
        return instance_refuse(instance, "value reference %u is no Boolean variable", reference);
    update_outputs(instance);
    *value = *(const int *)((const char *)&instance->model + FLAGS[reference - N_REALS].offset) != 0;
    return STATUS_OK;
}

static Status check_value(const Instance *instance, unsigned reference, double value)
{
    if (reference >= N_REALS)
        return instance_refuse(instance, "value reference %u is no real variable", reference);

    const Variable *v = &REALS[reference];
    if (v->role == OUTPUT || v->role == TIME)
        return instance_refuse(instance, "%s: is calculated and cannot be set", v->name);
    if (v->role == STATE && require_mode(instance, MODE_INSTANTIATED | MODE_INITIALISING, v->name) != STATUS_OK)
        return STATUS_ERROR;
    if (!isfinite(value))
        return instance_refuse(instance, "%s = %g refused: not a finite number", v->name, value);
    if (value < v->min || value > v->max)
        return instance_refuse(instance, "%s = %.9g refused: outside [%.9g, %.9g]", v->name, value, v->min,
                             v->max);
    return STATUS_OK;
}

Status instance_set_reals(Instance *instance, const unsigned references[], size_t n, const double values[])
{
    if (require_mode(instance, MODE_INSTANTIATED | MODE_INITIALISING | MODE_STEPPING, "setting variables") != STATUS_OK)
        return STATUS_ERROR;
    for (size_t i = 0; i < n; i++) /* all or none */
        if (check_value(instance, references[i], values[i]) != STATUS_OK)
            return STATUS_ERROR;

    for (size_t i = 0; i < n; i++) {
        const Variable *v = &REALS[references[i]];
        *real_at(&instance->model, v) = values[i];
        instance->unprepared |= v->role == PARAMETER;
    }
    instance->outdated = true;
    return STATUS_OK;
}

/* ---- stepping ---------------------------------------------------------------------------------------------- */

/* Returns NULL, or the first state variable that is not within its range. */
static const Variable *stray_state(Model *model)
{
    for (int i = 0; i < N_REALS; i++) {
        const double value = *real_at(model, &REALS[i]);
        if (REALS[i].role == STATE && !(value >= REALS[i].min && value <= REALS[i].max))
            return &REALS[i];
    }
    return NULL;
}

/* Whether a step from `time` fits the experiment. Masters add up their time: they are allowed their rounding. */
static Status check_step(const Instance *instance, double time, double step)
{
    const Model *m = &instance->model;
    const double rounding = 1e-3 * step + 1e-9 * fabs(m->time);

    if (!isfinite(step) || step <= 0.0 || m->time + step == m->time)
        return instance_refuse(instance, "step size is %g s, expected a positive number", step);
    if (!(fabs(time - m->time) <= rounding))
        return instance_refuse(instance, "step from t = %.12g s, but the plant is at %.12g s", time, m->time);
    if (time + step > m->stop_time + rounding)
        return instance_refuse(instance, "step to t = %.12g s is beyond the stop time of %.12g s", time + step,
                               m->stop_time);
    if (step / m->plant.parameters.substep > MAX_SUBSTEPS)
        return instance_refuse(instance, "step of %g s needs more than %d substeps of %g s", step, MAX_SUBSTEPS,
                               m->plant.parameters.substep);
    return STATUS_OK;
}

Status instance_step(Instance *instance, double time, double step)
{
    Model *m = &instance->model;

    if (require_mode(instance, MODE_STEPPING, "stepping") != STATUS_OK || prepare(instance) != STATUS_OK ||
        check_step(instance, time, step) != STATUS_OK)
        return STATUS_ERROR;

    /* whole substeps, however the step was rounded */
    const int n = (int)fmax(1.0, ceil(step / m->plant.parameters.substep - 1e-9));
    const double h = step / n;
    const State before = m->state;
    Actuators target;

    plant_limit(&m->plant, &m->inputs, &target, m->outputs.thrust_cut, &m->outputs.wrench_cut);
    for (int i = 0; i < n; i++)
        if (!plant_step(&m->plant, &target, h, &m->state)) {
            m->state = before;
            return instance_refuse(instance,
                                   "step from t = %.9g s not taken: integration steps of %g s are too long for these "
                                   "forces and this damping (parameter substep)",
                                   time, h);
        }
    const Variable *stray = stray_state(m);
    if (stray) {
        const double value = *real_at(m, stray);
        m->state = before;
        return instance_refuse(instance, "step from t = %.9g s not taken: %s becomes %.9g, outside [%.9g, %.9g]", time,
                               stray->name, value, stray->min, stray->max);
    }

    m->time = time + step;
    instance->outdated = true;
    return STATUS_OK;
}
