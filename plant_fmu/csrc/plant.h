/* Rigid underwater vehicle after Fossen, six degrees of freedom, with its actuators and its water.
 *
 * World frame NED (z is depth), body frame x forward, y right, z down, unit quaternion scalar first, rotating body
 * vectors into the world. Velocities are over ground, in the body frame. SI units everywhere.
 *
 *     M_RB v' + C_RB(v) v + M_A v_r' + C_A(v_r) v_r + D_l v_r + D_q |v_r| v_r + g(eta) = tau            (11)
 *
 * with v_r = v - [R^T v_c; 0], the motion through water that moves at v_c and is taken as uniform around the hull.
 * Nothing here knows of FMI, and nothing keeps anything between calls. What a step needs is written with Real, so that it
 * also compiles for several vehicles side by side; the rest is for one. Functions named _tangent give exact directional
 * derivatives by the rules of calculus: dx is the tangent of x, and a struct has its tangent in a struct of the same
 * type. At a kink theirs is the branch that the function itself takes. */
#ifndef PLANT_H
#define PLANT_H

#include "real.h"
#include "vehicle.h" /* generated: N_THRUSTERS and the table of variables */

enum { N_RIGID = 13 };                        /* position 3, quaternion 4, velocity 6 */
enum { N_STATES = N_RIGID + N_THRUSTERS + 6 };/* and the lagging forces */

enum { DEPTH_SENSOR, DVL, IMU, COMPASS, USBL, N_SENSORS };

enum { /* what the sensors measure, channel by channel */
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
    Real mass;                               /* kg */
    Real inertia[6];                         /* kg m2, about the body origin: elements xx yy zz xy xz yz */
    Real r_G[3], r_B[3];                     /* m, centres of gravity and of buoyancy */
    Real weight, buoyancy;                   /* N */
    Real added_mass[6][6];                   /* of which the upper triangle is given */
    Real linear_damping[6];                  /* N s/m, N m s/rad */
    Real quadratic_damping[6];               /* N s2/m2, N m s2/rad2 */

    Real current[3];                         /* m/s, world frame, at the surface */
    Real current_shear[3];                   /* 1/s, its growth with depth */
    Real current_variation[3];               /* m/s, standard deviation of its Gauss-Markov part */
    Real current_correlation_time;           /* s */
    Real current_variation_period;           /* s, between the knots of that part */
    Real hull_radius;                        /* m, of a sphere: about r_B for the surface, about the origin for the bottom */
    Real bottom_depth;                       /* m */
    Real bottom_friction;                    /* Coulomb's coefficient */
    Real bottom_time_constant;               /* s, in which the bottom stops the hull */
    Real gravity;                            /* m/s2, as an accelerometer feels it */
    Mask free_surface;                       /* buoyancy fades where the hull leaves the water */

    Real thruster_matrix[6][N_THRUSTERS];    /* body wrench of one newton of each thruster */
    Real thrust_min[N_THRUSTERS];            /* N, most negative force */
    Real thrust_max[N_THRUSTERS];            /* N */
    Real thrust_time_constant[N_THRUSTERS];  /* s, 0: no lag */
    Real thrust_rate_limit[N_THRUSTERS];     /* N/s, 0: none */
    Real thrust_dead_band[N_THRUSTERS];      /* part of the command's range that gives no force */
    Real thrust_curve[N_THRUSTERS];          /* from 0, force linear in the command, to 1, quadratic */
    Real thrust_effectiveness[N_THRUSTERS];  /* 1: whole, 0: failed */
    Real wrench_force_limit;                 /* N, on the norm of the direct force; its direction is kept */
    Real wrench_time_constant;               /* s, 0: no lag */

    Real sensor_rate[N_SENSORS];             /* Hz, 0: continuous and without noise */
    Real noise[N_NOISES];                    /* standard deviations, in the channel's unit */
    Real bias[N_MEASURED];
    Real velocity_scale_error;               /* of the DVL: part of the velocity that it measures too much */
    Real delay[N_SENSORS];                   /* s, from a sample to its delivery */
    Real loss_probability[N_SENSORS];        /* of each sample */
    Real outlier_probability[N_SENSORS];     /* of each sample */
    Real outlier_scale;                      /* standard deviation of an outlier, over that of the noise */
    int seed;                                /* of all noise and of the current's variation */
    Real substep;                            /* s, greatest integration step */
} Parameters;

typedef struct { /* constants that follow from the parameters */
    Real added_mass[6][6];         /* M_A, whole */
    Real mass_matrix[6][6];        /* M_RB + M_A */
    Real mass_inverse[6][6];
    Real contact_mass;             /* kg, at most what a force on the origin moves, in any direction */
    Real contact_time;             /* s, bottom_time_constant, or what the substep can follow */
    Real swing;                    /* rad/s, at most what weight, buoyancy and surface make the body oscillate at */
    Real thrust_lag[N_THRUSTERS];  /* s, in which thrusters follow their commands; 0: at once */
    Real wrench_lag;               /* s, in which the wrench does */
    int lags;                      /* whether any force follows its command with a delay */
    int water_moves;               /* whether there may be a current */
    int stiffest;                  /* row of mass_inverse that tells contact_mass */
} Derived;

typedef struct {
    Real thrust[N_THRUSTERS]; /* N, commands */
    Real wrench[6];           /* N, N m, commands in the body frame */
} Inputs;

typedef struct {
    Real thrust[N_THRUSTERS];
    Real wrench[6];
} Actuators; /* forces: where the limited commands point, or what is there now */

typedef struct {
    Real rigid[N_RIGID];
    Actuators actuators; /* of those that lag; the others follow their command */
} State;

typedef struct { /* the current's Gauss-Markov part between two knots: value + slope (t - since) */
    double since, until;
    Real value[3], slope[3];
    Real deviation[3]; /* that the axis goes by; 0: it stands still */
} Drift;

typedef struct { /* what other components do to the body, beside its actuators */
    int acts;             /* 0: nothing */
    double since;         /* s, when the current was what the parameters say */
    Real current_rate[3]; /* m/s2, world frame */
    Real force[3], moment[3], point[3]; /* N, N m, world frame, at a point of the body [m], body frame */
    Real wrench[6];       /* N, N m, body frame, about the origin */
} External;

typedef struct {
    Parameters parameters;
    Derived derived;
    External external;
} Plant;

/* ---- constants.c: what follows from the parameters ---- */

/* Computes the derived constants. Returns NULL, or what is wrong with the parameters. */
const char *plant_prepare(Plant *plant);

/* M_RB + M_A. */
void plant_mass_matrix(const Parameters *parameters, double M[6][6]);

/* ---- plant.c: the rigid body in water ---- */

#define CONTACT_SUBSTEPS 4.0 /* in which the bottom may stop the hull: far from where integration fails */

#define LEAST_QUATERNION 1e-6 /* length below which a quaternion has no direction */

/* Scales the quaternion to unit length. False, and nothing changed, if it has none to scale, or is not finite. */
Mask plant_normalise(Real rigid[N_RIGID]);

/* Rotation from body to world (3); a quaternion off unit length still gives a pure rotation, and none at all identity. */
void plant_rotation(const Real quaternion[4], Real R[3][3]);

/* Time derivative of the rigid-body state under the body wrench tau. */
void plant_derivative(const Plant *plant, const Drift *drift, double time, const Real rigid[N_RIGID],
                      const Real tau[6], Real rate[N_RIGID]);

/* Advances the state from `start` to `end` with Runge-Kutta steps of order four, all of one length h, at most `substep`,
 * the commands being held and met at `target`. False if the state has no numbers, or steps of h cannot follow its damping,
 * swinging and turning, where results may still look well; the state is then worth nothing. */
Mask plant_advance(const Plant *plant, const Drift *drift, double start, double end, double substep,
                   const Actuators *target, State *state, double *h);

/* ---- environment.c ---- */

/* Velocity of the water at a depth, world frame. */
void environment_current(const Parameters *parameters, const Drift *drift, double time, Real depth, Real velocity[3]);

/* Part of the hull's volume that is under water, 0 to 1; depth is that of its centre, r_B. */
Real environment_submerged(const Parameters *parameters, Real depth);

/* How deep the hull is in the bottom; negative above it. */
Real environment_sunk(const Parameters *parameters, Real depth);

/* What the spring of the bottom yields to, so that a hull found deep in it leaves at some 2 m/s: half the force at depth
 * x1, which never is less than what holds 50 m/s2. */
Real environment_softening(Real contact_time);

/* Force of the bottom on a hull that is that deep in it, world frame: zero where it is not. */
void environment_contact(const Plant *plant, Real sunk, const Real velocity_world[3], Real force[3]);

double environment_submerged_tangent(const Parameters *parameters, const Parameters *dparameters, double depth,
                                     double ddepth);

/* Of the force, where they touch; dM is the tangent of the mass matrix. */
void environment_contact_tangent(const Plant *plant, const Parameters *dparameters, const double dM[6][6], double depth,
                                 double ddepth, const double velocity_world[3], const double dvelocity_world[3],
                                 double dforce[3]);

/* ---- actuators.c ---- */

/* The forces that the commands ask for once lags are over: limited, and after the thrusters' curves. Sets the flags of
 * what was cut. */
void actuators_target(const Parameters *parameters, const Inputs *inputs, Actuators *target,
                      Mask thrust_cut[N_THRUSTERS], Mask *wrench_cut);

#define LEAST_RATE_LAG 1e-3 /* s: time constant, at the least, of a thruster with a rate limit */

/* Time constants of thruster i and of the wrench, 0 where they follow their command at once. */
Real actuators_thrust_lag(const Parameters *parameters, int i);
Real actuators_wrench_lag(const Parameters *parameters);

/* The forces that are there once those without a lag follow their commands. */
void actuators_settle(const Plant *plant, const Actuators *start, const Actuators *target, Actuators *out);

/* The forces a time dt after `start` while they head for `target`: exact for lag and rate limit. */
void actuators_after(const Plant *plant, const Actuators *start, const Actuators *target, double dt, Actuators *out);

/* The rate at which they change, 0 for those without a lag. */
void actuators_rate(const Plant *plant, const Actuators *now, const Actuators *target, Actuators *rate);

/* The wrench that all actuators together put on the body. */
void actuators_wrench(const Parameters *parameters, const Actuators *now, Real tau[6]);

/* Of the rates, of the present forces and of their wrench. */
void actuators_tangent(const Parameters *parameters, const Parameters *dparameters, const Inputs *inputs,
                       const Inputs *dinputs, const Actuators *now, const Actuators *dnow, Actuators *drate,
                       Actuators *dforce, double dtau[6]);

/* ---- sensors.c ---- */

/* What sensors without noise and delay would measure, biases included. */
void sensors_measure(const Parameters *parameters, const double rigid[N_RIGID], const double rate[N_RIGID],
                     double heading, double altitude, double measured[N_MEASURED]);

/* Makes the sample number `count` of one sensor: what is measured now, with noise. False if it is lost; nothing is then
 * changed. Numbers that do not belong to the sensor stay. */
int sensors_sample(const Parameters *parameters, int sensor, unsigned long long count,
                   const double measured[N_MEASURED], double sample[N_MEASURED]);

/* Which sensor a channel belongs to. */
int sensors_of_channel(int channel);

/* ---- random.c ---- */

/* Streams of random numbers: noise of each channel, three of the current's knots and three of its beginning, then chances. */
enum { CURRENT_STREAM = N_MEASURED, CHANCE_STREAM = CURRENT_STREAM + 6 };

/* Two independent numbers, uniform in [0, 1), at a place of a seeded stream. */
void random_uniform(int seed, unsigned stream, unsigned long long count, double out[2]);

/* The standard normal number at a place of a seeded stream: the same at every call (Philox 4x32-10, Box-Muller). */
double random_normal(int seed, unsigned stream, unsigned long long count);

#endif
