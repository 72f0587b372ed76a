/* Calls the FMI functions in random orders with random values, as no importer would: fuzz SEED CALLS.
 * Built with the FMU's own sources and the sanitizers, which end it at the first fault; a number that is none ends it too. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "instance.h"

#if FMI == 2
#include "fmi2Functions.h"
typedef fmi2Component Unit;
typedef fmi2FMUstate Kept;
#else
#include "fmi3Functions.h"
typedef fmi3Instance Unit;
typedef fmi3FMUState Kept;
#endif

enum { MOST = 12, KEPT = 4, WIDEST = 24 /* elements of the greatest array */ };

static uint64_t seed = 88172645463325252u;
static long refused, accepted[32];

static uint64_t draw(uint64_t n)
{
    seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
    return (seed >> 11) % n;
}

static double uniform(void)
{
    return (double)draw(1u << 30) / (1u << 30);
}

/* Mostly what the variable may be, near its start; now and then anything. */
static double value_of(unsigned reference)
{
    static const double odd[] = {NAN, INFINITY, -INFINITY, 0.0, -0.0, 1e308, -1e308, 1e-320, 1e9, -1e9, 1e-6, -1.0};

    if (draw(12) == 0)
        return odd[draw(sizeof odd / sizeof odd[0])];
    const Variable *v = &VARIABLES[reference < N_VARIABLES ? reference : 1];
    if (draw(6) == 0)
        return v->min + uniform() * (v->max - v->min);
    return v->start + (uniform() - 0.5) * (draw(3) ? 0.1 : 3.0) * (v->nominal > 0.0 ? v->nominal : 1.0);
}

/* The number of values of some variables. */
static size_t elements(const unsigned references[], size_t n)
{
    size_t sum = 0;

    for (size_t i = 0; i < n; i++)
        sum += references[i] < N_VARIABLES ? VARIABLES[references[i]].size : 1;
    return sum;
}

/* Mostly as what the variable is. */
static int as_integer(unsigned reference)
{
    return reference < N_VARIABLES && draw(9) ? VARIABLES[reference].type == TYPE_INTEGER : draw(2) != 0;
}

static void check(int status, const double values[], size_t n, const char *what)
{
    for (size_t i = 0; status < 2 && i < n; i++)
        if (!isfinite(values[i])) {
            printf("%s gave %g as value %zu\n", what, values[i], i);
            exit(1);
        }
}

static void count(int which, int status)
{
    if (status < 2)
        accepted[which]++;
    else
        refused++;
}

#if FMI == 2

static void log_callback(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category, fmi2String text, ...)
{
    (void)e;
    if (!name || !category || !text || (int)status < 0)
        abort();
}

static Unit create(int me, int quiet)
{
    static fmi2CallbackFunctions loud = {log_callback, NULL, NULL, NULL, NULL}, silent = {NULL, NULL, NULL, NULL, NULL};
    return fmi2Instantiate(draw(20) ? "x" : NULL, me ? fmi2ModelExchange : fmi2CoSimulation,
                           draw(50) ? INSTANTIATION_TOKEN : "no%s%n", NULL, quiet ? &silent : &loud, 0, draw(2) != 0);
}

#define CALL(name) fmi2##name
#define SET_REALS(c, vr, n, v) fmi2SetReal(c, vr, n, v)
#define GET_REALS(c, vr, n, v) fmi2GetReal(c, vr, n, v)
#define TO_STEP_MODE(c) fmi2Error
#define SAVE(c, s) fmi2GetFMUstate(c, s)
#define RESTORE(c, s) fmi2SetFMUstate(c, s)
#define FREE(c, s) fmi2FreeFMUstate(c, s)
#define SIZE(c, s, n) fmi2SerializedFMUstateSize(c, s, n)
#define PACK(c, s, b, n) fmi2SerializeFMUstate(c, s, (fmi2Byte *)(b), n)
#define UNPACK(c, b, n, s) fmi2DeSerializeFMUstate(c, (const fmi2Byte *)(b), n, s)
#define RATES(c, x, n) fmi2GetDerivatives(c, x, n)
#define JACOBIAN(c, u, nu, k, nk, s, r) fmi2GetDirectionalDerivative(c, u, nu, k, nk, s, r)
#define ADJOINT(c, u, nu, k, nk, s, r) fmi2Error

static int initialize(Unit c)
{
    if (draw(4))
        fmi2SetupExperiment(c, 0, 0.0, draw(9) ? 0.0 : value_of(1), draw(3) == 0, value_of(1));
    return (int)fmi2EnterInitializationMode(c);
}

static int update(Unit c)
{
    fmi2EventInfo info;
    const int status = (int)fmi2NewDiscreteStates(c, &info);
    check(status, &info.nextEventTime, 1, "next event");
    return status;
}

static int step(Unit c, double t, double h)
{
    return (int)fmi2DoStep(c, t, h, 1);
}

static int integers(Unit c, unsigned reference, int value)
{
    fmi2Integer i = value;
    fmi2Boolean b = value & 1;
    fmi2GetInteger(c, &reference, 1, &i);
    fmi2GetBoolean(c, &reference, 1, &b);
    return (int)(as_integer(reference) ? fmi2SetInteger(c, &reference, 1, &value) : fmi2SetBoolean(c, &reference, 1, &b));
}

#else

static void log_callback(fmi3InstanceEnvironment e, fmi3Status status, fmi3String category, fmi3String text)
{
    (void)e;
    if (!category || !text || (int)status < 0)
        abort();
}

static Unit create(int me, int quiet)
{
    const char *token = draw(50) ? INSTANTIATION_TOKEN : "no%s%n", *name = draw(20) ? "x" : NULL;
    return me ? fmi3InstantiateModelExchange(name, token, NULL, 0, draw(2), NULL, quiet ? NULL : log_callback)
              : fmi3InstantiateCoSimulation(name, token, NULL, 0, draw(2), N_CLOCK_VARIABLES > 0 && draw(2), draw(2), NULL, 0, NULL,
                                            quiet ? NULL : log_callback, NULL);
}

#define CALL(name) fmi3##name
#define SET_REALS(c, vr, n, v) fmi3SetFloat64(c, vr, n, v, elements(vr, n) + !draw(50))
#define GET_REALS(c, vr, n, v) fmi3GetFloat64(c, vr, n, v, elements(vr, n))
#define TO_STEP_MODE(c) fmi3EnterStepMode(c)
#define SAVE(c, s) fmi3GetFMUState(c, s)
#define RESTORE(c, s) fmi3SetFMUState(c, s)
#define FREE(c, s) fmi3FreeFMUState(c, s)
#define SIZE(c, s, n) fmi3SerializedFMUStateSize(c, s, n)
#define PACK(c, s, b, n) fmi3SerializeFMUState(c, s, b, n)
#define UNPACK(c, b, n, s) fmi3DeserializeFMUState(c, b, n, s)
#define RATES(c, x, n) fmi3GetContinuousStateDerivatives(c, x, n)
#define JACOBIAN(c, u, nu, k, nk, s, r) fmi3GetDirectionalDerivative(c, u, nu, k, nk, s, elements(k, nk), r, elements(u, nu))
#define ADJOINT(c, u, nu, k, nk, s, r) fmi3GetAdjointDerivative(c, u, nu, k, nk, s, elements(u, nu), r, elements(k, nk))

static int initialize(Unit c)
{
    return (int)fmi3EnterInitializationMode(c, 0, 0.0, draw(9) ? 0.0 : value_of(1), draw(3) == 0, value_of(1));
}

static int update(Unit c)
{
    fmi3Boolean b[5];
    double next;
    const unsigned clock = FIRST_CLOCK + (unsigned)draw(N_CLOCK_VARIABLES + 1);
    fmi3GetClock(c, &clock, 1, &b[0]);
    const int status = (int)fmi3UpdateDiscreteStates(c, &b[0], &b[1], &b[2], &b[3], &b[4], &next);
    check(status, &next, 1, "next event");
    return status;
}

static int step(Unit c, double t, double h)
{
    fmi3Boolean b[3];
    double last;
    return (int)fmi3DoStep(c, t, h, 1, draw(20) ? &b[0] : NULL, &b[1], &b[2], draw(20) ? &last : NULL);
}

static int integers(Unit c, unsigned reference, int value)
{
    fmi3Int32 i[WIDEST] = {value};
    fmi3Boolean b[WIDEST] = {value & 1};
    const size_t n = elements(&reference, 1);
    fmi3GetInt32(c, &reference, 1, i, n);
    fmi3GetBoolean(c, &reference, 1, b, n);
    i[0] = value, b[0] = value & 1;
    return (int)(as_integer(reference) ? fmi3SetInt32(c, &reference, 1, i, n) : fmi3SetBoolean(c, &reference, 1, b, n));
}

#endif

static void serialize(Unit c, Kept from, Kept *to)
{
    size_t size = 0;

    if (SIZE(c, from, &size) > 1 || size == 0)
        return;
    unsigned char *bytes = malloc(size);
    PACK(c, from, bytes, draw(9) ? size : size - 1);
    PACK(c, from, bytes, size);
    if (draw(3) == 0)
        bytes[draw(size)] ^= (unsigned char)(1u << draw(8));
    Kept made = NULL;
    const int status = (int)UNPACK(c, bytes, draw(9) ? size : size - 1, &made);
    count(0, status);
    if (status < 2) {
        FREE(c, to);
        *to = made;
    }
    free(bytes);
}

/* One random call. */
static void call(Unit c, Kept kept[KEPT], double *t)
{
    unsigned vr[MOST], other[MOST];
    double v[MOST * WIDEST + 1], w[MOST * WIDEST], x[N_STATES + 1];
    size_t next = 0;
    const size_t n = draw(MOST), m = draw(MOST);
    const int which = (int)draw(24);
    int status = 0;

    for (size_t i = 0; i < MOST; i++) {
        vr[i] = (unsigned)draw(N_VARIABLES + 2);
        other[i] = (unsigned)draw(N_VARIABLES + 2);
        if (draw(100)) { /* else a reference of the wrong kind */
            while (vr[i] >= N_VARIABLES || VARIABLES[vr[i]].type != TYPE_REAL || (which < 3 && VARIABLES[vr[i]].role == OUTPUT))
                vr[i] = (unsigned)draw(N_VARIABLES);
            while (other[i] >= N_VARIABLES || VARIABLES[other[i]].role == OUTPUT || VARIABLES[other[i]].type != TYPE_REAL)
                other[i] = (unsigned)draw(N_VARIABLES);
        }
        for (size_t k = elements(&vr[i], 1); k > 0; k--)
            v[next++] = value_of(vr[i]);
    }
    for (size_t i = 0; i < MOST * WIDEST; i++)
        w[i] = 2.0 * uniform() - 1.0;
    for (int i = 0; i < N_STATES + 1; i++)
        x[i] = value_of((unsigned)(FIRST_STATE + i));

    switch (which) {
    case 0: case 1: case 2: status = (int)SET_REALS(c, vr, n > 3 ? 1 : n, v); break;
    case 3: case 4: status = (int)GET_REALS(c, vr, n, v); check(status, v, elements(vr, n), "get"); break;
    case 5: case 6: status = integers(c, draw(9) ? N_VARIABLES - 1 - (unsigned)draw(14) : vr[0], (int)draw(5) - 1); break;
    case 7: status = initialize(c); break;
    case 8: status = (int)CALL(ExitInitializationMode)(c); break;
    case 9: status = draw(30) ? 2 : (int)CALL(Terminate)(c); break;
    case 10: status = 2; if (draw(30) == 0) { status = (int)CALL(Reset)(c); *t = 0.0; } break;
    case 11: case 12: case 13: {
        const double h = draw(5) ? 0.01 : value_of(0) * 1e-2;
        status = step(c, draw(20) ? ((Instance *)c)->model.time : value_of(0), h > 1.0 ? 1e300 : h);
        break;
    }
    case 14: status = (int)SAVE(c, &kept[draw(KEPT)]); break;
    case 15: status = (int)RESTORE(c, kept[draw(KEPT)]); break;
    case 16: status = (int)FREE(c, &kept[draw(KEPT)]); break;
    case 17: serialize(c, kept[draw(KEPT)], &kept[draw(KEPT)]); break;
    case 18:
        status = (int)(draw(2) ? CALL(EnterEventMode)(c) : draw(2) ? CALL(EnterContinuousTimeMode)(c) : TO_STEP_MODE(c));
        break;
    case 19: status = update(c); break;
    case 20: *t += draw(10) ? 0.01 : value_of(0); status = (int)CALL(SetTime)(c, *t); break;
    case 21:
        if (draw(3)) { /* a state like the present one */
            CALL(GetContinuousStates)(c, x, N_STATES);
            x[draw(N_STATES)] += 0.1 * w[0];
        }
        status = (int)CALL(SetContinuousStates)(c, x, draw(50) ? N_STATES : N_STATES + 1);
        break;
    case 22: status = (int)RATES(c, x, N_STATES); check(status, x, N_STATES, "rates"); break;
    default:
        if (draw(2)) {
            status = (int)JACOBIAN(c, vr, n, other, m, w, v);
            check(status, v, elements(vr, n), "sensitivity");
        } else {
            status = (int)ADJOINT(c, vr, m, other, n, w, v);
            check(status, v, elements(other, n), "sensitivity");
        }
        break;
    }
    count(which, status);
}

int main(int argc, char **argv)
{
    const long calls = argc > 2 ? atol(argv[2]) : 100000;
    seed ^= argc > 1 ? (uint64_t)atol(argv[1]) * 2654435761u : 0;

    for (long done = 0; done < calls;) {
        const int me = (int)draw(2);
        Unit c = create(me, draw(9) == 0);
        Kept kept[KEPT] = {NULL};
        double t = 0.0;
        if (!c)
            continue;
        if (draw(4)) { /* most runs get through initialization */
            const unsigned state = FIRST_STATE + (unsigned)draw(N_STATES);
            const double start = 0.5;
            if (elements(&state, 1) == 1)
                SET_REALS(c, &state, 1, &start);
            initialize(c);
            CALL(ExitInitializationMode)(c);
            if (me && draw(2)) {
                update(c);
                CALL(EnterContinuousTimeMode)(c);
            }
        }
        for (int k = 0; k < 200; k++, done++)
            call(c, kept, &t);
        for (int k = 0; k < KEPT; k++)
            FREE(c, &kept[k]);
        CALL(FreeInstance)(c);
    }
    printf("%ld refused; accepted", refused);
    for (int k = 0; k < 24; k++)
        printf(" %ld", accepted[k]);
    printf("\n");
    return 0;
}
