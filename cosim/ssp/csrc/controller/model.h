/* The controller: inputs are a pose or samples of sensors, and weights; outputs forces, memberships and estimates, once a step. */
#ifndef MODEL_H
#define MODEL_H

#include <stdbool.h>
#include <stdint.h>

#include "variables.h" /* generated: sizes, and the table of variables */

#include "ticks.h"

enum { N_STATES = 0 };
enum { N_ALL = 1 + N_REGIONS };             /* the goal comes first */
enum { N_MEASURED = 15, N_SENSORS = 5 };    /* as the plant has them */

typedef struct {
    double gains[N_GAINS];
    double ramp;                      /* m, rad */
    double period;                    /* s, of the law */
    double start[13];                 /* pose and velocity, for masters that begin with zeros */
} Parameters; /* those of regions and attitude are among the numbers */

typedef struct {
    double motion[13];                /* position 3, quaternion 4, velocity 6 */
    double samples[N_MEASURED];
    double sample_times[N_SENSORS];   /* s */
    double weights[N_CRITERIA];
} Inputs;

typedef struct {
    Ticks control;
    double reported, failed, changed; /* numbers of failures reported and happened, and of changes of outages */
    double stuck[N_THRUSTERS];        /* 1: its force stays constant */
    double place;                     /* of the goal, from 0 */
    double inside_since;              /* s; negative: the vehicle is outside the goal */
} Memory;

typedef struct {
    double wrench[6];
    double thrusts[N_THRUSTERS];      /* N */
    double failures[N_THRUSTERS];     /* lost fraction of each thruster's force */
    double outages[N_SENSORS];        /* probability that a sample is lost by an outage */
    double memberships[N_CRITERIA];
    double rule_inputs[N_RULE_INPUTS];
    double estimate[4];               /* used for the forces */
    double values[N_ALL], clearances[N_ALL];
} Outputs;

typedef struct {
    Parameters parameters;
    Inputs inputs;
    Memory memory;
    Outputs outputs;
    double numbers[N_NUMBERS];        /* of the translated functions: parameters first, then their memory */
    int64_t integers[N_INTEGERS];
    uint64_t words[N_WORDS];
    bool flags[N_FLAGS];
    double time;
    double stop_time; /* INFINITY: none */
} Model; /* plain data: the whole FMU state */

#endif
