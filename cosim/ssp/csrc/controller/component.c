/* Law, regions and sensing as a component behind the FMI wrappers: the stages of a step in the master's order. A step
 * computes the outputs from the inputs at its beginning; before the first step all outputs are 0. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "instance.h"
#include "loop.h" /* generated: the translated functions, and the scene */
#include "random.h"

static const int OFFSETS[N_ALL + 1] = REGION_OFFSETS;
static const int CRITERIA[N_ALL] = REGION_CRITERIA;
static const char *const NAMES[N_ALL] = REGION_NAMES;
static const int RAMPS[] = RAMP_PLACES; /* memberships that decrease over arbiter.ramp; -1 ends the list */

/* Constraints among the numbers of the shapes, beyond their ranges; one without a message ends the list. */
typedef struct Constraint {
    enum { HOLDS_UNIT, HOLDS_ROTATION, HOLDS_ABOVE } what;
    int region, place;
    int more; /* number of numbers, or the place of the one to exceed */
    const char *fault;
} Constraint;

static const Constraint CONSTRAINTS[] = REGION_CONSTRAINTS;

typedef struct { /* one without a thruster ends the list */
    double time; /* s */
    int thruster;
    double remaining; /* remaining effectiveness; NaN: stuck */
} Failure;

static const Failure FAILURES[] = SCENE_FAILURES;

typedef struct { /* the last is at INFINITY */
    double time; /* s */
    int sensor;
    double probability; /* 1 in an outage, else 0 */
} Outage;

static const Outage OUTAGES[] = SCENE_OUTAGES;
static const double GOAL_PLACES[][3] = SCENE_GOAL_PLACES; /* m, next places of the goal, in turn; one more than there are */
enum { NOISE_STREAM = 64 };                                /* and five more; the plant has those before it */
static const double HAIR = 1e-6 * SCENE_STEP;             /* s: tolerance for rounding of summed steps */

/* ---- numbers ----------------------------------------------------------------------------------------------- */

static bool is_finite(const double x[], int n)
{
    for (int i = 0; i < n; i++)
        if (!isfinite(x[i]))
            return false;
    return true;
}

static bool is_unit(const double x[], int n)
{
    double square = 0.0;

    for (int i = 0; i < n; i++)
        square += x[i] * x[i];
    return fabs(square - 1.0) < 1e-6;
}

static bool is_rotation(const double R[9])
{
    for (int i = 0; i < 3; i++) {
        const double *a = R + 3 * i, *b = R + 3 * ((i + 1) % 3);
        if (!is_unit(a, 3) || !(fabs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) < 1e-6))
            return false;
    }
    return true;
}

/* Returns the place of the numbers of a region's shape: the goal's are apart from all others. */
static const double *shape_of(const Model *m, int region)
{
    return m->numbers + (region ? AT_REGION_NUMBERS + OFFSETS[region] : AT_GOAL_NUMBERS);
}

static bool holds(const Model *m, const Constraint *c)
{
    const double *numbers = shape_of(m, c->region);

    if (c->what == HOLDS_ABOVE)
        return numbers[c->place] > numbers[c->more];
    return c->what == HOLDS_ROTATION ? is_rotation(numbers + c->place) : is_unit(numbers + c->place, c->more);
}

/* ---- before the first step --------------------------------------------------------------------------------- */

static void rewind_memory(Model *m)
{
    memset(&m->memory, 0, sizeof m->memory);
    m->memory.inside_since = -1.0;
    control_rewind(m);
}

static Status prepare(Instance *instance)
{
    Model *m = &instance->model;

    if (!is_unit(m->numbers + AT_DESIRED, 4))
        return instance_refuse(instance, "law.desired_quaternion is not of length 1");
    if (!is_unit(m->parameters.start + 3, 4))
        return instance_refuse(instance, "initial.quaternion is not of length 1");
    for (const Constraint *c = CONSTRAINTS; c->fault; c++)
        if (!holds(m, c))
            return instance_refuse(instance, "%s: %s", NAMES[c->region], c->fault);
    for (const int *place = RAMPS; *place >= 0; place++)
        m->numbers[*place] = m->parameters.ramp;
    if (AT_PERIOD >= 0)
        m->numbers[AT_PERIOD] = m->parameters.period;
    ticks_begin(&m->memory.control, m->parameters.period, m->time);
    return STATUS_OK;
}

static Status begin(Instance *instance)
{
    return (void)instance, STATUS_OK;
}

static void evaluate(Instance *instance)
{
    (void)instance;
}

static Status check_step_size(const Instance *instance, double step)
{
    const Ticks *control = &instance->model.memory.control;

    if (ticks_would_skip(control, step))
        return instance_refuse(instance, "step of %g s is longer than time.control = %g s", step, control->period);
    return STATUS_OK;
}

/* ---- the stages of a step ---------------------------------------------------------------------------------- */

/* Writes the vehicle's motion from the inputs; the start while all of them are 0, as masters leave them before the
 * plant's first outputs. A quaternion of zeros counts as identity. */
static void motion_now(const Model *m, double motion[13])
{
    bool all_zero = true;

    memcpy(motion, m->inputs.motion, sizeof m->inputs.motion);
    for (int i = 0; i < 13; i++)
        all_zero = all_zero && motion[i] == 0.0;
    if (all_zero)
        memcpy(motion, m->parameters.start, sizeof m->parameters.start);
    const double *e = motion + 3;
    if (e[0] == 0.0 && e[1] == 0.0 && e[2] == 0.0 && e[3] == 0.0)
        motion[3] = 1.0;
}

/* Reports total failures of thrusters to law and allocation. */
static void report_failures(Model *m)
{
    for (const Failure *f; (f = &FAILURES[(int)m->memory.reported])->thruster >= 0 && f->time <= m->time + HAIR;) {
        if (SCENE_REPORTS_FAILURES && !(f->remaining > 0.0)) {
            m->numbers[AT_HEALTH + f->thruster] = 0.0;
            if (m->numbers[AT_STAGE] < SCENE_STAGES - 1)
                m->numbers[AT_STAGE] += 1.0;
        }
        m->memory.reported += 1.0;
    }
}

/* Returns the noise of a coordinate of position or velocity, which is constant until the law's next tick [m, m/s]. */
static double noise(const Model *m, int i)
{
    static const double DEVIATIONS[6] = SCENE_DEVIATIONS;

    if (!(DEVIATIONS[i] > 0.0))
        return 0.0;
    return DEVIATIONS[i] * random_normal(SCENE_SEED, NOISE_STREAM + (unsigned)i, (uint64_t)m->memory.control.count - 1);
}

/* Writes the state that law and arbiter receive of a true motion: with noise, held, or lost. */
static void sense_state(Model *m, const double motion[13])
{
    double *position = m->numbers + AT_POSITION, *velocity = m->numbers + AT_VELOCITY;

    memcpy(m->numbers + AT_QUATERNION, motion + 3, 4 * sizeof(double));
    memcpy(velocity + 3, motion + 10, 3 * sizeof(double));
    if (m->time >= SCENE_DEAD_FROM && m->time < SCENE_DEAD_UNTIL) {
        if (SCENE_FROZEN && m->time > 0.0)
            return;
        for (int i = 0; i < 3; i++) {
            position[i] = SCENE_FROZEN ? motion[i] : NAN;
            velocity[i] = SCENE_FROZEN ? motion[7 + i] : NAN;
        }
        return;
    }
    for (int i = 0; i < 3; i++) {
        position[i] = motion[i] + noise(m, i);
        velocity[i] = motion[7 + i] + noise(m, 3 + i);
    }
}

#if SCENE_SENSORS
/* Writes the state that the navigation filter estimates from the samples. Inputs that are all 0 come before the plant's
 * first outputs: then there are no samples. */
static void sense_samples(Model *m)
{
    bool all_zero = true;

    for (int i = 0; i < N_MEASURED; i++)
        all_zero = all_zero && m->inputs.samples[i] == 0.0;
    if (!all_zero) {
        memcpy(m->numbers + AT_SAMPLES, m->inputs.samples, sizeof m->inputs.samples);
        memcpy(m->numbers + AT_SAMPLE_TIMES, m->inputs.sample_times, sizeof m->inputs.sample_times);
    }
    control_navigate(m);
}
#endif

static void move_regions(Model *m)
{
    const double *offset = GOAL_PLACES[(int)m->memory.place];

    for (int j = 0; j < 3; j++)
        m->numbers[AT_GOAL_SHIFTS + j] = m->numbers[AT_GOAL_VELOCITIES + j] * m->time + offset[j];
    for (int i = 0; i < 3 * N_REGIONS; i++)
        m->numbers[AT_REGION_SHIFTS + i] = m->numbers[AT_REGION_VELOCITIES + i] * m->time;
}

/* Evaluates the regions at the known pose, and the inputs of the arbiter's rules, for the end of the step. */
static void decide(Model *m, double end)
{
    Outputs *out = &m->outputs;

    if (!is_finite(m->numbers + AT_POSITION, 3))
        return; /* unknown pose: the last memberships hold */
    m->numbers[AT_NOW] = end;
    control_decide(m);
    memcpy(out->values, m->numbers + AT_VALUES, sizeof out->values);
    memcpy(out->clearances, m->numbers + AT_CLEARANCES, sizeof out->clearances);
    memcpy(out->memberships, m->numbers + AT_MEMBERSHIPS, sizeof out->memberships);
    memcpy(out->rule_inputs, m->numbers + AT_RULE_INPUTS, sizeof out->rule_inputs);
}

#if SCENE_N_PLACES
/* Moves the goal to its next place, from the next step on, once the vehicle has stayed in it long enough. */
static void advance_goal(Model *m, const double motion[13])
{
    memcpy(m->numbers + AT_TRUE_POSITION, motion, 3 * sizeof(double));
    memcpy(m->numbers + AT_TRUE_QUATERNION, motion + 3, 4 * sizeof(double));
    control_find_goal(m);
    if (!(m->numbers[AT_GOAL_CLEARANCE] >= 0.0))
        m->memory.inside_since = -1.0;
    else if (m->memory.inside_since < 0.0)
        m->memory.inside_since = m->time;
    if (m->memory.place < SCENE_N_PLACES && m->memory.inside_since >= 0.0 &&
        m->time - m->memory.inside_since >= SCENE_STAY - HAIR) {
        m->memory.place += 1.0;
        m->memory.inside_since = -1.0;
    }
}
#endif

/* Computes the forces of the next period; 0 before a state is known. */
static void steer(Model *m)
{
    Outputs *out = &m->outputs;
    const bool steers = AT_STARTED < 0 || m->numbers[AT_STARTED] > 0.0;

    for (int i = 0; i < 6; i++)
        m->numbers[AT_EXPECTED + i] = NAN;
    if (steers) {
        for (int i = 1; i < N_ALL; i++)
            m->numbers[AT_WEIGHTS + i - 1] = m->inputs.weights[CRITERIA[i]];
        memcpy(out->estimate, m->numbers + AT_ESTIMATE, sizeof out->estimate);
        control_steer(m);
        if (SCENE_EXPECTS && AT_LAW_EXPECTED >= 0)
            memcpy(m->numbers + AT_EXPECTED, m->numbers + AT_LAW_EXPECTED, 6 * sizeof(double));
    } else {
        memset(m->numbers + AT_WRENCH, 0, 6 * sizeof(double));
        memset(m->numbers + AT_THRUSTS, 0, N_THRUSTERS * sizeof(double));
    }
#if SCENE_ALLOCATES
    control_allocate(m);
#endif
    memcpy(out->wrench, m->numbers + AT_WRENCH, sizeof out->wrench);
    for (int i = 0; i < N_THRUSTERS; i++)
        if (m->memory.stuck[i] == 0.0)
            out->thrusts[i] = m->numbers[AT_THRUSTS + i];
}

/* Applies failures of thrusters and outages of sensors that are scheduled for the next step. */
static void fail(Model *m, double end)
{
    Memory *memory = &m->memory;

    for (const Failure *f; (f = &FAILURES[(int)memory->failed])->thruster >= 0 && f->time <= end + HAIR;) {
        if (isnan(f->remaining))
            memory->stuck[f->thruster] = 1.0;
        else
            m->outputs.failures[f->thruster] = 1.0 - f->remaining;
        memory->failed += 1.0;
    }
    for (const Outage *o; (o = &OUTAGES[(int)memory->changed])->time <= end + HAIR;) {
        m->outputs.outages[o->sensor] = o->probability;
        memory->changed += 1.0;
    }
}

static Status take_step(Instance *instance, double end)
{
    Model *m = &instance->model;
    double motion[13];

    const double late = ticks_first_late(&m->memory.control, m->time);
    if (late > 0.0)
        instance_log(instance, LOG_WARNINGS, "the law runs at t = %.9g s, %.3g s late: steps do not divide time.control = %.9g s",
                      m->time, late, m->parameters.period);
    const bool due = ticks_due(&m->memory.control, m->time);

    motion_now(m, motion);
    report_failures(m);
#if SCENE_SENSORS
    m->numbers[AT_NOW] = m->time;
    sense_samples(m);
    (void)sense_state;
#else
    sense_state(m, motion);
#endif
    move_regions(m);
    decide(m, end);
    fail(m, end);
    if (due)
        steer(m);
#if SCENE_N_PLACES
    advance_goal(m, motion);
#endif
    if (!is_finite((const double *)&m->outputs, (int)(sizeof m->outputs / sizeof(double))))
        return instance_refuse(instance, "step from t = %.9g s not taken: a force, an estimate or a value of a region is no finite number",
                               m->time);
    m->time = end;
    return STATUS_OK;
}

static Status advance(Instance *instance, double end)
{
    Model *before = malloc(sizeof *before);

    if (!before)
        return instance_refuse(instance, "no memory for a step");
    memcpy(before, &instance->model, sizeof *before);
    const Status status = take_step(instance, end);
    if (status != STATUS_OK)
        memcpy(&instance->model, before, sizeof *before);
    free(before);
    return status;
}

/* ---- restored states --------------------------------------------------------------------------------------- */

static bool counts(double count, double most)
{
    return count >= 0.0 && count <= most && count == floor(count);
}

static bool valid_state(const Model *m)
{
    const Memory *memory = &m->memory;
    const unsigned char *flags = (const unsigned char *)m->flags;

    for (int i = 0; i < N_FLAGS; i++)
        if (flags[i] > 1)
            return false;
    return ticks_valid(&memory->control) && counts(memory->reported, sizeof FAILURES / sizeof FAILURES[0] - 1) &&
           counts(memory->failed, sizeof FAILURES / sizeof FAILURES[0] - 1) &&
           counts(memory->changed, sizeof OUTAGES / sizeof OUTAGES[0] - 1) && counts(memory->place, SCENE_N_PLACES) &&
           counts(m->numbers[AT_STAGE], SCENE_STAGES - 1) &&
           is_finite((const double *)&m->outputs, (int)(sizeof m->outputs / sizeof(double)));
}

const Component COMPONENT = {
    "the controller", rewind_memory, prepare, begin, evaluate, check_step_size, advance, valid_state, NULL, NULL, NULL, NULL,
};
