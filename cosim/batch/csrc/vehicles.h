/* Vehicles in the lanes of one Model, stepped as their FMU steps one. */
#ifndef VEHICLES_H
#define VEHICLES_H

#include "instance.h"
#include "lanes.h"

/* Forgets who was there, before the first is seated. */
void vehicles_leave(Model *model);

/* Puts a vehicle that is at its start into a lane. */
void vehicles_seat(Model *model, int i, const Start *start);

/* Which of the vehicles take their inputs: numbers, and within their ranges. */
Mask vehicles_take(const Inputs *inputs);

/* Steps those that are `going`; the others, and those that cannot follow or leave the ranges of their states, stay where they
 * are. Returns which have gone. */
Mask vehicles_advance(Model *model, const Actuators *target, double start, double end, double substep, Mask going);

#endif
