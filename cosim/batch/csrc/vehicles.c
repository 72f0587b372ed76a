#include "vehicles.h"

#define AT(member) offsetof(Model, member)

static const Variable PLACES[] = {COMPONENT_VARIABLES}; /* variables of the FMU, with their places in a Model of lanes */

enum { N_PLACES = sizeof PLACES / sizeof PLACES[0], N_DERIVED = offsetof(Derived, lags) / sizeof(Real) };

void vehicles_leave(Model *model)
{
    model->plant.derived.lags = model->plant.derived.water_moves = 0;
}

void vehicles_seat(Model *model, int i, const Start *start)
{
    Derived *derived = &model->plant.derived;

    for (int j = 0; j < N_PLACES; j++) {
        char *place = (char *)model + PLACES[j].offset;
        if (PLACES[j].role != PARAMETER && PLACES[j].role != STATE)
            continue;
        if (PLACES[j].type == TYPE_REAL)
            set_lane((Real *)place, i, start->values[j]);
        else if (PLACES[j].type == TYPE_BOOLEAN)
            set_mask_lane((Mask *)place, i, start->values[j] != 0.0);
    }
    for (int j = 0; j < N_DERIVED; j++)
        set_lane((Real *)derived + j, i, start->derived[j]);
    derived->lags |= start->lags;
    derived->water_moves |= start->water_moves;
}

static Mask within(const Variable *variable, Real x)
{
    return (x >= variable->min) & (x <= variable->max);
}

Mask vehicles_take(const Inputs *inputs)
{
    const Real *input = (const Real *)inputs;
    Mask taken = splat(0.0) == 0.0;

    for (int j = 0; j < N_THRUSTERS + 6; j++)
        taken &= within(&PLACES[FIRST_INPUT + j], input[j]);
    return taken;
}

Mask vehicles_advance(Model *model, const Actuators *target, double start, double end, double substep, Mask going)
{
    static const Drift STILL; /* lanes have no varying current */
    const State before = model->state;
    Real *is = (Real *)&model->state;
    const Real *was = (const Real *)&before;
    double h;

    going &= plant_advance(&model->plant, &STILL, start, end, substep, target, &model->state, &h);
    for (int j = 0; j < N_RIGID; j++) /* forces stay between commanded ones */
        going &= within(&PLACES[FIRST_STATE + j], is[j]);
    if (!all(going))
        for (int j = 0; j < N_STATES; j++)
            is[j] = choose(going, is[j], was[j]);
    return going;
}
