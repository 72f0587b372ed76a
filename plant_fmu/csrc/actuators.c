/* What stands between commands and the body: limits, lag, and where each force acts. */
#include "plant.h"

#include <math.h>

void plant_limit(const Plant *plant, const Inputs *inputs, Actuators *target, int thrust_cut[N_THRUSTERS],
                 int *wrench_cut)
{
    const Parameters *p = &plant->parameters;
    const double *w = inputs->wrench;

    for (int i = 0; i < N_THRUSTERS; i++) {
        target->thrust[i] = fmin(fmax(inputs->thrust[i], p->thrust_min[i]), p->thrust_max[i]);
        thrust_cut[i] = target->thrust[i] != inputs->thrust[i];
    }

    const double norm = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    *wrench_cut = norm > p->wrench_force_limit;
    const double scale = *wrench_cut ? p->wrench_force_limit / norm : 1.0;
    for (int i = 0; i < 3; i++) {
        target->wrench[i] = scale * w[i];
        target->wrench[3 + i] = w[3 + i];
    }
}

static double lag(double from, double to, double dt, double time_constant)
{
    return time_constant > 0.0 ? from - (to - from) * expm1(-dt / time_constant) : to;
}

void plant_lag(const Plant *plant, const Actuators *start, const Actuators *target, double dt, Actuators *out)
{
    const Parameters *p = &plant->parameters;

    for (int i = 0; i < N_THRUSTERS; i++)
        out->thrust[i] = lag(start->thrust[i], target->thrust[i], dt, p->thrust_time_constant[i]);
    for (int i = 0; i < 6; i++)
        out->wrench[i] = lag(start->wrench[i], target->wrench[i], dt, p->wrench_time_constant);
}

void plant_wrench(const Plant *plant, const Actuators *actuators, double tau[6])
{
    for (int i = 0; i < 6; i++) {
        tau[i] = actuators->wrench[i];
        for (int j = 0; j < N_THRUSTERS; j++)
            tau[i] += plant->parameters.thruster_matrix[i][j] * actuators->thrust[j];
    }
}
