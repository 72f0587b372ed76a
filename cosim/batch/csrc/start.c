/* A vehicle at its start, set up by the functions of the FMU, with the same refusals in the same words. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "instance.h"
#include "lanes.h"

struct Starter {
    Instance *instance;
    double *values; /* (N_VARIABLES,) */
    char *reason;   /* receives the first message */
};

static void keep_message(const Instance *instance, Status status, const char *category, const char *message)
{
    Starter *starter = instance->environment;

    (void)category;
    if (status >= STATUS_ERROR && starter->reason && !starter->reason[0]) {
        strncpy(starter->reason, message, REFUSAL - 1);
        starter->reason[REFUSAL - 1] = '\0';
    }
}

Starter *starter_create(void)
{
    Starter *starter = calloc(1, sizeof *starter);

    if (!starter)
        return NULL;
    starter->values = calloc(N_VARIABLES, sizeof(double));
    starter->instance =
        instance_create("lanes", INSTANTIATION_TOKEN, CO_SIMULATION, false, keep_message, starter, NULL);
    if (starter->values && starter->instance)
        return starter;
    starter_free(starter);
    return NULL;
}

void starter_free(Starter *starter)
{
    if (!starter)
        return;
    instance_free(starter->instance);
    free(starter->values);
    free(starter);
}

static Status initialise(Instance *instance, const Batch *batch, const double *row)
{
    const double *integers = row + batch->n_reals;

    instance_reset(instance);
    for (int i = 0; i < batch->n_integers; i++) {
        const unsigned reference = batch->integers[i];
        if (instance_set_integer(instance, VARIABLES[reference].type, reference, (int)integers[i]) != STATUS_OK)
            return STATUS_ERROR;
    }
    if (instance_set_reals(instance, batch->reals, (size_t)batch->n_reals, row) != STATUS_OK ||
        instance_set_experiment(instance, 0.0, INFINITY) != STATUS_OK ||
        instance_enter_initialisation(instance) != STATUS_OK)
        return STATUS_ERROR;
    return instance_exit_initialisation(instance);
}

int starter_prepare(Starter *starter, const Batch *batch, const double *row, Start *start, char reason[REFUSAL])
{
    Model *m = &starter->instance->model;

    reason[0] = '\0';
    starter->reason = reason;
    const Status status = initialise(starter->instance, batch, row);
    starter->reason = NULL;
    if (status >= STATUS_ERROR)
        return 0;
    for (unsigned i = 0; i < N_VARIABLES; i++)
        starter->values[i] = VARIABLES[i].type == TYPE_REAL ? *variable_real(m, &VARIABLES[i])
                                                            : *variable_integer(m, &VARIABLES[i]);
    start->values = starter->values;
    start->derived = (const double *)&m->plant.derived;
    start->lags = m->plant.derived.lags;
    start->water_moves = m->plant.derived.water_moves;
    return 1;
}
