/* Prediction of the plant's motion from a start, with exact sensitivities.
 *
 * The equations are the FMU's own: plant_derivative moves the state, and its exact tangent moves the sensitivities, both
 * through the same Runge-Kutta steps of order four. So the sensitivities are those of the computed numbers, to rounding. */
#include "tangent.c" /* for derivative_tangent, which is static */

#include "instance.h"
#include "shooting.h"

#include <stdint.h>

typedef double Row __attribute__((vector_size(16 * sizeof(double)))); /* N_RIGID numbers, for vectors of the processor */

static const double FASTEST = 1e3; /* m/s, rad/s: faster than any vehicle */

typedef struct {
    Model model, seed;
    const Prediction *asked;
    double *tangent, *stage, *slopes[4]; /* (n_directions, 13) each */
    double share[3][3]; /* linear acceleration that a moment causes, by the angular one; with given turns alone */
} Shooter;

/* Writes the linear acceleration by each angular one, of forces that are zero: M^-1 (1:3, 4:6) times the inverse of M^-1 (4:6, 4:6). */
static void find_share(Shooter *s)
{
    const double(*inverse)[6] = (const double(*)[6])s->model.plant.derived.mass_inverse;
    double a[3][3], minors[3][3], det;

    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            a[i][j] = inverse[3 + i][3 + j];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            minors[j][i] = a[(i + 1) % 3][(j + 1) % 3] * a[(i + 2) % 3][(j + 2) % 3] -
                           a[(i + 1) % 3][(j + 2) % 3] * a[(i + 2) % 3][(j + 1) % 3];
    det = a[0][0] * minors[0][0] + a[0][1] * minors[1][0] + a[0][2] * minors[2][0];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            s->share[i][j] = 0.0;
            for (int k = 0; k < 3; k++)
                s->share[i][j] += inverse[i][3 + k] * minors[k][j] / det;
        }
}

/* Replaces the turning in a rate by a given one, and takes what the moments contribute to the linear accelerations out. */
static void constrain(const Shooter *s, const double turning[7], double rate[N_RIGID])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            rate[7 + i] -= s->share[i][j] * (rate[10 + j] - turning[4 + j]);
    memcpy(rate + 3, turning, 4 * sizeof(double));
    memcpy(rate + 10, turning + 4, 3 * sizeof(double));
}

/* Writes the tangent of the rate along a change of the state, of a parameter (NULL: none), and of the wrench. */
static void differentiate(Shooter *s, const double rate[N_RIGID], const double R[3][3], const double rigid[N_RIGID],
                          double *parameter, const double dtau[6], double slope[N_RIGID])
{
    double own[3][3], dR[3][3], dwater[3], turned[3], pushed[6];

    memcpy(s->seed.state.rigid, rigid, sizeof s->seed.state.rigid);
    memcpy(own, R, sizeof own);
    memcpy(pushed, dtau, sizeof pushed);
    rotation_tangent(s->model.state.rigid + 3, rigid + 3, dR);
    to_body((const double(*)[3])dR, s->asked->force, turned);
    for (int i = 0; i < 3; i++)
        pushed[i] += turned[i];
    if (parameter)
        *parameter = 1.0;
    derivative_tangent(&s->model, &s->seed, rate, pushed, own, dR, dwater, slope);
    if (parameter)
        *parameter = 0.0;
}

/* Writes the velocity through the water, and its rate, both from those of the model's state. */
static void relative_to_water(const Shooter *s, const double rate[N_RIGID], const double R[3][3], double nu_r[6],
                              double nu_r_rate[6])
{
    const Parameters *p = &s->model.plant.parameters;
    const double *x = s->model.state.rigid;
    double water[3], water_rate[3], current[3], current_rate[3], turning[3];

    environment_current(p, &s->model.held.drift, s->model.time, x[2], water);
    for (int i = 0; i < 3; i++)
        water_rate[i] = s->model.held.drift.slope[i] + (x[2] > 0.0 ? p->current_shear[i] * rate[2] : 0.0);
    to_body(R, water, current);
    to_body(R, water_rate, current_rate);
    cross(x + 10, current, turning);
    for (int i = 0; i < 3; i++) {
        nu_r[i] = x[7 + i] - current[i];
        nu_r_rate[i] = rate[7 + i] - current_rate[i] + turning[i];
        nu_r[3 + i] = x[10 + i];
        nu_r_rate[3 + i] = rate[10 + i];
    }
}

/* Returns the index of a number from the first one of an array, which it need not be in. */
static intptr_t index_from(const double *number, const double *first)
{
    return ((intptr_t)number - (intptr_t)first) / (intptr_t)sizeof *number;
}

/* Adds the tangent of the wrench along a parameter that acts by the motion through the water alone. Returns false, and adds
 * nothing, for any other. */
static int add_by_motion(const Shooter *s, const double *parameter, const double nu_r[6], const double nu_r_rate[6],
                         double dwrench[6])
{
    const Parameters *dp = &s->seed.plant.parameters;
    const intptr_t linear = index_from(parameter, dp->linear_damping);
    const intptr_t quadratic = index_from(parameter, dp->quadratic_damping);
    const intptr_t mass = index_from(parameter, &dp->added_mass[0][0]);

    if (linear >= 0 && linear < 6)
        dwrench[linear] -= nu_r[linear];
    else if (quadratic >= 0 && quadratic < 6)
        dwrench[quadratic] -= fabs(nu_r[quadratic]) * nu_r[quadratic];
    else if (mass >= 0 && mass < 36) { /* -A v_r' - C_A(v_r) v_r */
        static const double still[6] = {0.0};
        const intptr_t i = mass / 6, j = mass % 6;
        double momentum[6] = {0.0};
        momentum[i] = nu_r[j];
        momentum[j] = nu_r[i];
        dwrench[i] -= nu_r_rate[j];
        if (i != j)
            dwrench[j] -= nu_r_rate[i];
        subtract_coriolis_tangent(still, momentum, nu_r, still, dwrench);
    } else
        return 0;
    return 1;
}

/* Computes the rate of the model's state at a fraction of step k, and that of each direction's tangent in `along`. */
static void evaluate(Shooter *s, int k, double part, const double *along, double rate[N_RIGID], double *slope)
{
    static const double still[N_RIGID] = {0.0};
    const Prediction *asked = s->asked;
    const double *wrench = asked->wrench + 12 * (size_t)k, off = part - 0.5;
    double R[3][3], tau[6], pushed[3], nu_r[6], nu_r_rate[6];
    Row by_state[N_RIGID];
    static const double fixed[7] = {0.0};
    double turning[7];

    plant_rotation(s->model.state.rigid + 3, R);
    for (int i = 0; i < 6; i++)
        tau[i] = wrench[i] + off * wrench[6 + i];
    to_body((const double(*)[3])R, asked->force, pushed);
    for (int i = 0; i < 3; i++)
        tau[i] += pushed[i];
    plant_derivative(&s->model.plant, &s->model.held.drift, s->model.time, s->model.state.rigid, tau, rate);
    if (asked->turns) {
        for (int i = 0; i < 7; i++)
            turning[i] = (asked->turns[7 * (size_t)(k + 1) + i] - asked->turns[7 * (size_t)k + i]) / asked->step;
        constrain(s, turning, rate);
    }
    if (!asked->n_directions)
        return;

    /* the rate's derivatives by the state: nothing depends on where north and east are */
    for (int i = 2; i < N_RIGID; i++) {
        double unit[N_RIGID] = {0.0}, column[sizeof(Row) / sizeof(double)] = {0.0};
        unit[i] = 1.0;
        if (!asked->turns || i == 2 || (i >= 7 && i < 10)) /* given turns have no tangents */
            differentiate(s, rate, (const double(*)[3])R, unit, NULL, still, column);
        memcpy(&by_state[i], column, sizeof by_state[i]);
    }
    relative_to_water(s, rate, (const double(*)[3])R, nu_r, nu_r_rate);

    for (int j = 0; j < asked->n_directions; j++) {
        const double *tangent = along + N_RIGID * (size_t)j;
        const int parameter = asked->parameter_directions[j], input = asked->input_directions[j];
        double *moved = slope + N_RIGID * (size_t)j, dwrench[6] = {0.0}, accelerated[6];

        to_body((const double(*)[3])R, asked->force_tangents + 3 * (size_t)j, dwrench);
        if (input >= 0) {
            const double *change = asked->wrench_tangents + 12 * ((size_t)input * asked->n_steps + k);
            for (int i = 0; i < 6; i++)
                dwrench[i] += change[i] + off * change[6 + i];
        }
        double *seeded = parameter >= 0 ? variable_real(&s->seed, &VARIABLES[parameter]) : NULL;
        if (!seeded || add_by_motion(s, seeded, nu_r, nu_r_rate, dwrench)) {
            multiply6((const double(*)[6])s->model.plant.derived.mass_inverse, dwrench, accelerated);
            memset(moved, 0, 7 * sizeof(double));
            memcpy(moved + 7, accelerated, sizeof accelerated);
        } else
            differentiate(s, rate, (const double(*)[3])R, still, seeded, dwrench, moved);
        Row sum = tangent[2] * by_state[2];
        for (int i = 3; i < N_RIGID; i++)
            sum += tangent[i] * by_state[i];
        for (int n = 0; n < N_RIGID; n++)
            moved[n] += sum[n];
        if (asked->turns)
            constrain(s, fixed, moved);
    }
}

/* Sets the state and all tangents to those at the end of a slope from the beginning of the step. */
static void move(Shooter *s, const double from[N_RIGID], const double rate[N_RIGID], const double *slope, double h)
{
    for (int i = 0; i < N_RIGID; i++)
        s->model.state.rigid[i] = from[i] + h * rate[i];
    for (int i = 0; i < s->asked->n_directions * N_RIGID; i++)
        s->stage[i] = s->tangent[i] + h * slope[i];
}

/* Writes the state at a fraction of the step, and its rate: dense output of order three. */
static void sample(const Shooter *s, int n, double part, const double from[N_RIGID], const double rates[4][N_RIGID])
{
    const Prediction *asked = s->asked;
    const double h = asked->step, square = part * part, cube = square * part;
    const double weights[4] = {part - 1.5 * square + 2.0 / 3.0 * cube, square - 2.0 / 3.0 * cube,
                               square - 2.0 / 3.0 * cube, -0.5 * square + 2.0 / 3.0 * cube};
    const double speeds[4] = {1.0 - 3.0 * part + 2.0 * square, 2.0 * part - 2.0 * square, 2.0 * part - 2.0 * square,
                              -part + 2.0 * square};
    double *state = asked->states + N_RIGID * (size_t)n, *rate = asked->rates + N_RIGID * (size_t)n;
    double *tangents = asked->state_tangents + N_RIGID * (size_t)asked->n_directions * n;

    for (int i = 0; i < N_RIGID; i++) {
        state[i] = from[i];
        rate[i] = 0.0;
        for (int k = 0; k < 4; k++) {
            state[i] += h * weights[k] * rates[k][i];
            rate[i] += speeds[k] * rates[k][i];
        }
    }
    for (int i = 0; i < asked->n_directions * N_RIGID; i++)
        tangents[i] = s->tangent[i] + h * (weights[0] * s->slopes[0][i] + weights[1] * s->slopes[1][i] +
                                           weights[2] * s->slopes[2][i] + weights[3] * s->slopes[3][i]);
}

/* Scales the quaternion to unit length, and the tangents with it. */
static int normalize(Shooter *s)
{
    double *e = s->model.state.rigid + 3;
    const double norm = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]);

    if (!plant_normalize(s->model.state.rigid))
        return 0;
    for (int j = 0; j < s->asked->n_directions; j++) {
        double *de = s->tangent + N_RIGID * (size_t)j + 3;
        const double along = e[0] * de[0] + e[1] * de[1] + e[2] * de[2] + e[3] * de[3];
        for (int i = 0; i < 4; i++)
            de[i] = (de[i] - along * e[i]) / norm;
    }
    return 1;
}

static int is_a_motion(const double rigid[N_RIGID])
{
    for (int i = 7; i < N_RIGID; i++)
        if (!(fabs(rigid[i]) < FASTEST))
            return 0;
    return 1;
}

/* Makes one Runge-Kutta step, and writes the samples within it. Returns 0 where the motion ends. */
static int advance(Shooter *s, int k, int *next)
{
    const Prediction *asked = s->asked;
    const double h = asked->step, begin = k * h, parts[4] = {0.0, 0.5, 0.5, 1.0};
    double from[N_RIGID], rates[4][N_RIGID];

    memcpy(from, s->model.state.rigid, sizeof from);
    memcpy(s->stage, s->tangent, (size_t)asked->n_directions * N_RIGID * sizeof(double));
    for (int stage = 0; stage < 4; stage++) {
        if (stage > 0)
            move(s, from, rates[stage - 1], s->slopes[stage - 1], parts[stage] * h);
        s->model.time = begin + parts[stage] * h;
        evaluate(s, k, parts[stage], s->stage, rates[stage], s->slopes[stage]);
    }
    for (; *next < asked->n_samples && (asked->times[*next] <= begin + h || k == asked->n_steps - 1); ++*next)
        sample(s, *next, (asked->times[*next] - begin) / h, from, (const double(*)[N_RIGID])rates);
    for (int i = 0; i < N_RIGID; i++)
        s->model.state.rigid[i] =
            from[i] + h / 6.0 * (rates[0][i] + 2.0 * (rates[1][i] + rates[2][i]) + rates[3][i]);
    for (int i = 0; i < asked->n_directions * N_RIGID; i++)
        s->tangent[i] +=
            h / 6.0 * (s->slopes[0][i] + 2.0 * (s->slopes[1][i] + s->slopes[2][i]) + s->slopes[3][i]);
    return is_a_motion(s->model.state.rigid) && normalize(s);
}

const char *shooting_predict(const Prediction *asked)
{
    static const char *const LOST = "the predicted motion has no numbers";
    const size_t size = (size_t)asked->n_directions * N_RIGID;
    Shooter s;

    memset(&s, 0, sizeof s);
    s.asked = asked;
    s.tangent = asked->work;
    s.stage = asked->work + size;
    for (int i = 0; i < 4; i++)
        s.slopes[i] = asked->work + (2 + (size_t)i) * size;
    variables_start(&s.model);
    for (int i = 0; i < asked->n_parameters; i++)
        *variable_real(&s.model, &VARIABLES[asked->references[i]]) = asked->values[i];
    const char *wrong = plant_prepare(&s.model.plant);
    if (wrong)
        return wrong;
    find_share(&s);
    memcpy(s.model.state.rigid, asked->start, sizeof s.model.state.rigid);
    memcpy(s.tangent, asked->start_tangents, size * sizeof(double));
    if (!is_a_motion(s.model.state.rigid) || !normalize(&s))
        return LOST;
    for (int k = 0, next = 0; k < asked->n_steps; k++) {
        if (asked->turns) {
            memcpy(s.model.state.rigid + 3, asked->turns + 7 * (size_t)k, 4 * sizeof(double));
            memcpy(s.model.state.rigid + 10, asked->turns + 7 * (size_t)k + 4, 3 * sizeof(double));
        }
        if (!advance(&s, k, &next))
            return LOST;
    }
    return NULL;
}
