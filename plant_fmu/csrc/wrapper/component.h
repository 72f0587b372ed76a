/* What a component offers to the FMI wrappers: everything else in this folder is the same for all of them.
 *
 * A component brings a header model.h and a file that defines COMPONENT. The header defines
 *     Model     all that an instance is, as plain data, which FMU states copy; has the members time and stop_time,
 *     N_STATES  how many continuous states there are, which stand side by side in it, as their derivatives do,
 * and includes the generated table of variables: COMPONENT_VARIABLES, FIRST_STATE, FIRST_DERIVATIVE,
 * INSTANTIATION_TOKEN, and the prefixes of names. */
#ifndef COMPONENT_H
#define COMPONENT_H

#include <stdbool.h>

#include "model.h"

typedef enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL } Status; /* as in FMI */

typedef struct Instance Instance;

typedef struct {
    const char *name; /* of what steps, in messages */

    /* Forgets what was sampled, so that time can begin. */
    void (*rewind)(Model *model);
    /* Brings constants and clocks up to the parameters; refuses those that contradict each other. */
    Status (*prepare)(Instance *instance);
    /* Ends initialisation: mends the start or refuses it, and does what is due at once. */
    Status (*begin)(Instance *instance);
    /* Fills the outputs from all the rest. */
    void (*evaluate)(Instance *instance);
    /* Refuses a step [s] that is too long to be taken. */
    Status (*fits)(const Instance *instance, double step);
    /* Takes a step that ends at a time; if it refuses, the model is as before. */
    Status (*advance)(Instance *instance, double end);
    /* Whether a restored model can be, beyond its variables being in their ranges. */
    bool (*possible)(const Model *model);

    /* Of model exchange; all NULL where there are no states: then co-simulation alone is offered, no derivatives. */

    /* Puts states that follow the inputs at once to where these are. Returns whether any changed. */
    int (*settle)(Model *model);
    /* Does what clocks say is due. Returns whether there was any. */
    int (*tick)(Model *model);
    /* Time of the next tick, INFINITY if none is to come. */
    double (*next_tick)(const Model *model);
    /* Exact directional derivative of states and outputs along a seed, see derivatives.c. */
    void (*tangent)(const Model *model, const Model *seed, int starting, Model *tangent);
} Component;

extern const Component COMPONENT;

#endif
