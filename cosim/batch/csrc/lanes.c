/* Flights side by side, one vehicle in each lane: in each step the stages of cosim/simulation/master.py, in their order. */
#include "lanes.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "law.h"
#include "regions.h"
#include "vehicles.h"

int arbiter_evaluate(const double inputs[3], double outputs[3]); /* generated */

typedef struct { /* what OUTCOME is made of */
    Real first_inside, last_entered, least_clearance, least_angle, goal_clearance;
    Real weighted_violation, effort, max_force, max_speed_squared, estimate[4], stopped;
    Mask inside;
} Marks;

typedef struct { /* N_LANES vehicles and their scenes */
    const Batch *batch;
    Mask flying;
    Model model; /* only its plant, state and inputs are used */
    Actuators target;
    Real desired[4], estimate[4], ramp;
    Gains gains;
    Marks marks;
    double memberships[N_LANES][N_CRITERIA];
    Real weights[N_CRITERIA];
    /* of each region, the goal first */
    Regions regions;
    Real *region_gains, *numbers, *values, *clearances;
    Real (*velocities)[3], (*shifts)[3], (*gradients)[3], *alphas;
} Fleet;

int lanes_count(void)
{
    return N_LANES;
}

/* ---- seats ------------------------------------------------------------------------------------------------- */

/* Returns `count` numbers of the block at `at`, and advances it. */
static Real *claim(Real **at, int count)
{
    Real *claimed = *at;

    *at += count;
    return claimed;
}

static size_t size_of_scenes(const Batch *b)
{
    return (size_t)(b->n_numbers + b->n_regions * (4 + 9)) * sizeof(Real);
}

static void lay_out(Fleet *f, const Batch *b, Real *block)
{
    const int n = b->n_regions;

    memset(f, 0, sizeof *f);
    f->batch = b;
    f->region_gains = claim(&block, n);
    f->values = claim(&block, n);
    f->clearances = claim(&block, n);
    f->alphas = claim(&block, n);
    f->velocities = (Real(*)[3])claim(&block, 3 * n);
    f->shifts = (Real(*)[3])claim(&block, 3 * n);
    f->gradients = (Real(*)[3])claim(&block, 3 * n);
    f->numbers = claim(&block, b->n_numbers);
    f->regions = (Regions){n, b->kinds, b->signs, b->offsets, f->numbers, (const Real(*)[3])f->shifts};
}

/* Puts a vehicle in its start state, and its scene, into a lane. */
static void seat(Fleet *f, int i, const Start *start, const double *row)
{
    const Batch *b = f->batch;
    Real *gains = (Real *)&f->gains;

    vehicles_seat(&f->model, i, start);
    row += b->n_reals + b->n_integers;
    for (int j = 0; j < 4; j++)
        set_lane(&f->desired[j], i, *row++);
    for (int j = 0; j < (int)(sizeof f->gains / sizeof(Real)); j++)
        set_lane(&gains[j], i, *row++);
    set_lane(&f->ramp, i, *row++);
    for (int j = 1; j < b->n_regions; j++)
        set_lane(&f->region_gains[j], i, *row++);
    for (int j = 0; j < b->n_numbers; j++)
        set_lane(&f->numbers[j], i, *row++);
    for (int j = 0; j < 3 * b->n_regions; j++)
        set_lane(&f->velocities[0][j], i, *row++);
}

static void begin(Fleet *f)
{
    Marks *m = &f->marks;
    const Real none = splat(0.0), never = splat(-1.0);

    m->first_inside = m->last_entered = m->stopped = never;
    m->least_clearance = m->least_angle = splat(INFINITY);
    m->goal_clearance = splat(-INFINITY);
    m->weighted_violation = m->effort = m->max_force = m->max_speed_squared = none;
    m->inside = none > 0.0;
    for (int j = 0; j < 4; j++)
        m->estimate[j] = f->estimate[j] = none;
    for (int j = 0; j < N_CRITERIA; j++) {
        f->weights[j] = none;
        for (int i = 0; i < N_LANES; i++)
            f->memberships[i][j] = NAN; /* none yet: equal to none */
    }
    for (int j = 0; j < 3 * f->batch->n_regions; j++)
        f->shifts[0][j] = none;
}

/* ---- the stages of a step ---------------------------------------------------------------------------------- */

static void evaluate_regions(Fleet *f, double now)
{
    const Real *rigid = f->model.state.rigid;

    if (f->batch->moving)
        for (int j = 0; j < 3 * f->batch->n_regions; j++)
            f->shifts[0][j] = f->velocities[0][j] * now;
    regions_evaluate(&f->regions, rigid, rigid + 3, f->values, f->gradients, f->clearances);
}

static void mark(Fleet *f, int k)
{
    Marks *m = &f->marks;
    const Real *velocity = f->model.state.rigid + 7;
    const Mask inside = f->clearances[0] >= 0.0, entered = f->flying & inside & mask_not(m->inside);

    for (int j = 1; j < f->batch->n_regions; j++)
        if (f->batch->hard[j]) {
            Real *least = f->batch->kinds[j] < SHAPES_OF_ATTITUDE ? &m->least_clearance : &m->least_angle;
            const Mask less = (f->clearances[j] < *least) | (f->clearances[j] != f->clearances[j]); /* NaN stays, too */
            *least = choose(f->flying & less, f->clearances[j], *least);
        }
    for (int j = 1; k < f->batch->steps && j < f->batch->n_regions; j++) {
        const Real more = m->weighted_violation - f->batch->priorities[j] * f->clearances[j] * f->batch->step;
        m->weighted_violation = choose(f->flying & mask_not(f->clearances[j] >= 0.0), more, m->weighted_violation);
    }
    m->goal_clearance = choose(f->flying, real_fmax(f->clearances[0], m->goal_clearance), m->goal_clearance);
    m->first_inside = choose(entered & (m->first_inside < 0.0), splat(k), m->first_inside);
    m->last_entered = choose(entered, splat(k), m->last_entered);
    m->inside = (f->flying & inside) | (mask_not(f->flying) & m->inside);
    const Real speed_squared =
        velocity[0] * velocity[0] + velocity[1] * velocity[1] + velocity[2] * velocity[2];
    m->max_speed_squared = real_fmax(speed_squared, m->max_speed_squared);
}

/* Computes the memberships of the most critical region of each criterion, and the weights, lane by lane; skips lanes whose
 * memberships have not changed, as far from all regions. */
static void arbitrate(Fleet *f)
{
    Real memberships[N_CRITERIA];

    for (int c = 0; c < N_CRITERIA; c++)
        memberships[c] = splat(0.0);
    for (int j = 1; j < f->batch->n_regions; j++) {
        Real *membership = &memberships[f->batch->criteria[j]];
        *membership = real_fmax(regions_ramp(f->clearances[j], f->ramp), *membership);
    }
    for (int i = 0; i < N_LANES; i++) {
        double now[N_CRITERIA], weights[N_CRITERIA];
        int changed = 0;
        for (int c = 0; c < N_CRITERIA; c++) {
            now[c] = lane(memberships[c], i);
            changed |= now[c] != f->memberships[i][c];
            f->memberships[i][c] = now[c];
        }
        if (!changed)
            continue;
        arbiter_evaluate(now, weights);
        for (int c = 0; c < N_CRITERIA; c++)
            set_lane(&f->weights[c], i, weights[c]);
    }
}

/* Computes the least thruster forces that give a wrench, as controller/allocation.py. */
static void allocate(const Batch *b, const Real wrench[6], Real forces[N_THRUSTERS])
{
    Real greatest = splat(0.0), scale = splat(1.0);

    for (int i = 0; i < N_THRUSTERS; i++) {
        forces[i] = splat(0.0);
        for (int j = 0; j < 6; j++)
            forces[i] += b->inverse[6 * i + j] * wrench[j];
        greatest = real_fmax(real_fabs(forces[i]), greatest);
    }
    if (b->keep_direction)
        for (int i = 0; i < N_THRUSTERS; i++) {
            const Real negligible = 1e-12 * greatest, f = forces[i];
            const Mask above = (f > b->upper[i]) & (f > negligible), below = (f < b->lower[i]) & (f < -negligible);
            const Real bound = choose(above, splat(b->upper[i]), splat(b->lower[i]));
            scale = choose(above | below, real_fmin(bound / f, scale), scale);
        }
    for (int i = 0; i < N_THRUSTERS; i++) { /* NaN stays NaN: the plant refuses it */
        const Real lower = splat(b->lower[i]), upper = splat(b->upper[i]), f = scale * forces[i];
        forces[i] = choose(f < lower, lower, choose(f > upper, upper, f));
    }
}

static void stop(Fleet *f, Mask goes_on, int k)
{
    f->marks.stopped = choose(f->flying & mask_not(goes_on), splat(k), f->marks.stopped);
    f->flying &= goes_on;
}

static void control(Fleet *f, int k)
{
    const Batch *b = f->batch;
    const Real *rigid = f->model.state.rigid;
    Inputs *inputs = &f->model.inputs;
    Real wrench[6];
    Mask thrust_cut[N_THRUSTERS], wrench_cut;

    for (int j = 1; j < b->n_regions; j++)
        f->alphas[j] = f->region_gains[j] * f->weights[b->criteria[j]];
    law_step(rigid + 3, rigid + 7, f->desired, f->values[0], f->gradients[0], b->n_regions - 1, f->values + 1,
             (const Real(*)[3])(f->gradients + 1), f->alphas + 1, &f->gains, splat(b->period), f->estimate, wrench);
    if (b->thrusters)
        allocate(b, wrench, inputs->thrust);
    else
        memcpy(inputs->wrench, wrench, sizeof wrench);
    stop(f, vehicles_take(inputs), k);
    actuators_target(&f->model.plant.parameters, inputs, &f->target, thrust_cut, &wrench_cut);
}

static void advance(Fleet *f, int k, double *time)
{
    const Batch *b = f->batch;
    const double end = k * b->step + b->step;
    const Actuators *actuators = &f->model.state.actuators;
    Real given[6];

    stop(f, vehicles_advance(&f->model, &f->target, *time, end, b->substep, f->flying), k);
    *time = end;

    if (b->thrusters)
        actuators_wrench(&f->model.plant.parameters, actuators, given);
    else
        memcpy(given, actuators->wrench, sizeof given);
    const Real force = real_sqrt(given[0] * given[0] + given[1] * given[1] + given[2] * given[2]);
    f->marks.effort = choose(f->flying, f->marks.effort + force * b->step, f->marks.effort);
    f->marks.max_force = choose(f->flying, real_fmax(force, f->marks.max_force), f->marks.max_force);
}

/* ---- flights ----------------------------------------------------------------------------------------------- */

static void fly(Fleet *f)
{
    const Batch *b = f->batch;
    double time = 0.0;

    begin(f);
    for (int k = 0; k <= b->steps && any(f->flying); k++) {
        const int controls = k % b->control_every == 0;
        evaluate_regions(f, k * b->step);
        mark(f, k);
        if (controls)
            for (int j = 0; j < 4; j++)
                f->marks.estimate[j] = choose(f->flying, f->estimate[j], f->marks.estimate[j]);
        if (k == b->steps)
            return;
        if (k % b->arbiter_every == 0)
            arbitrate(f);
        if (controls)
            control(f, k);
        advance(f, k, &time);
    }
}

static void write_marks(const Fleet *f, int i, double marks[N_MARKS])
{
    const Marks *m = &f->marks;

    marks[FIRST_INSIDE] = lane(m->first_inside, i);
    marks[LAST_ENTERED] = lane(m->last_entered, i);
    marks[INSIDE] = mask_lane(m->inside, i);
    marks[LEAST_CLEARANCE] = lane(m->least_clearance, i);
    marks[LEAST_ANGLE] = lane(m->least_angle, i);
    marks[GOAL_CLEARANCE] = lane(m->goal_clearance, i);
    marks[WEIGHTED_VIOLATION] = lane(m->weighted_violation, i);
    marks[EFFORT] = lane(m->effort, i);
    marks[MAX_FORCE] = lane(m->max_force, i);
    marks[MAX_SPEED] = sqrt(lane(m->max_speed_squared, i));
    for (int j = 0; j < 3; j++)
        marks[FINAL_POSITION + j] = lane(f->model.state.rigid[j], i);
    for (int j = 0; j < 4; j++)
        marks[ESTIMATE + j] = lane(m->estimate[j], i);
    marks[STOPPED] = lane(m->stopped, i);
}

/* Fills the lanes with the next rows that can start; the remaining lanes hold copies of the first, whose results are not
 * used. Returns the number of lanes with rows of their own. */
static int board(Fleet *f, Starter *starter, int *next, int seated[N_LANES])
{
    const Batch *b = f->batch;
    int n = 0;
    Start start;

    vehicles_leave(&f->model);
    for (; n < N_LANES && *next < b->n_rows; ++*next) {
        const double *row = b->rows + (size_t)*next * (size_t)b->width;
        if (!starter_prepare(starter, b, row, &start, b->refusals + (size_t)*next * REFUSAL))
            continue;
        if (n == 0) /* fill all lanes with the first */
            for (int i = 1; i < N_LANES; i++)
                seat(f, i, &start, row);
        seat(f, n, &start, row);
        seated[n++] = *next;
    }
    for (int i = 0; i < N_LANES; i++)
        set_mask_lane(&f->flying, i, i < n);
    return n;
}

int lanes_fly(const Batch *b)
{
    const size_t alignment = sizeof(Real), size = sizeof(Fleet) + alignment + size_of_scenes(b);
    char *memory = malloc(size + alignment);
    Starter *starter = starter_create();
    const int ready = memory && starter;

    if (ready) {
        Fleet *fleet = (Fleet *)(((uintptr_t)memory + alignment - 1) / alignment * alignment);
        const size_t behind = (sizeof *fleet + alignment - 1) / alignment * alignment;
        int seated[N_LANES], next = 0;
        lay_out(fleet, b, (Real *)((char *)fleet + behind));
        while (next < b->n_rows) {
            const int n = board(fleet, starter, &next, seated);
            fly(fleet);
            for (int i = 0; i < n; i++)
                write_marks(fleet, i, b->marks + (size_t)seated[i] * N_MARKS);
        }
    }
    starter_free(starter);
    free(memory);
    return ready;
}
