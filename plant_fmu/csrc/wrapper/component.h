/* Interface of a component to the FMI wrappers; everything else in this folder is the same for all components.
 *
 * A component brings a header model.h and a file that defines COMPONENT. The header defines
 *     Model     the whole state of an instance, as plain data, which FMU states copy; with the members time and stop_time,
 *     N_STATES  number of continuous states, which are contiguous in it, as are their derivatives,
 * and includes the generated table of variables: COMPONENT_VARIABLES, FIRST_STATE, FIRST_DERIVATIVE,
 * INSTANTIATION_TOKEN, and the prefixes of names. */
#ifndef COMPONENT_H
#define COMPONENT_H

#include <stdbool.h>
#include <stddef.h>

#include "model.h"

typedef enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL } Status; /* as in FMI */

typedef struct Instance Instance;

typedef struct {
    const char *name; /* in messages */

    /* Clears samples and clocks before time begins. */
    void (*rewind)(Model *model);
    /* Updates constants and clocks from the parameters; refuses contradictory parameters. */
    Status (*prepare)(Instance *instance);
    /* Ends initialization: corrects or refuses the start values, and executes the clocks that are due. NULL: nothing. */
    Status (*begin)(Instance *instance);
    /* Computes the outputs. NULL: steps alone change them. */
    void (*evaluate)(Instance *instance);
    /* Refuses a step [s] that is too long. */
    Status (*check_step_size)(const Instance *instance, double step);
    /* Makes a step that ends at the time `end` [s]; on refusal the model stays as before. */
    Status (*advance)(Instance *instance, double end);
    /* True if a restored model is valid; the ranges of its variables are checked elsewhere. */
    bool (*valid_state)(const Model *model);

    /* For model exchange; all NULL without states: then the FMU offers co-simulation alone, and no derivatives. */

    /* Sets states without a lag to their inputs. Returns 1 if any changed. */
    int (*apply_unlagged)(Model *model);
    /* Executes the clocks that are due. Returns 1 if there was one. */
    int (*tick)(Model *model);
    /* Returns the time of the next tick; INFINITY: none. */
    double (*next_tick)(const Model *model);
    /* Exact directional derivative of states and outputs along a seed, see derivatives.c. */
    void (*tangent)(const Model *model, const Model *seed, int starting, Model *tangent);

    /* Computes the outputs at offsets `begin` to `end` in the model, which costs less than all. NULL: all at once. */
    struct {
        size_t begin, end;
        void (*evaluate)(Model *model);
    } forces;
} Component;

extern const Component COMPONENT;

#endif
