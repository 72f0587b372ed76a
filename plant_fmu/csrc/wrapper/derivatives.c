/* Directional and adjoint derivatives by the table of variables: a second Model holds the seeds at their variables'
 * offsets, and a third one the sensitivities. */
#include <string.h>

#include "instance.h"

/* Checks references of real variables: outputs and states, or all others. */
static Status check_selection(const Instance *instance, Selection of, bool unknown)
{
    const char *kinds = unknown ? "output, state or derivative" : "input, state, parameter or time";

    for (size_t i = 0; i < of.n; i++) {
        const Variable *v = of.references[i] < N_VARIABLES ? &VARIABLES[of.references[i]] : NULL;
        if (!v || v->type != TYPE_REAL || !(unknown ? v->role == OUTPUT || v->role == STATE : v->role != OUTPUT))
            return instance_refuse(instance, "value reference %u is no real %s", of.references[i], kinds);
    }
    return instance_check_count(instance, TYPE_REAL, of.references, of.n, of.n_values);
}

static Status check_references(Instance *instance, Selection unknowns, Selection knowns)
{
    if (!COMPONENT.tangent)
        return instance_unsupported(instance, "derivatives");
    if (instance_require(instance, ~(unsigned)MODE_INSTANTIATED, "derivatives") != STATUS_OK)
        return STATUS_ERROR;
    if (check_selection(instance, unknowns, true) != STATUS_OK || check_selection(instance, knowns, false) != STATUS_OK)
        return STATUS_ERROR;
    return instance_update(instance);
}

static int is_initializing(const Instance *instance)
{
    return instance->mode == MODE_INITIALIZING;
}

/* Iterates over the elements of a selection, as variables v. */
#define FOR_EACH_ELEMENT(of, v)                     \
    for (size_t i_##v = 0; i_##v < (of).n; i_##v++) \
        for (const Variable *v = &VARIABLES[(of).references[i_##v]], *end_##v = v + v->size; v < end_##v; v++)

Status instance_directional_derivative(Instance *instance, Selection unknowns, Selection knowns, const double seed[],
                                       double sensitivity[])
{
    Model direction, tangent;

    if (check_references(instance, unknowns, knowns) != STATUS_OK)
        return STATUS_ERROR;
    memset(&direction, 0, sizeof direction);
    FOR_EACH_ELEMENT(knowns, known)
        *variable_real(&direction, known) += *seed++;
    COMPONENT.tangent(&instance->model, &direction, is_initializing(instance), &tangent);
    FOR_EACH_ELEMENT(unknowns, unknown)
        *sensitivity++ = *variable_real(&tangent, unknown);
    return STATUS_OK;
}

/* One tangent for each known: exact, and no second set of formulas. */
Status instance_adjoint_derivative(Instance *instance, Selection unknowns, Selection knowns, const double seed[],
                                   double sensitivity[])
{
    Model direction, tangent;

    if (check_references(instance, unknowns, knowns) != STATUS_OK)
        return STATUS_ERROR;
    memset(&direction, 0, sizeof direction);
    FOR_EACH_ELEMENT(knowns, known) {
        double *component = variable_real(&direction, known), sum = 0.0;
        const double *weight = seed;
        *component = 1.0;
        COMPONENT.tangent(&instance->model, &direction, is_initializing(instance), &tangent);
        *component = 0.0;
        FOR_EACH_ELEMENT(unknowns, unknown)
            sum += *weight++ * *variable_real(&tangent, unknown);
        *sensitivity++ = sum;
    }
    return STATUS_OK;
}
