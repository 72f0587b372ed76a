/* Inputs for the effects of other components on the vehicle; 0 turns an input off. A plant that is not COUPLED has none of
 * them, and none of this code in its library. */
#ifndef COUPLING_H
#define COUPLING_H

#include <stdbool.h>

#include "model.h"

/* Returns true if any of these inputs is on. */
bool coupling_is_active(const Model *model);

/* Writes the model with the effects of these inputs in its parameters, inputs and external wrench. */
void coupling_apply(const Model *model, Model *out);

/* Writes the tangent of coupling_apply along the direction `seed`. */
void coupling_tangent(const Model *model, const Model *seed, Model *out);

#endif
