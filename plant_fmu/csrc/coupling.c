/* See coupling.h. */
#include "coupling.h"

#include <math.h>
#include <string.h>

#include "linear.h"
#include "t200.h" /* generated: the published points */

typedef struct {
    double force, by_command, by_voltage; /* N; derivatives */
} Thrust;

static double interpolate(double low, double high, double fraction)
{
    return low + fraction * (high - low);
}

/* Returns the force of a T200 at a command and a supply voltage [V], linear between the published points, with its
   derivatives (at a published point: those from below). `low` and `high` are the commands of the points at the published
   voltages `row` and `row` + 1. Commands beyond the points give the forces of the outermost ones. */
static Thrust thrust_between(double command, double voltage, int row, const double *low, const double *high)
{
    const double blend = (voltage - T200_FIRST_VOLTAGE) / T200_VOLTAGE_STEP - row;
    const double *low_force = T200_FORCES[row], *high_force = T200_FORCES[row + 1];
    int i = 0;

    while (i < N_T200_PULSES - 2 && command > interpolate(low[i + 1], high[i + 1], blend))
        i++;
    const double start = interpolate(low[i], high[i], blend), width = interpolate(low[i + 1], high[i + 1], blend) - start;
    const double force = interpolate(low_force[i], high_force[i], blend);
    const double rise = interpolate(low_force[i + 1], high_force[i + 1], blend) - force;
    const double position = (command - start) / width, fraction = fmin(fmax(position, 0.0), 1.0);
    const double slope = position == fraction ? rise / width : 0.0;
    /* from one published voltage to the next, at the same fraction between two points */
    const double command_change = interpolate(high[i] - low[i], high[i + 1] - low[i + 1], fraction);
    const double force_change = interpolate(high_force[i] - low_force[i], high_force[i + 1] - low_force[i + 1], fraction);

    return (Thrust){force + fraction * rise, slope, (force_change - slope * command_change) / T200_VOLTAGE_STEP};
}

/* Returns the row of published forces below a voltage; the plant refuses voltages beyond the published ones. */
static int voltage_row(double voltage)
{
    int row = 0;

    while ((voltage - T200_FIRST_VOLTAGE) / T200_VOLTAGE_STEP > row + 1.0)
        row++;
    return row;
}

static Thrust force_of_pulse(double pulse, double voltage)
{
    return thrust_between(pulse, voltage, voltage_row(voltage), T200_PULSES, T200_PULSES);
}

static Thrust force_of_rpm(double rpm, double voltage)
{
    const int row = voltage_row(voltage);

    return thrust_between(rpm, voltage, row, T200_RPM[row], T200_RPM[row + 1]);
}

bool coupling_is_active(const Model *m)
{
    const double *numbers = (const double *)&m->coupling;

    if (!COUPLED)
        return false;
    for (size_t i = 1; i < sizeof m->coupling / sizeof(double); i++) /* the first is the voltage, which has no effect alone */
        if (numbers[i] != 0.0)
            return true;
    return false;
}

/* Writes the external wrenches: the one in the body frame about the origin, the one in the world frame as given. */
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

    *out = *m;
    if (!COUPLED)
        return;
    for (int i = 0; i < 3; i++) {
        p->current[i] += c->current[i];
        out->plant.external.current_rate[i] = c->current_rate[i];
    }
    out->plant.external.active = 1;
    out->plant.external.since = m->time;
    out->plant.derived.has_current = 1;
    add_external(c, &out->plant.external);
    for (int i = 0; i < N_THRUSTERS; i++) {
        const double command = c->thrust_normalized[i];
        out->inputs.thrust[i] += command < 0.0 ? -command * p->thrust_min[i] : command * p->thrust_max[i];
        if (c->thrust_pulse[i] > 0.0)
            out->inputs.thrust[i] += force_of_pulse(c->thrust_pulse[i], c->supply_voltage).force;
        out->inputs.thrust[i] += force_of_rpm(c->thrust_rpm[i], c->supply_voltage).force;
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
    double left[3], right[3];

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
        const double command = c->thrust_normalized[i], dcommand = dc->thrust_normalized[i];
        out->inputs.thrust[i] += command < 0.0 ? -dcommand * p->thrust_min[i] - command * dp->thrust_min[i]
                                             : dcommand * p->thrust_max[i] + command * dp->thrust_max[i];
        if (c->thrust_pulse[i] > 0.0) {
            const Thrust pulse = force_of_pulse(c->thrust_pulse[i], c->supply_voltage);
            out->inputs.thrust[i] += pulse.by_command * dc->thrust_pulse[i] + pulse.by_voltage * dc->supply_voltage;
        }
        const Thrust rpm = force_of_rpm(c->thrust_rpm[i], c->supply_voltage);
        out->inputs.thrust[i] += rpm.by_command * dc->thrust_rpm[i] + rpm.by_voltage * dc->supply_voltage;
        out->plant.parameters.thrust_effectiveness[i] = dp->thrust_effectiveness[i] * (1.0 - c->thrust_failure[i]) -
                                                        p->thrust_effectiveness[i] * dc->thrust_failure[i];
    }
}
