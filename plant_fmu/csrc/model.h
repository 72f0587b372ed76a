/* The plant as a whole: motion, sampled and held values, inputs, outputs. */
#ifndef MODEL_H
#define MODEL_H

#include "plant.h"

#define NO_SAMPLE -1e12 /* s, stamp before the first sample */
#define MIN_COS_PITCH 1e-12 /* below it roll and yaw are not separate */

enum { CURRENT_CLOCK = N_SENSORS, N_CLOCKS }; /* one for each sensor, one for the current's variation */

typedef struct {
    double period;  /* s, 0: does not run */
    double since;   /* s, time of its tick 0 */
    double ticks;   /* since `since` */
    double samples; /* since the start: the index into the stream of random numbers */
} Clock;

enum { MAX_PENDING = 8, MAX_SENSOR_CHANNELS = 6 }; /* samples of a sensor that are not delivered yet; channels of the IMU */

typedef struct { /* a sample that is not delivered yet */
    double taken, due; /* s, times of the sample and of its delivery */
    double values[MAX_SENSOR_CHANNELS];
} Pending;

typedef struct { /* values that change only at ticks */
    Clock clocks[N_CLOCKS];
    double next_tick; /* s, of any clock or pending sample; INFINITY: none */
    double samples[N_MEASURED];
    double sample_time[N_SENSORS];         /* s, of the last delivered sample */
    double delivered[N_SENSORS];           /* number of samples */
    int ticked[N_SENSORS];                 /* 1: a sample was delivered since they were cleared */
    double pending[N_SENSORS];             /* number of samples in the queue, oldest first */
    Pending queue[N_SENSORS][MAX_PENDING];
    Drift drift;
} Held;

typedef struct {
    int thrust_saturated[N_THRUSTERS]; /* the command exceeds its limits */
    int wrench_saturated;
    int bottom_touched;
} Flags;

typedef struct {
    State rate;                  /* time derivative of the state */
    double thrust[N_THRUSTERS];  /* present forces, N */
    double wrench[6];            /* of all actuators, body frame */
    double euler[3];             /* roll, pitch, yaw */
    double water[3];             /* m/s, world frame */
    double altitude;             /* m */
    double measured[N_MEASURED];
    double stamp[N_SENSORS];     /* s, time of each sensor's sample */
    Flags flags;
} Outputs;

typedef struct {
    double force[3], moment[3]; /* N, N m */
    double point[3];            /* m, body frame: where the force acts */
} Load;

typedef struct { /* effects of other components, see coupling.h; doubles only */
    double supply_voltage;                 /* V, of thrusters commanded by pulses or revolutions */
    double current[3], current_rate[3];    /* m/s, m/s2, world frame, added to that of the parameters */
    Load world, body;                      /* in the world and in the body frame */
    double thrust_normalized[N_THRUSTERS]; /* -1 to 1, of the thrusters' limits */
    double thrust_pulse[N_THRUSTERS];      /* us, 0: none */
    double thrust_rpm[N_THRUSTERS];        /* rev/min, signed as the force */
    double thrust_failure[N_THRUSTERS];    /* lost fraction of the force */
    double outage[N_SENSORS];              /* lower bound of the probability that a sample is lost */
} Coupling;

typedef struct {
    Plant plant;
    State state;
    Held held;
    Inputs inputs;
    Coupling coupling;
    Outputs outputs;
    double time;
    double stop_time; /* INFINITY: none */
} Model; /* plain data: the whole FMU state */

/* Updates constants and clocks from the parameters. Returns NULL, or a message on invalid parameters. */
const char *model_prepare(Model *model);

/* Computes the outputs. */
void model_evaluate(Model *model);

/* Computes the forces of the actuators alone: `thrust` and `wrench` of the outputs. */
void model_evaluate_forces(Model *model);

/* Returns the time of the next tick of any clock; INFINITY: none runs. */
double model_next_tick(const Model *model);

/* Takes and delivers the samples that are due, and draws the current's next knot. Returns 1 if anything was due. */
int model_tick(Model *model);

/* Returns 1 if a measured channel shows its last sample; without a rate, or before the first sample, it shows the truth. */
int model_shows_sample(const Model *model, int channel);

/* Sets the forces without a lag to their commands. Returns 1 if any changed. */
int model_apply_unlagged(Model *model);

/* Integrates to the time `end`, with whole substeps from tick to tick; if `stops`, at most until a sample is delivered.
 * Returns 0 if a substep is unstable, and writes its length [s] to `failed`; the model is then left where it failed. */
int model_advance(Model *model, double end, int stops, double *failed);

/* Writes the exact directional derivative of state and outputs to `tangent`, along the parameters, state, inputs and time in
 * `seed`. Random numbers stay as drawn. Samples follow the state while `starting`, and are held afterwards. */
void model_tangent(const Model *model, const Model *seed, int starting, Model *tangent);

#endif
