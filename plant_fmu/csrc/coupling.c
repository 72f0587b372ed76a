/* See coupling.h. */
#include "coupling.h"

#include <math.h>
#include <string.h>

#include "linear.h"
#include "t200.h" /* generated: the published forces */

static const double LEAST_PULSE = 1100.0, MOST_PULSE = 1900.0; /* us */

/* Force [N] of a T200 at a pulse [us] and a supply voltage [V], linear between the published points, and its derivatives
   by the two: at a published point, those from below. */
static double force_of_pulse(double pulse, double voltage, double *of_pulse, double *of_voltage)
{
    const double x = fmin(fmax(pulse, LEAST_PULSE), MOST_PULSE), u = (voltage - T200_FIRST_VOLTAGE) / T200_VOLTAGE_STEP;
    int i = 0, row = 0;

    while (x > T200_PULSES[i + 1]) /* whose last is MOST_PULSE */
        i++;
    while (u > row + 1.0) /* no voltage outside the published ones is accepted */
        row++;
    const double part = (x - T200_PULSES[i]) / (T200_PULSES[i + 1] - T200_PULSES[i]);
    const double share = u - row;
    const double *low = T200_FORCES[row] + i, *high = T200_FORCES[row + 1] + i;
    const double at_low = low[0] + part * (low[1] - low[0]), at_high = high[0] + part * (high[1] - high[0]);

    *of_pulse = pulse == x ? (low[1] - low[0] + share * (high[1] - high[0] - (low[1] - low[0]))) /
                                 (T200_PULSES[i + 1] - T200_PULSES[i])
                           : 0.0;
    *of_voltage = (at_high - at_low) / T200_VOLTAGE_STEP;
    return at_low + share * (at_high - at_low);
}

bool coupling_acts(const Model *m)
{
    const double *numbers = (const double *)&m->coupling;

    if (!COUPLED)
        return false;
    for (size_t i = 1; i < sizeof m->coupling / sizeof(double); i++) /* the first is the voltage, which does nothing alone */
        if (numbers[i] != 0.0)
            return true;
    return false;
}

/* Adds what the external wrenches come to: the one in the body frame as it is, the one in the world frame about the origin. */
static void add_external(const Coupling *c, External *external)
{
    double lever[3];

    memcpy(external->force, c->world.force, sizeof external->force);
    memcpy(external->moment, c->world.moment, sizeof external->moment);
    memcpy(external->point, c->world.point, sizeof external->point);
    cross(c->body.point, c->body.force, lever);
    for (int i = 0; i < 3; i++) {
        external->wrench[i] = c->body.force[i];
        external->wrench[3 + i] = c->body.moment[i] + lever[i];
    }
}

void coupling_apply(const Model *m, Model *out)
{
    const Coupling *c = &m->coupling;
    Parameters *p = &out->plant.parameters;
    double of_pulse, of_voltage;

    *out = *m;
    if (!COUPLED)
        return;
    for (int i = 0; i < 3; i++) {
        p->current[i] += c->current[i];
        out->plant.external.current_rate[i] = c->current_rate[i];
    }
    out->plant.external.acts = 1;
    out->plant.external.since = m->time;
    out->plant.derived.water_moves = 1;
    add_external(c, &out->plant.external);
    for (int i = 0; i < N_THRUSTERS; i++) {
        const double share = c->thrust_normalized[i];
        out->inputs.thrust[i] += share < 0.0 ? -share * p->thrust_min[i] : share * p->thrust_max[i];
        if (c->thrust_pulse[i] > 0.0)
            out->inputs.thrust[i] += force_of_pulse(c->thrust_pulse[i], c->supply_voltage, &of_pulse, &of_voltage);
        p->thrust_effectiveness[i] *= 1.0 - c->thrust_failure[i];
    }
    for (int i = 0; i < N_SENSORS; i++)
        p->loss_probability[i] = fmax(p->loss_probability[i], c->outage[i]);
}

void coupling_tangent(const Model *m, const Model *seed, Model *out)
{
    const Coupling *c = &m->coupling, *dc = &seed->coupling;
    const Parameters *p = &m->plant.parameters, *dp = &seed->plant.parameters;
    External *external = &out->plant.external;
    double left[3], right[3], of_pulse, of_voltage;

    *out = *seed;
    if (!COUPLED)
        return;
    memset(external, 0, sizeof *external);
    for (int i = 0; i < 3; i++) {
        out->plant.parameters.current[i] += dc->current[i];
        external->current_rate[i] = dc->current_rate[i];
        external->force[i] = dc->world.force[i];
        external->moment[i] = dc->world.moment[i];
        external->point[i] = dc->world.point[i];
        external->wrench[i] = dc->body.force[i];
    }
    cross(dc->body.point, c->body.force, left);
    cross(c->body.point, dc->body.force, right);
    for (int i = 0; i < 3; i++)
        external->wrench[3 + i] = dc->body.moment[i] + left[i] + right[i];
    for (int i = 0; i < N_THRUSTERS; i++) {
        const double share = c->thrust_normalized[i], dshare = dc->thrust_normalized[i];
        out->inputs.thrust[i] += share < 0.0 ? -dshare * p->thrust_min[i] - share * dp->thrust_min[i]
                                             : dshare * p->thrust_max[i] + share * dp->thrust_max[i];
        if (c->thrust_pulse[i] > 0.0) {
            force_of_pulse(c->thrust_pulse[i], c->supply_voltage, &of_pulse, &of_voltage);
            out->inputs.thrust[i] += of_pulse * dc->thrust_pulse[i] + of_voltage * dc->supply_voltage;
        }
        out->plant.parameters.thrust_effectiveness[i] = dp->thrust_effectiveness[i] * (1.0 - c->thrust_failure[i]) -
                                                        p->thrust_effectiveness[i] * dc->thrust_failure[i];
    }
}
