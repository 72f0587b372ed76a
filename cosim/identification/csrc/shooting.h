/* Prediction of the plant's motion from a start, with exact sensitivities: arguments and results of Python's call. */
#ifndef SHOOTING_H
#define SHOOTING_H

#if defined _WIN32
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

enum { STATE_SIZE = 13 }; /* position 3, quaternion 4, velocity 6 */

typedef struct { /* one prediction; arrays are row by row */
    int n_parameters; /* given parameters of the FMU */
    int n_steps;
    int n_directions; /* directions of the sensitivities */
    int n_inputs;     /* inputs that change the wrench */
    int n_samples;
    double step; /* s */

    const unsigned *references;     /* (n_parameters,) value references */
    const double *values;           /* (n_parameters,) */
    const double *start;            /* (13,) */
    const double *wrench;           /* (n_steps, 2, 6) N, N m, body frame: mean over a step, and change from its begin to its end */
    const double *force;            /* (3,) N, constant, world frame */
    const double *start_tangents;   /* (n_directions, 13) */
    const int *parameter_directions; /* (n_directions,) value reference of the parameter that changes; -1: none */
    const int *input_directions;    /* (n_directions,) row of wrench_tangents; -1: none */
    const double *force_tangents;   /* (n_directions, 3) */
    const double *wrench_tangents;  /* (n_inputs, n_steps, 2, 6) */
    const double *turns;            /* (n_steps + 1, 7) quaternion and angular velocity at the steps' ends, or NULL: computed */
    const double *times;            /* (n_samples,) s since the start, rising */

    double *states;         /* (n_samples, 13) */
    double *rates;          /* (n_samples, 13) time derivatives */
    double *state_tangents; /* (n_samples, n_directions, 13) */
    double *work;           /* (6, n_directions, 13) */
} Prediction;

/* Predicts the motion. Returns NULL, or a message on invalid parameters or motion. */
EXPORTED const char *shooting_predict(const Prediction *prediction);

#endif
