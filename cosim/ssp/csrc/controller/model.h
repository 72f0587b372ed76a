/* The controller: a pose and weights in; wrench, memberships and estimates out, once a step. */
#ifndef MODEL_H
#define MODEL_H

#include "variables.h" /* generated: how many regions and numbers there are, and the table of variables */

#include "law.h"
#include "ticks.h"

enum { N_STATES = 0 };
enum { N_ALL = 1 + N_REGIONS }; /* the goal is the first of all regions */

typedef struct {
    Gains gains;
    double desired[4];                /* attitude to be kept */
    double ramp;                      /* m, rad */
    double period;                    /* s, of the law */
    double start[13];                 /* pose and velocity, for masters that begin with zeros */
    double alphas[N_ALL];             /* gain of each region; that of the goal is not used */
    double velocities[N_ALL][3];      /* m/s, NED */
    double numbers[N_NUMBERS];        /* of the shapes */
} Parameters;

typedef struct {
    double motion[13];                /* position 3, quaternion 4, velocity 6 */
    double weights[N_CRITERIA];
} Inputs;

typedef struct {
    double estimate[4];
    Ticks control;
} Memory;

typedef struct {
    double wrench[6];
    double memberships[N_CRITERIA];
    double estimate[4];               /* that the wrench was made with */
    double values[N_ALL], clearances[N_ALL];
} Outputs;

typedef struct {
    Parameters parameters;
    Inputs inputs;
    Memory memory;
    Outputs outputs;
    double time;
    double stop_time; /* INFINITY if there is none */
} Model; /* plain data: all that an FMU state holds */

#endif
