/* Rigid underwater vehicle after Fossen, six degrees of freedom.
 *
 * World frame NED (z is depth), body frame x forward, y right, z down, unit quaternion scalar first, rotating body
 * vectors into the world. Velocities are over ground, in the body frame. SI units everywhere.
 *
 *     M_RB v' + C_RB(v) v + M_A v_r' + C_A(v_r) v_r + D_l v_r + D_q |v_r| v_r + g(eta) = tau            (11)
 *
 * with v_r = v - [R^T v_c; 0] for a constant irrotational current v_c. Nothing here knows of FMI. */
#ifndef PLANT_H
#define PLANT_H

#include "vehicle.h" /* generated: N_THRUSTERS and the table of variables */

enum { N_RIGID = 13 }; /* position 3, quaternion 4, velocity 6 */

typedef struct {
    double mass;                             /* kg */
    double inertia[6];                       /* kg m2, about the body origin: elements xx yy zz xy xz yz */
    double r_G[3], r_B[3];                   /* m, centres of gravity and of buoyancy */
    double weight, buoyancy;                 /* N */
    double added_mass[6][6];                 /* the upper triangle is given; plant_prepare mirrors it */
    double linear_damping[6];                /* N s/m, N m s/rad */
    double quadratic_damping[6];             /* N s2/m2, N m s2/rad2 */
    double current[3];                       /* m/s, world frame */
    double thruster_matrix[6][N_THRUSTERS];  /* body wrench of one newton of each thruster */
    double thrust_min[N_THRUSTERS];          /* N, most negative force */
    double thrust_max[N_THRUSTERS];          /* N */
    double thrust_time_constant[N_THRUSTERS];/* s, 0: no lag */
    double wrench_force_limit;               /* N, on the norm of the direct force; its direction is kept */
    double wrench_time_constant;             /* s, 0: no lag */
    double substep;                          /* s, greatest integration step */
} Parameters;

typedef struct { /* constants that follow from the parameters */
    double mass_inverse[6][6]; /* of M_RB + M_A */
} Derived;

typedef struct {
    double thrust[N_THRUSTERS]; /* N, commands */
    double wrench[6];           /* N, N m, commands in the body frame */
} Inputs;

typedef struct {
    double thrust[N_THRUSTERS];
    double wrench[6];
} Actuators; /* forces: where the limited commands point, or what is there now */

typedef struct {
    double rigid[N_RIGID];
    Actuators actuators;
} State;

typedef struct {
    Parameters parameters;
    Derived derived;
} Plant;

/* Computes the derived constants. Returns NULL, or what is wrong with the parameters. */
const char *plant_prepare(Plant *plant);

/* Scales the quaternion to unit length. Returns 0 if it has none to scale, or is not finite. */
int plant_normalise(double rigid[N_RIGID]);

/* A bound of the fastest rate at which damping now makes a velocity decay, 1/s: what limits the integration's step. */
double plant_damping_rate(const Plant *plant, const double rigid[N_RIGID]);

/* Time derivative of the rigid-body state under the body wrench tau. */
void plant_derivative(const Plant *plant, const double rigid[N_RIGID], const double tau[6], double rate[N_RIGID]);

/* The commands within their limits. Sets the flags of what was cut. */
void plant_limit(const Plant *plant, const Inputs *inputs, Actuators *target, int thrust_cut[N_THRUSTERS],
                 int *wrench_cut);

/* The forces a time dt after `start` while they head for `target`: exact for the first-order lag. */
void plant_lag(const Plant *plant, const Actuators *start, const Actuators *target, double dt, Actuators *out);

/* The wrench that all actuators together put on the body. */
void plant_wrench(const Plant *plant, const Actuators *actuators, double tau[6]);

/* Advances the state by h with one Runge-Kutta step of order four, the commands being held. Returns 0 if the state has
 * no numbers, or h is beyond what the integration can follow. */
int plant_step(const Plant *plant, const Actuators *target, double h, State *state);

/* Roll, pitch, yaw (zyx) of a quaternion. */
void plant_euler(const double quaternion[4], double euler[3]);

#endif
