/* The plant of the lanes alone, under given inputs: what it does can be held against the FMU, step by step. */
#include <stdlib.h>
#include <string.h>

#include "vehicles.h"

/* Steps the vehicles of a batch, at most as many as there are lanes, from given starts. `inputs`: (n_rows, steps,
 * N_THRUSTERS + 6); `states`: (n_rows, steps, N_STATES), after each step; `gone`: (n_rows, steps), whether it was taken. */
EXPORTED int core_steps(const Batch *b, const double *inputs, double *states, int *gone)
{
    const int n_inputs = N_THRUSTERS + 6;
    static Model model;
    Starter *starter = starter_create();
    Start start;
    double time = 0.0;

    memset(&model, 0, sizeof model);
    vehicles_leave(&model);
    for (int i = 0; i < N_LANES; i++) {
        const int row = i < b->n_rows ? i : 0;
        if (!starter_prepare(starter, b, b->rows + row * b->width, &start, b->refusals + row * REFUSAL))
            return 0;
        vehicles_seat(&model, i, &start);
    }
    starter_free(starter);
    for (int k = 0; k < b->steps; k++) {
        Actuators target;
        Mask thrust_cut[N_THRUSTERS], wrench_cut;
        for (int i = 0; i < N_LANES; i++)
            for (int j = 0; j < n_inputs; j++)
                set_lane((Real *)&model.inputs + j, i, inputs[((i < b->n_rows ? i : 0) * b->steps + k) * n_inputs + j]);
        const Mask taken = vehicles_take(&model.inputs);
        actuators_target(&model.plant.parameters, &model.inputs, &target, thrust_cut, &wrench_cut);
        const double end = k * b->step + b->step;
        const Mask went = vehicles_advance(&model, &target, time, end, b->substep, taken);
        time = end;
        for (int i = 0; i < b->n_rows; i++) {
            gone[i * b->steps + k] = mask_lane(went, i);
            for (int j = 0; j < N_STATES; j++)
                states[(i * b->steps + k) * N_STATES + j] = lane(((Real *)&model.state)[j], i);
        }
    }
    return 1;
}
