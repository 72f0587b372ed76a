/* The table of variables, and the modes in which each may be read and written. */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "instance.h"

#define AT(member) offsetof(Model, member)

const Variable VARIABLES[] = {COMPONENT_VARIABLES};
const unsigned N_VARIABLES = sizeof VARIABLES / sizeof VARIABLES[0];
const char TOKEN[] = INSTANTIATION_TOKEN;

static const char *const TYPE_NAMES[] = {"real", "Integer", "Boolean", "clock"};

double *variable_real(Model *model, const Variable *variable)
{
    return (double *)((char *)model + variable->offset);
}

int *variable_integer(Model *model, const Variable *variable)
{
    return (int *)((char *)model + variable->offset);
}

void variables_start(Model *model)
{
    memset(model, 0, sizeof *model);
    for (unsigned i = 0; i < N_VARIABLES; i++) {
        const Variable *v = &VARIABLES[i];
        if (v->role == OUTPUT)
            continue;
        if (v->type == TYPE_REAL)
            *variable_real(model, v) = v->start;
        else
            *variable_integer(model, v) = (int)v->start;
    }
}

/* ---- clocks ------------------------------------------------------------------------------------------------ */

bool variables_has_ticked(const Model *model)
{
    bool any = false;

    for (int i = 0; i < (int)N_CLOCK_VARIABLES; i++)
        any = any || *(const int *)((const char *)model + VARIABLES[FIRST_CLOCK + i].offset);
    return any;
}

void variables_clear_clocks(Model *model)
{
    for (int i = 0; i < (int)N_CLOCK_VARIABLES; i++)
        *variable_integer(model, &VARIABLES[FIRST_CLOCK + i]) = 0;
}

/* ---- reading ----------------------------------------------------------------------------------------------- */

/* Checks that a reference has a type. */
static Status check_reference(const Instance *instance, Type type, unsigned reference)
{
    if (reference < N_VARIABLES && VARIABLES[reference].type == type)
        return STATUS_OK;
    return instance_refuse(instance, "value reference %u is no %s variable", reference, TYPE_NAMES[type]);
}

Status instance_check_count(const Instance *instance, Type type, const unsigned references[], size_t n, size_t n_values)
{
    size_t count = 0;

    for (size_t i = 0; i < n; i++) {
        if (check_reference(instance, type, references[i]) != STATUS_OK)
            return STATUS_ERROR;
        count += VARIABLES[references[i]].size;
    }
    if (count == n_values)
        return STATUS_OK;
    return instance_refuse(instance, "%zu values given, but the variables have %zu elements", n_values, count);
}

Status instance_get_reals(Instance *instance, const unsigned references[], size_t n, double values[], size_t n_values)
{
    if ((N_ARRAYS > 0 || n != n_values) && instance_check_count(instance, TYPE_REAL, references, n, n_values) != STATUS_OK)
        return STATUS_ERROR;
    const bool may_be_partial = instance->mode == MODE_STEPPING && !instance->unprepared && COMPONENT.forces.evaluate;
    bool has_forces = false;
    for (size_t i = 0; i < n; i++) {
        if (references[i] >= N_VARIABLES || VARIABLES[references[i]].type != TYPE_REAL)
            return check_reference(instance, TYPE_REAL, references[i]);
        const Variable *v = &VARIABLES[references[i]];
        if (instance->outdated && v->role == OUTPUT) {
            if (may_be_partial && v->offset >= COMPONENT.forces.begin && v->offset < COMPONENT.forces.end) {
                if (!has_forces)
                    COMPONENT.forces.evaluate(&instance->model);
                has_forces = true;
            } else if (instance_update(instance) != STATUS_OK)
                return STATUS_ERROR;
        }
        for (const Variable *element = v; element < v + v->size; element++)
            *values++ = *variable_real(&instance->model, element);
    }
    return STATUS_OK;
}

Status instance_get_integer(Instance *instance, Type type, unsigned reference, int *value)
{
    if (check_reference(instance, type, reference) != STATUS_OK)
        return STATUS_ERROR;
    const Variable *v = &VARIABLES[reference];
    if (v->role == OUTPUT && instance_update(instance) != STATUS_OK)
        return STATUS_ERROR;
    *value = *variable_integer(&instance->model, v);
    return STATUS_OK;
}

/* ---- writing ----------------------------------------------------------------------------------------------- */

static unsigned modes_to_set(Role role, Interface kind)
{
    const unsigned start = MODE_INSTANTIATED | MODE_INITIALIZING;

    switch (role) {
    case STATE: /* in model exchange also one by one (FMI 3.0.2, 2.3.5 and 3.2.1), as CasADi does */
        return kind == CO_SIMULATION ? start : start | MODE_EVENT | MODE_CONTINUOUS;
    case INPUT:
        return start | MODE_STEPPING | MODE_EVENT | MODE_CONTINUOUS;
    default:
        return start | MODE_STEPPING | MODE_EVENT;
    }
}

/* True for a value that needs neither clipping nor a closer look, as most do. */
static bool is_within(const Instance *instance, const Variable *v, double value)
{
    return v->role == INPUT && instance->mode == MODE_STEPPING && v->type == TYPE_REAL && value >= v->min && value <= v->max &&
           isfinite(value);
}

/* How far outside of its range a value may be, relative to the bound unless that is 0: it is clipped. */
static const double ROUNDING = 1e-9;

static double clip(const Variable *v, double value)
{
    return value < v->min ? v->min : value > v->max ? v->max : value;
}

static Status check_value(const Instance *instance, Type type, unsigned reference, double value)
{
    if (check_reference(instance, type, reference) != STATUS_OK)
        return STATUS_ERROR;

    const Variable *v = &VARIABLES[reference];
    if (v->role == OUTPUT || v->role == TIME)
        return instance_refuse(instance, "%s: is calculated and cannot be set", v->name);
    const unsigned modes = modes_to_set(v->role, instance->kind);
    if (!(modes & (unsigned)instance->mode))
        return instance_require(instance, modes, v->name);
    if (!isfinite(value))
        return instance_refuse(instance, "%s = %g refused: not a finite number", v->name, isnan(value) ? fabs(value) : value);
    const double bounded = clip(v, value);
    if (fabs(value - bounded) > ROUNDING * (bounded != 0.0 ? fabs(bounded) : 1.0))
        return instance_refuse(instance, "%s = %.17g refused: outside [%.17g, %.17g]", v->name, value, v->min, v->max);
    return STATUS_OK;
}

static void note_change(Instance *instance, const Variable *v)
{
    instance->unprepared |= v->role == PARAMETER;
    instance->outdated = true;
}

Status instance_set_reals(Instance *instance, const unsigned references[], size_t n, const double values[], size_t n_values)
{
    if ((N_ARRAYS > 0 || n != n_values) && instance_check_count(instance, TYPE_REAL, references, n, n_values) != STATUS_OK)
        return STATUS_ERROR;
    const double *value = values;
    for (size_t i = 0; i < n; i++) { /* all or none */
        const unsigned size = references[i] < N_VARIABLES ? VARIABLES[references[i]].size : 1;
        for (unsigned k = 0; k < size; k++, value++)
            if (!(references[i] + k < N_VARIABLES && is_within(instance, &VARIABLES[references[i] + k], *value)) &&
                check_value(instance, TYPE_REAL, references[i] + k, *value) != STATUS_OK)
                return STATUS_ERROR;
    }
    for (size_t i = 0; i < n; i++)
        for (const Variable *v = &VARIABLES[references[i]], *end = v + v->size; v < end; v++) {
            *variable_real(&instance->model, v) = clip(v, *values++);
            note_change(instance, v);
        }
    return STATUS_OK;
}

Status instance_set_integer(Instance *instance, Type type, unsigned reference, int value)
{
    if (check_value(instance, type, reference, value) != STATUS_OK)
        return STATUS_ERROR;
    *variable_integer(&instance->model, &VARIABLES[reference]) = value;
    note_change(instance, &VARIABLES[reference]);
    return STATUS_OK;
}

/* ---- ranges ------------------------------------------------------------------------------------------------ */

static bool is_out_of_range(const Model *model, const Variable *v)
{
    const void *address = (const char *)model + v->offset;
    const double value = v->type == TYPE_REAL ? *(const double *)address : *(const int *)address;

    return !(value >= v->min && value <= v->max);
}

const Variable *variables_first_invalid(const Model *model)
{
    for (unsigned i = 0; i < N_VARIABLES; i++)
        if (VARIABLES[i].role != OUTPUT && VARIABLES[i].role != TIME && is_out_of_range(model, &VARIABLES[i]))
            return &VARIABLES[i];
    return NULL;
}

const Variable *variables_first_invalid_state(const Model *model)
{
    for (int i = 0; i < (int)N_STATES; i++)
        if (is_out_of_range(model, &VARIABLES[FIRST_STATE + i]))
            return &VARIABLES[FIRST_STATE + i];
    return NULL;
}
