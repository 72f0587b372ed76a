/* Sensors of the vehicle: truth, bias, and noise at each sample. */
#include "plant.h"

#include <math.h>

#include "linear.h"
#include "random.h"

static const int SENSOR[N_MEASURED] = {DEPTH_SENSOR, DVL,     DVL,  DVL,  DVL,  IMU, IMU, IMU,
                                       IMU,          IMU,     IMU,  COMPASS, USBL, USBL, USBL};
static const int NOISE[N_MEASURED] = {
    DEPTH_NOISE,        VELOCITY_NOISE,         VELOCITY_NOISE,         VELOCITY_NOISE,         ALTITUDE_NOISE,
    ACCELERATION_NOISE, ACCELERATION_NOISE,     ACCELERATION_NOISE,     ANGULAR_VELOCITY_NOISE, ANGULAR_VELOCITY_NOISE,
    ANGULAR_VELOCITY_NOISE, HEADING_NOISE,      POSITION_NOISE,         POSITION_NOISE,         POSITION_NOISE};

static const double TURN = 6.283185307179586;

int sensors_of_channel(int channel)
{
    return SENSOR[channel];
}

void sensors_measure(const Parameters *p, const double rigid[N_RIGID], const double rate[N_RIGID], double heading,
                     double altitude, double measured[N_MEASURED])
{
    const double *nu = rigid + 7, *omega = rigid + 10;
    double R[3][3], turning[3], lever_velocity[3];

    plant_rotation(rigid + 3, R);
    cross(omega, nu, turning);
    cross(omega, p->r_DVL, lever_velocity);
    measured[MEASURED_DEPTH] = rigid[2];
    measured[MEASURED_ALTITUDE] = altitude;
    measured[MEASURED_HEADING] = heading;
    for (int i = 0; i < 3; i++) {
        measured[MEASURED_VELOCITY + i] = (1.0 + p->velocity_scale_error) * (nu[i] + lever_velocity[i]);
        /* specific force: acceleration less gravity, v' + w x v - g R^T e3 */
        measured[MEASURED_ACCELERATION + i] = rate[7 + i] + turning[i] - p->gravity * R[2][i];
        measured[MEASURED_ANGULAR_VELOCITY + i] = omega[i];
        measured[MEASURED_POSITION + i] = rigid[i];
    }
    for (int i = 0; i < N_MEASURED; i++)
        measured[i] += p->bias[i];
    measured[MEASURED_HEADING] = remainder(measured[MEASURED_HEADING], TURN);
}

int sensors_sample(const Parameters *p, int sensor, unsigned long long count, const double measured[N_MEASURED],
                   double sample[N_MEASURED])
{
    double chance[2], scale = 1.0;

    if (p->loss_probability[sensor] > 0.0 || p->outlier_probability[sensor] > 0.0) {
        random_uniform(p->seed, CHANCE_STREAM + (unsigned)sensor, count, chance);
        if (chance[0] < p->loss_probability[sensor])
            return 0;
        if (chance[1] < p->outlier_probability[sensor])
            scale = p->outlier_scale;
    }
    for (int i = 0; i < N_MEASURED; i++)
        if (SENSOR[i] == sensor) {
            const double deviation = scale * p->noise[NOISE[i]];
            sample[i] = measured[i] + (deviation > 0.0 ? deviation * random_normal(p->seed, (unsigned)i, count) : 0.0);
        }
    if (sensor == COMPASS)
        sample[MEASURED_HEADING] = remainder(sample[MEASURED_HEADING], TURN);
    return 1;
}
