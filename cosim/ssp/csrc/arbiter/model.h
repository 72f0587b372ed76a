/* The arbiter: memberships or other inputs of its rules in, weights out, once a period. */
#ifndef MODEL_H
#define MODEL_H

#include "variables.h" /* generated: number of criteria, and the table of variables */

#include "ticks.h"

enum { N_STATES = 0 };

typedef struct {
    double period; /* s */
    double inputs[N_RULE_INPUTS];
    Ticks ticks;
    double weights[N_CRITERIA];
    double time;
    double stop_time; /* INFINITY: none */
} Model; /* plain data: the whole FMU state */

#endif
