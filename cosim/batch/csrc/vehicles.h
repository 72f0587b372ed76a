/* Vehicles in the lanes of one Model, stepped as their FMU steps one. */
#ifndef VEHICLES_H
#define VEHICLES_H

#include "instance.h"
#include "lanes.h"

/* Clears all lanes. */
void vehicles_leave(Model *model);

/* Puts a vehicle in its start state into a lane. */
void vehicles_seat(Model *model, int i, const Start *start);

/* Returns the lanes whose inputs are finite and within their ranges. */
Mask vehicles_take(const Inputs *inputs);

/* Steps the lanes `going`; the others, and those with unstable steps or states out of range, stay as they are. Returns the
 * lanes that have advanced. */
Mask vehicles_advance(Model *model, const Actuators *target, double start, double end, double substep, Mask going);

#endif
