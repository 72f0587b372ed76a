/* Directional and adjoint derivatives by the table of variables: a second Model holds the seeds at their variables'
 * offsets, and a third one the sensitivities. */
#include <string.h>

#include "instance.h"

static Status check_references(Instance *instance, const unsigned unknowns[], size_t n_unknowns, const unsigned knowns[],
                      size_t n_knowns)
{
    if (!COMPONENT.tangent)
        return instance_unsupported(instance, "derivatives");
    if (instance_require(instance, ~(unsigned)MODE_INSTANTIATED, "derivatives") != STATUS_OK)
        return STATUS_ERROR;
    for (size_t i = 0; i < n_unknowns; i++) {
        const Variable *v = unknowns[i] < N_VARIABLES ? &VARIABLES[unknowns[i]] : NULL;
        if (!v || v->type != TYPE_REAL || !(v->role == OUTPUT || v->role == STATE))
            return instance_refuse(instance, "value reference %u is no real output, state or derivative", unknowns[i]);
    }
    for (size_t i = 0; i < n_knowns; i++) {
        const Variable *v = knowns[i] < N_VARIABLES ? &VARIABLES[knowns[i]] : NULL;
        if (!v || v->type != TYPE_REAL || v->role == OUTPUT)
            return instance_refuse(instance, "value reference %u is no real input, state, parameter or time", knowns[i]);
    }
    return instance_update(instance);
}

static int is_initializing(const Instance *instance)
{
    return instance->mode == MODE_INITIALIZING;
}

Status instance_directional_derivative(Instance *instance, const unsigned unknowns[], size_t n_unknowns,
                                       const unsigned knowns[], size_t n_knowns, const double seed[],
                                       double sensitivity[])
{
    Model direction, tangent;

    if (check_references(instance, unknowns, n_unknowns, knowns, n_knowns) != STATUS_OK)
        return STATUS_ERROR;
    memset(&direction, 0, sizeof direction);
    for (size_t i = 0; i < n_knowns; i++)
        *variable_real(&direction, &VARIABLES[knowns[i]]) += seed[i];
    COMPONENT.tangent(&instance->model, &direction, is_initializing(instance), &tangent);
    for (size_t i = 0; i < n_unknowns; i++)
        sensitivity[i] = *variable_real(&tangent, &VARIABLES[unknowns[i]]);
    return STATUS_OK;
}

/* One tangent for each known: exact, and no second set of formulas. */
Status instance_adjoint_derivative(Instance *instance, const unsigned unknowns[], size_t n_unknowns,
                                   const unsigned knowns[], size_t n_knowns, const double seed[],
                                   double sensitivity[])
{
    Model direction, tangent;

    if (check_references(instance, unknowns, n_unknowns, knowns, n_knowns) != STATUS_OK)
        return STATUS_ERROR;
    memset(&direction, 0, sizeof direction);
    for (size_t i = 0; i < n_knowns; i++) {
        double *component = variable_real(&direction, &VARIABLES[knowns[i]]);
        *component = 1.0;
        COMPONENT.tangent(&instance->model, &direction, is_initializing(instance), &tangent);
        *component = 0.0;
        sensitivity[i] = 0.0;
        for (size_t j = 0; j < n_unknowns; j++)
            sensitivity[i] += seed[j] * *variable_real(&tangent, &VARIABLES[unknowns[j]]);
    }
    return STATUS_OK;
}
