/* Prediction of the plant's motion from a start, with exact sensitivities.
 *
 * The equations are the FMU's own: plant_derivative moves the state, and its exact tangent moves the sensitivities, both
 * through the same Runge-Kutta steps of order four. So the sensitivities are those of the computed numbers, to rounding. */
#include "tangent.c" /* for derivative_tangent, which is static */

#include "instance.h"
#include "shooting.h"

static const double FASTEST = 1e3; /* m/s, rad/s: faster than any vehicle */

typedef struct {
    Model model, seed;
    const Prediction *asked;
    double *tangent, *stage, *slopes[4]; /* (n_directions, 13) each */
} Shooter;

/* Computes the rate of the model's state at a fraction of step k, and that of each direction's tangent in `along`. */
static void evaluate(Shooter *s, int k, double part, const double *along, double rate[N_RIGID], double *slope)
{
    const Prediction *asked = s->asked;
    const double *wrench = asked->wrench + 12 * (size_t)k, *force = asked->force, off = part - 0.5;
    double R[3][3], dR[3][3], dwater[3], tau[6], pushed[3];

    plant_rotation(s->model.state.rigid + 3, R);
    for (int i = 0; i < 6; i++)
        tau[i] = wrench[i] + off * wrench[6 + i];
    to_body((const double(*)[3])R, force, pushed);
    for (int i = 0; i < 3; i++)
        tau[i] += pushed[i];
    plant_derivative(&s->model.plant, &s->model.held.drift, s->model.time, s->model.state.rigid, tau, rate);

    for (int j = 0; j < asked->n_directions; j++) {
        const int parameter = asked->parameter_directions[j], input = asked->input_directions[j];
        const double *dforce = asked->force_tangents + 3 * (size_t)j;
        double dtau[6] = {0.0}, turned[3];

        memcpy(s->seed.state.rigid, along + N_RIGID * (size_t)j, sizeof s->seed.state.rigid);
        rotation_tangent(s->model.state.rigid + 3, s->seed.state.rigid + 3, dR);
        to_body((const double(*)[3])dR, force, turned);
        to_body((const double(*)[3])R, dforce, pushed);
        for (int i = 0; i < 3; i++)
            dtau[i] = turned[i] + pushed[i];
        if (input >= 0) {
            const double *change = asked->wrench_tangents + 12 * ((size_t)input * asked->n_steps + k);
            for (int i = 0; i < 6; i++)
                dtau[i] += change[i] + off * change[6 + i];
        }
        double *seeded = parameter >= 0 ? variable_real(&s->seed, &VARIABLES[parameter]) : NULL;
        if (seeded)
            *seeded = 1.0;
        derivative_tangent(&s->model, &s->seed, rate, dtau, R, dR, dwater, slope + N_RIGID * (size_t)j);
        if (seeded)
            *seeded = 0.0;
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
static int normalise(Shooter *s)
{
    double *e = s->model.state.rigid + 3;
    const double norm = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]);

    if (!plant_normalise(s->model.state.rigid))
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
    return is_a_motion(s->model.state.rigid) && normalise(s);
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
    memcpy(s.model.state.rigid, asked->start, sizeof s.model.state.rigid);
    memcpy(s.tangent, asked->start_tangents, size * sizeof(double));
    if (!is_a_motion(s.model.state.rigid) || !normalise(&s))
        return LOST;
    for (int k = 0, next = 0; k < asked->n_steps; k++)
        if (!advance(&s, k, &next))
            return LOST;
    return NULL;
}
