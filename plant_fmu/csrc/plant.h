/* Rigid underwater vehicle after Fossen, six degrees of freedom, with its actuators and its water.
 *
 * World frame NED (z is depth), body frame x forward, y right, z down, unit quaternion scalar first, rotating body
 * vectors into the world. Velocities are over ground, in the body frame. SI units everywhere.
 *
 *     M_RB v' + C_RB(v) v + M_A v_r' + C_A(v_r) v_r + D_l v_r + D_q |v_r| v_r + g(eta) = tau            (11)
 *
 * with v_r = v - [R^T v_c; 0], the motion through water that moves at v_c, assumed uniform around the hull.
 * These functions do not depend on FMI, and keep no state between calls. Functions named _tangent give exact
 * directional derivatives: dx is the tangent of x, and a struct has its tangent in a struct of the same type. At a kink
 * they take the branch of the function itself. */
#ifndef PLANT_H
#define PLANT_H

#include <math.h>

#include "vehicle.h" /* generated: N_THRUSTERS and the table of variables */

enum { N_RIGID = 13 };                        /* position 3, quaternion 4, velocity 6 */
enum { N_STATES = N_RIGID + N_THRUSTERS + 6 };/* and the forces with a lag */

enum { DEPTH_SENSOR, DVL, IMU, COMPASS, USBL, N_SENSORS };

enum { /* channels of the sensors */
    MEASURED_DEPTH,
    MEASURED_VELOCITY,
    MEASURED_ALTITUDE = MEASURED_VELOCITY + 3,
    MEASURED_ACCELERATION,
    MEASURED_ANGULAR_VELOCITY = MEASURED_ACCELERATION + 3,
    MEASURED_HEADING = MEASURED_ANGULAR_VELOCITY + 3,
    MEASURED_POSITION,
    N_MEASURED = MEASURED_POSITION + 3
};

enum { /* standard deviations: several channels share one */
    DEPTH_NOISE,
    VELOCITY_NOISE,
    ALTITUDE_NOISE,
    ACCELERATION_NOISE,
    ANGULAR_VELOCITY_NOISE,
    HEADING_NOISE,
    POSITION_NOISE,
    N_NOISES
};

typedef struct {
    double mass;                               /* kg */
    double inertia[6];                         /* kg m2, about the body origin: elements xx yy zz xy xz yz */
    double r_G[3], r_B[3];                     /* m, centers of gravity and of buoyancy */
    double weight, buoyancy;                   /* N */
    double trim[6];                            /* N, N m: constant wrench on the body */
    double added_mass[6][6];                   /* upper triangle */
    double linear_damping[6];                  /* N s/m, N m s/rad */
    double quadratic_damping[6];               /* N s2/m2, N m s2/rad2 */

    double current[3];                         /* m/s, world frame, at the surface */
    double current_shear[3];                   /* 1/s, its derivative by depth */
    double current_variation[3];               /* m/s, standard deviation of its Gauss-Markov part */
    double current_correlation_time;           /* s */
    double current_variation_period;           /* s, between the knots of that part */
    double hull_radius;                        /* m, of a sphere about r_B for the surface, about the origin for the bottom */
    double bottom_depth;                       /* m */
    double bottom_friction;                    /* Coulomb's coefficient */
    double bottom_time_constant;               /* s, in which the bottom stops the hull */
    double gravity;                            /* m/s2, as an accelerometer senses it */
    int free_surface;                          /* true: buoyancy fades as the hull leaves the water */

    double thruster_matrix[6][N_THRUSTERS];    /* body wrench of one newton of each thruster */
    double thrust_min[N_THRUSTERS];            /* N, most negative force */
    double thrust_max[N_THRUSTERS];            /* N */
    double thrust_time_constant[N_THRUSTERS];  /* s, 0: no lag */
    double thrust_rate_limit[N_THRUSTERS];     /* N/s, 0: none */
    double thrust_dead_band[N_THRUSTERS];      /* fraction of the command's range without force */
    double thrust_curve[N_THRUSTERS];          /* from 0, force linear in the command, to 1, quadratic */
    double thrust_effectiveness[N_THRUSTERS];  /* 1: full, 0: failed */
    double wrench_force_limit;                 /* N, on the norm of the direct force; its direction is kept */
    double wrench_time_constant;               /* s, 0: no lag */

    double sensor_rate[N_SENSORS];             /* Hz, 0: continuous and without noise */
    double noise[N_NOISES];                    /* standard deviations, in the channel's unit */
    double bias[N_MEASURED];
    double r_DVL[3];                           /* m, position of the DVL */
    double velocity_scale_error;               /* of the DVL, as a fraction of the velocity */
    double delay[N_SENSORS];                   /* s, from a sample to its delivery */
    double loss_probability[N_SENSORS];        /* of each sample */
    double outlier_probability[N_SENSORS];     /* of each sample */
    double outlier_scale;                      /* standard deviation of an outlier, as a multiple of that of the noise */
    int seed;                                  /* of all noise and of the current's variation */
    double substep;                            /* s, greatest integration step */
} Parameters;

typedef struct { /* constants that follow from the parameters */
    double added_mass[6][6];         /* M_A, both triangles */
    double mass_matrix[6][6];        /* M_RB + M_A */
    double mass_inverse[6][6];
    double contact_mass;             /* kg, lower bound of the mass that a force at the origin accelerates, in any direction */
    double contact_time;             /* s, bottom_time_constant, but not below the limit of the substep */
    double max_oscillation;          /* rad/s, upper bound of the oscillation by weight, buoyancy and surface */
    double thruster_wrench[N_THRUSTERS][6]; /* thruster_matrix by thruster, so that its wrench is contiguous in memory */
    double thrust_lag[N_THRUSTERS];  /* s, time constants of the thrusters; 0: no lag */
    double wrench_lag;               /* s, time constant of the direct wrench */
    int has_lag;                     /* true: some force follows its command with a lag */
    int has_current;                 /* true: the water may move */
    int contact_mass_row;            /* row of mass_inverse that gives contact_mass */
} Derived;

typedef struct {
    double thrust[N_THRUSTERS]; /* N, commands */
    double wrench[6];           /* N, N m, commands in the body frame */
} Inputs;

typedef struct {
    double thrust[N_THRUSTERS];
    double wrench[6];
} Actuators; /* forces: of the limited commands, or present ones */

typedef struct {
    double rigid[N_RIGID];
    Actuators actuators; /* only those with a lag are states; the others equal their command */
} State;

typedef struct { /* the current's Gauss-Markov part between two knots: value + slope (t - since) */
    double since, until;
    double value[3], slope[3];
    double deviation[3]; /* of the axis; 0: constant */
} Drift;

typedef struct { /* effects of other components on the body, beside its actuators */
    int active;           /* 0: nothing */
    double since;         /* s, time at which the current equals that of the parameters */
    double current_rate[3]; /* m/s2, world frame */
    double force[3], moment[3], point[3]; /* N, N m, world frame, at a point of the body [m], body frame */
    double wrench[6];       /* N, N m, body frame, about the origin */
} External;

typedef struct {
    Parameters parameters;
    Derived derived;
    External external;
} Plant;

/* ---- constants.c: what follows from the parameters ---- */

/* Computes the derived constants. Returns NULL, or a message on invalid parameters. */
const char *plant_prepare(Plant *plant);

/* M_RB + M_A. */
void plant_mass_matrix(const Parameters *parameters, double M[6][6]);

/* ---- plant.c: the rigid body in water ---- */

#define CONTACT_SUBSTEPS 4.0 /* minimum of bottom_time_constant, in substeps: far from instability */

#define MIN_QUATERNION_NORM 1e-6 /* norm below which a quaternion has no direction */

/* Scales the quaternion to unit length. Returns false, and changes nothing, if its length is 0 or not finite. */
int plant_normalize(double rigid[N_RIGID]);

/* Writes the rotation from body to world (3), for a quaternion of any norm; the identity for norm 0. */
void plant_rotation(const double quaternion[4], double R[3][3]);

/* Writes the time derivative of the rigid-body state under the body wrench tau. */
void plant_derivative(const Plant *plant, const Drift *drift, double time, const double rigid[N_RIGID],
                      const double tau[6], double rate[N_RIGID]);

/* Advances the state from `start` to `end` by fourth-order Runge-Kutta steps of equal length h, at most `substep`, while the
 * actuators move to `target`. Returns false, and leaves an invalid state, if the state is not finite or steps of h are
 * unstable for damping, oscillation or rotation, where results may still look plausible. */
int plant_advance(const Plant *plant, const Drift *drift, double start, double end, double substep,
                   const Actuators *target, State *state, double *h);

/* ---- environment.c ---- */

/* Writes the velocity of the water at a depth, world frame. */
void environment_current(const Parameters *parameters, const Drift *drift, double time, double depth, double velocity[3]);

/* Returns the submerged fraction of the hull's volume, 0 to 1; depth is that of its center, r_B. */
double environment_submerged(const Parameters *parameters, double depth);

/* Returns how deep the hull has penetrated the bottom; negative above it. */
double environment_penetration(const Parameters *parameters, double depth);

/* Returns the penetration x1 at which the bottom's spring has half the force of a linear one: a hull that starts deep in
 * the bottom leaves at about 2 m/s. The spring's force tends to x1 / T^2 per mass, at least 50 m/s2. */
double environment_softening_depth(double contact_time);

/* Writes the force of the bottom on the hull, world frame: zero without contact. */
void environment_contact(const Plant *plant, double penetration, const double velocity_world[3], double force[3]);

double environment_submerged_tangent(const Parameters *parameters, const Parameters *dparameters, double depth,
                                     double ddepth);

/* Writes the tangent of the force in contact; dM is the tangent of the mass matrix. */
void environment_contact_tangent(const Plant *plant, const Parameters *dparameters, const double dM[6][6], double depth,
                                 double ddepth, const double velocity_world[3], const double dvelocity_world[3],
                                 double dforce[3]);

/* ---- actuators.c ---- */

/* Writes the steady forces of the commands: limited, and after the thrusters' curves. Sets the flags of limited
 * commands. */
void actuators_target(const Parameters *parameters, const Inputs *inputs, Actuators *target,
                      int thrust_saturated[N_THRUSTERS], int *wrench_saturated);

#define MIN_RATE_LAG 1e-3 /* s: minimum time constant of a thruster with a rate limit */

/* Return the time constants of thruster i and of the direct wrench; 0: no lag. */
double actuators_thrust_lag(const Parameters *parameters, int i);
double actuators_wrench_lag(const Parameters *parameters);

/* Writes the forces, with those without a lag set to their commands. */
void actuators_apply_unlagged(const Plant *plant, const Actuators *start, const Actuators *target, Actuators *out);

/* Writes the forces a time dt after `start`, as they approach `target`: exact for lag and rate limit. */
void actuators_advance(const Plant *plant, const Actuators *start, const Actuators *target, double dt, Actuators *out);

/* Writes the rates of change of the forces, 0 for those without a lag. */
void actuators_rate(const Plant *plant, const Actuators *now, const Actuators *target, Actuators *rate);

/* Writes the body wrench of all actuators. */
void actuators_wrench(const Plant *plant, const Actuators *now, double tau[6]);

/* Writes the tangents of the rates, of the present forces and of their wrench. */
void actuators_tangent(const Parameters *parameters, const Parameters *dparameters, const Inputs *inputs,
                       const Inputs *dinputs, const Actuators *now, const Actuators *dnow, Actuators *drate,
                       Actuators *dforce, double dtau[6]);

/* ---- sensors.c ---- */

/* Writes the measurements without noise and delay, but with biases. */
void sensors_measure(const Parameters *parameters, const double rigid[N_RIGID], const double rate[N_RIGID],
                     double heading, double altitude, double measured[N_MEASURED]);

/* Writes sample number `count` of one sensor, with noise; channels of other sensors stay. Returns false, and changes
 * nothing, if the sample is lost. */
int sensors_sample(const Parameters *parameters, int sensor, unsigned long long count,
                   const double measured[N_MEASURED], double sample[N_MEASURED]);

/* Returns the sensor of a channel. */
int sensors_of_channel(int channel);

/* Streams of random numbers: noise of each channel, three of the current's knots, three of its first knot, then chances. */
enum { CURRENT_STREAM = N_MEASURED, CHANCE_STREAM = CURRENT_STREAM + 6 };

#endif
