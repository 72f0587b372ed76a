/* What other components do to the vehicle: inputs that are off while they are 0. A plant that is not COUPLED has none of
 * them, and nothing of this in its library. */
#ifndef COUPLING_H
#define COUPLING_H

#include <stdbool.h>

#include "model.h"

/* Whether any is on. */
bool coupling_acts(const Model *model);

/* Writes the model with all that they do in its parameters, inputs and external wrench. */
void coupling_apply(const Model *model, Model *out);

/* Writes the direction `seed` of a model with what it is for the model that coupling_apply writes. */
void coupling_tangent(const Model *model, const Model *seed, Model *out);

#endif
