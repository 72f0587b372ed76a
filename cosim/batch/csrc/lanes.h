/* Flights of many vehicles, several side by side: the arguments and results of Python's call, and a vehicle's start.
 * Plain C for both compilations, that of doubles and that of lanes. */
#ifndef LANES_H
#define LANES_H

#if defined _WIN32
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

enum { REFUSAL = 512 }; /* bytes of a message with its terminating NUL */

enum { /* of criteria, in the order of the arbiter's inputs */
    N_CRITERIA = 3
};

enum { /* what is counted of a flight */
    FIRST_INSIDE,    /* step, -1: never */
    LAST_ENTERED,    /* step, -1: never */
    INSIDE,          /* at the end: 0 or 1 */
    LEAST_CLEARANCE, /* m, of hard regions of place; INFINITY: there are none */
    LEAST_ANGLE,     /* rad, of hard regions of attitude */
    GOAL_CLEARANCE,  /* m, the greatest */
    WEIGHTED_VIOLATION, /* m s, rad s: integral of each region's violation times its priority, summed */
    EFFORT,          /* N s */
    MAX_FORCE,       /* N */
    MAX_SPEED,       /* m/s */
    FINAL_POSITION,
    ESTIMATE = FINAL_POSITION + 3,
    STOPPED = ESTIMATE + 4, /* step that the plant refused, -1: none */
    N_MARKS
};

typedef struct { /* a batch of flights; each row of `rows` is one */
    int n_rows, width;        /* numbers in a row */
    int n_reals, n_integers;  /* start values of the plant */
    int n_regions, n_numbers; /* the goal first, then the others; total of the shapes' numbers */
    int steps, control_every, arbiter_every;
    int moving;    /* 1: some region moves */
    int thrusters; /* 1: thrusters produce the wrench */
    int keep_direction; /* of a wrench beyond their limits */
    double step, period, substep; /* s */

    const unsigned *reals;    /* (n_reals,) value references */
    const unsigned *integers; /* (n_integers,) */
    const int *kinds;         /* (n_regions,) */
    const double *signs;      /* (n_regions,) */
    const int *offsets;       /* (n_regions + 1,) */
    const int *criteria;      /* (n_regions,) -1 for the goal */
    const int *hard;          /* (n_regions,) */
    const double *priorities; /* (n_regions,) for the score, 0 for the goal */
    const double *inverse;    /* (thrusters, 6) of the thruster matrix */
    const double *lower, *upper; /* (thrusters,) N */

    const double *rows; /* (n_rows, width): reals and integers of the plant, desired attitude (4), gains of the law (8), ramp,
                         * gains of the regions but the goal, numbers of the shapes, velocities of the regions (3 each) */
    double *marks;      /* (n_rows, N_MARKS) */
    char *refusals;     /* (n_rows, REFUSAL) the plant's reason for refusing the start; "": none */
} Batch;

typedef struct Starter Starter; /* sets up vehicles at their start, by the functions of the FMU */

typedef struct {           /* one vehicle at its start */
    const double *values;  /* of all variables that are set, by value reference */
    const double *derived; /* the numbers of Derived, in their order */
    int lags, water_moves;
} Start;

Starter *starter_create(void);
void starter_free(Starter *starter);

/* Sets up a vehicle as the FMU does. Returns 0, and writes the reason, if it refuses. */
int starter_prepare(Starter *starter, const Batch *batch, const double *row, Start *start, char reason[REFUSAL]);

/* Flies the batch. Returns 0 if memory is short. */
EXPORTED int lanes_fly(const Batch *batch);

/* Returns the number of lanes. */
EXPORTED int lanes_count(void);

#endif
