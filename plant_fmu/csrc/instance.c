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

Status instance_tell(const Instance *instance, Status status, const char *format, ...)
{
    static const char *const categories[] = {
        "logAll", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"};
    char message[MAX_MESSAGE];
    va_list arguments;

    if (status < STATUS_ERROR && !instance->logging)
        return status;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    instance->log(instance, status, categories[status], message);
    return status;
}

Status instance_unsupported(Instance *instance, const char *function)
{
    return instance_tell(instance, STATUS_ERROR, "%s: not offered by this FMU", function);
}

static Status require_mode(const Instance *instance, int allowed, const char *action)
{
    if (instance->mode & allowed)
        return STATUS_OK;
    return instance_tell(instance, STATUS_ERROR, "%s: not allowed %s", action,
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
    instance->mode = MODE_INSTANTIATED;
    instance->unprepared = true;
    instance->outdated = true;
}

Instance *instance_create(const char *name, const char *token, LogCallback *log, void *environment,
                          void (*logger)(void), bool logging)
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
    instance->logging = logging;
    if (!token || strcmp(token, INSTANTIATION_TOKEN) != 0) {
        instance_tell(instance, STATUS_ERROR, "instantiation token is \"%s\", expected \"%s\"", token ? token : "",
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
    if (!instance->unprepared)
        return STATUS_OK;
    const char *fault = plant_prepare(&instance->model.plant);
    if (fault)
        return instance_tell(instance, STATUS_ERROR, "%s", fault);
    instance->unprepared = false;
    return STATUS_OK;
}

Status instance_enter_initialisation(Instance *instance, double start_time)
{
    if (require_mode(instance, MODE_INSTANTIATED, "entering initialisation") != STATUS_OK)
        return STATUS_ERROR;
    if (!isfinite(start_time))
        return instance_tell(instance, STATUS_ERROR, "start time is %g, expected a finite number", start_time);
    instance->model.time = start_time;
    instance->mode = MODE_INITIALISING;
    return STATUS_OK;
}

Status instance_exit_initialisation(Instance *instance)
{
    if (require_mode(instance, MODE_INITIALISING, "leaving initialisation") != STATUS_OK)
        return STATUS_ERROR;
    if (prepare(instance) != STATUS_OK)
        return STATUS_ERROR;
    if (!plant_normalise(instance->model.state.rigid))
        return instance_tell(instance, STATUS_ERROR, "quaternion.e0 … e3 are all zero, expected a direction");
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
            return instance_tell(instance, STATUS_ERROR, "value reference %u is no real variable", references[i]);
        values[i] = *real_at(&instance->model, &REALS[references[i]]);
    }
    return STATUS_OK;
}

Status instance_get_flag(Instance *instance, unsigned reference, bool *value)
{
    if (reference < N_REALS || reference >= N_REALS + N_FLAGS)
        return instance_tell(instance, STATUS_ERROR, "value reference %u is no Boolean variable", reference);
    update_outputs(instance);
    *value = *(const int *)((const char *)&instance->model + FLAGS[reference - N_REALS].offset) != 0;
    return STATUS_OK;
}

static Status check_value(const Instance *instance, unsigned reference, double value)
{
    if (reference >= N_REALS)
        return instance_tell(instance, STATUS_ERROR, "value reference %u is no real variable", reference);

    const Variable *v = &REALS[reference];
    if (v->role == OUTPUT || v->role == TIME)
        return instance_tell(instance, STATUS_ERROR, "%s: is calculated and cannot be set", v->name);
    if (v->role == STATE && require_mode(instance, MODE_INSTANTIATED | MODE_INITIALISING, v->name) != STATUS_OK)
        return STATUS_ERROR;
    if (!isfinite(value))
        return instance_tell(instance, STATUS_ERROR, "%s = %g refused: not a finite number", v->name, value);
    if (value < v->min || value > v->max)
        return instance_tell(instance, STATUS_ERROR, "%s = %.9g refused: outside [%.9g, %.9g]", v->name, value, v->min,
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

static bool state_is_finite(const State *state)
{
    for (int i = 0; i < N_RIGID; i++)
        if (!isfinite(state->rigid[i]))
            return false;
    return true;
}

Status instance_step(Instance *instance, double time, double step)
{
    Model *m = &instance->model;

    if (require_mode(instance, MODE_STEPPING, "stepping") != STATUS_OK || prepare(instance) != STATUS_OK)
        return STATUS_ERROR;
    if (!isfinite(step) || step <= 0.0)
        return instance_tell(instance, STATUS_ERROR, "step size is %g s, expected a positive number", step);
    /* masters add up their time: allow them their rounding, but no other time */
    if (!(fabs(time - m->time) <= 1e-3 * step + 1e-9 * fabs(m->time)))
        return instance_tell(instance, STATUS_ERROR, "step from t = %.12g s, but the plant is at %.12g s", time, m->time);
    const double count = ceil(step / m->plant.parameters.substep - 1e-9);
    if (count > MAX_SUBSTEPS)
        return instance_tell(instance, STATUS_ERROR, "step of %g s needs more than %d substeps of %g s", step,
                             MAX_SUBSTEPS, m->plant.parameters.substep);

    const int n = count < 1.0 ? 1 : (int)count;
    const double h = step / n;
    State next = m->state;
    Actuators target;

    plant_limit(&m->plant, &m->inputs, &target, m->outputs.thrust_cut, &m->outputs.wrench_cut);
    for (int i = 0; i < n; i++)
        plant_step(&m->plant, &target, h, &next);
    if (!state_is_finite(&next))
        return instance_tell(instance, STATUS_ERROR,
                             "the state grows beyond all numbers in the step from t = %.9g s of %g s: not taken", time,
                             step);

    m->state = next;
    m->time = time + step;
    instance->outdated = true;
    return STATUS_OK;
}
