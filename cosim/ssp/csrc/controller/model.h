/* The controller: inputs are a pose or samples of sensors, and weights; outputs forces, memberships and estimates, once a step. */
#ifndef MODEL_H
#define MODEL_H

#include <stdbool.h>
#include <stdint.h>

#include "variables.h" /* generated: sizes, indices of numbers, and the table of variables */

#include "ticks.h"

enum { N_STATES = 0 };

typedef struct {
    Ticks control;
    double gains[N_GAINS];
    double numbers[N_NUMBERS]; /* of the translated functions: parameters and inputs, outputs, then their memory */
    int64_t integers[N_INTEGERS];
    uint64_t words[N_WORDS];
    bool flags[N_FLAGS];
    double time;
    double stop_time; /* INFINITY: none */
} Model; /* plain data: the whole FMU state */

#endif
