/* An FMU that behaves well or badly, as its parameter `mode` says, from its parameter `at` [s] on. */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum {
    OK, ERROR, FATAL, DISCARD, END, HANG, NOT_A_NUMBER, NULL_MESSAGE, SHORT, WARNED, PERCENT, NO_INPUT, FORMATS, TETHER,
    CURRENT, PUCK
};

/* places in v, which are the value references */
enum { MODE, AT, GAIN, START, INPUTS = 10, OUTPUTS = 20, NO_ROLLBACK = 29, MATRIX = 30, POSE = 40, MOVED = 52, SIZE = 56 };

#if FMI == 2
#include "fmi2Functions.h"
#define STATUS fmi2Status
#define S(name) fmi2##name
typedef fmi2CallbackLogger Logger;
#define LOG(f, status, ...) (f)->log((f)->environment, "it", status, "all", __VA_ARGS__)
#else
#include "fmi3Functions.h"
#define STATUS fmi3Status
#define S(name) fmi3##name
typedef fmi3LogMessageCallback Logger;
#define LOG(f, status, message, ...) (f)->log((f)->environment, status, "all", message)
#endif

typedef struct {
    double v[SIZE], time, last;
    bool logs;
    Logger log;
    void *environment;
} Fmu;

static Fmu *create(bool logs, Logger log, void *environment)
{
    Fmu *f = calloc(1, sizeof *f);

    f->v[GAIN] = 1.0;
    f->logs = logs;
    f->log = log;
    f->environment = environment;
    return f;
}

static void transfer(Fmu *f, const unsigned r[], size_t n, double *x, bool set)
{
    for (size_t i = 0; i < n; i++)
        for (unsigned j = r[i]; j < r[i] + (r[i] == MATRIX ? 4u : 1u); j++, x++) {
            if (set)
                f->v[j] = *x;
            else
                *x = f->v[j];
        }
}

/* A line to the surface: position in, force out, world frame NED. */
static void tether(Fmu *f, double h)
{
    const double *r = f->v + INPUTS, length = sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]), before = f->v[MOVED];
    const double tension = length > 1.0 ? f->v[GAIN] * (length - 1.0) + 50.0 * (length - before) / h : 0.0;

    f->v[MOVED] = length;
    for (int i = 0; i < 3; i++)
        f->v[OUTPUTS + i] = tension > 0.0 ? -tension * r[i] / length : 0.0;
}

/* A current that sets in, and turns with depth: depth in, velocity north and east out. */
static void current(Fmu *f, double t)
{
    const double speed = f->v[GAIN] * (1.0 - exp(-t / 2.0));

    f->v[OUTPUTS] = speed * cos(0.3 * f->v[INPUTS]);
    f->v[OUTPUTS + 1] = speed * sin(0.3 * f->v[INPUTS]);
}

/* A plant without drag, of mass GAIN, which turns about its vertical axis: wrench in, position, angles and their
   rates out, world frame NED. */
static void puck(Fmu *f, double h)
{
    const double *wrench = f->v + INPUTS, yaw = f->v[POSE + 5], c = cos(yaw), s = sin(yaw), m = f->v[GAIN];
    const double force[] = {c * wrench[0] - s * wrench[1], s * wrench[0] + c * wrench[1], wrench[2]};

    for (int i = 0; i < 3; i++) {
        f->v[POSE + 6 + i] += h * force[i] / m;
        f->v[MOVED + i] += h * f->v[POSE + 6 + i];
        f->v[POSE + i] = f->v[START + i] + f->v[MOVED + i];
    }
    f->v[POSE + 11] += h * wrench[5] / m;
    f->v[POSE + 5] += h * f->v[POSE + 11];
}

static STATUS begin(Fmu *f)
{
    memcpy(f->v + POSE, f->v + START, 3 * sizeof f->v[0]);
    if (f->v[MODE] == OK && f->v[INPUTS] != 0.0)
        f->v[OUTPUTS] = f->v[GAIN] * f->v[INPUTS];
    return S(OK);
}

static STATUS step(Fmu *f, double now, double h, bool no_rollback)
{
    const int mode = now >= f->v[AT] - 1e-9 ? (int)f->v[MODE] : OK;

    f->last = now + h;
    f->v[NO_ROLLBACK] = no_rollback;
    for (int i = 0; i < NO_ROLLBACK - OUTPUTS; i++)
        f->v[OUTPUTS + i] = mode == NOT_A_NUMBER ? NAN : f->v[GAIN] * f->v[INPUTS + i];
    if (mode == TETHER)
        tether(f, h);
    else if (mode == CURRENT)
        current(f, now + h);
    else if (mode == PUCK)
        puck(f, h);
    if (mode == DISCARD || mode == END || mode == SHORT)
        f->last = now + 0.5 * h;
    switch (mode) {
    case ERROR:
        if (f->logs)
            LOG(f, S(Error), "%d of %s is %.3f, %5.1f%% of %lu", -7, "x", 0.25, 12.5, 99ul);
        return S(Error);
    case FATAL:
        if (f->logs)
            LOG(f, S(Fatal), "out of memory");
        return S(Fatal);
    case NULL_MESSAGE:
        LOG(f, S(Error), NULL);
        return S(Error);
    case PERCENT: /* no format, but written as if it were one */
        LOG(f, S(Error), "fails at 50% speed");
        return S(Error);
    case FORMATS: /* none of them fits its argument, or any memory */
        LOG(f, S(Error), "a %s b %s c %*d d %2147483647d %.99999999999f %q", (char *)1234567, (char *)-1, 2000000000, 1);
        return S(Error);
    case WARNED:
        LOG(f, S(Warning), "x is too large");
        return S(Error);
    case DISCARD:
    case END:
        return S(Discard);
    case HANG:
        for (volatile int i = 0;; i++)
            ;
    default:
        return S(OK);
    }
}

static STATUS set(Fmu *f, const unsigned r[], size_t n, const double *x)
{
    transfer(f, r, n, (double *)x, true);
    return (int)f->v[MODE] == NO_INPUT && f->last >= f->v[AT] - 1e-9 ? S(Discard) : S(OK);
}

static STATUS say(Fmu *f, const char *what)
{
    if (f->logs)
        LOG(f, S(Warning), what);
    return S(OK);
}

#if FMI == 2
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logs)
{
    (void)name, (void)type, (void)token, (void)resources, (void)visible;
    return create(logs, callbacks->logger, callbacks->componentEnvironment);
}
fmi2Status fmi2SetupExperiment(fmi2Component f, fmi2Boolean a, fmi2Real tolerance, fmi2Real start, fmi2Boolean b, fmi2Real stop)
{
    (void)a, (void)b;
    memset(((Fmu *)f)->v, 0, sizeof ((Fmu *)f)->v); /* as FMUs of 20-sim forget what was set before */
    ((Fmu *)f)->v[GAIN] = 1.0;
    ((Fmu *)f)->v[OUTPUTS] = tolerance;
    ((Fmu *)f)->v[OUTPUTS + 1] = stop;
    ((Fmu *)f)->time = start;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component f) { return (void)f, fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component f) { return begin(f); }
fmi2Status fmi2GetReal(fmi2Component f, const fmi2ValueReference r[], size_t n, fmi2Real x[])
{
    transfer(f, r, n, x, false);
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component f, const fmi2ValueReference r[], size_t n, const fmi2Real x[])
{
    return set(f, r, n, x);
}
fmi2Status fmi2DoStep(fmi2Component f, fmi2Real now, fmi2Real h, fmi2Boolean no_rollback) { return step(f, now, h, no_rollback); }
fmi2Status fmi2GetRealStatus(fmi2Component f, const fmi2StatusKind kind, fmi2Real *x)
{
    *x = ((Fmu *)f)->last;
    return kind == fmi2LastSuccessfulTime ? fmi2OK : fmi2Discard;
}
fmi2Status fmi2GetBooleanStatus(fmi2Component f, const fmi2StatusKind kind, fmi2Boolean *x)
{
    *x = ((Fmu *)f)->v[MODE] == END;
    return kind == fmi2Terminated ? fmi2OK : fmi2Discard;
}
fmi2Status fmi2GetFMUstate(fmi2Component f, fmi2FMUstate *s) { return *s = memcpy(malloc(sizeof(Fmu)), f, sizeof(Fmu)), fmi2OK; }
fmi2Status fmi2SetFMUstate(fmi2Component f, fmi2FMUstate s) { return memcpy(f, s, sizeof(Fmu)), fmi2OK; }
fmi2Status fmi2FreeFMUstate(fmi2Component f, fmi2FMUstate *s) { return (void)f, free(*s), *s = NULL, fmi2OK; }
#else
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logs, fmi3Boolean event_mode, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)event_mode, (void)early, (void)required, (void)n, (void)update;
    return create(logs, log, environment);
}
fmi3Status fmi3EnterInitializationMode(fmi3Instance f, fmi3Boolean a, fmi3Float64 tolerance, fmi3Float64 start, fmi3Boolean b, fmi3Float64 stop)
{
    (void)a, (void)b;
    ((Fmu *)f)->v[OUTPUTS] = tolerance;
    ((Fmu *)f)->v[OUTPUTS + 1] = stop;
    ((Fmu *)f)->time = start;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance f) { return begin(f); }
fmi3Status fmi3GetFloat64(fmi3Instance f, const fmi3ValueReference r[], size_t n, fmi3Float64 x[], size_t m)
{
    (void)m;
    transfer(f, r, n, x, false);
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance f, const fmi3ValueReference r[], size_t n, const fmi3Float64 x[], size_t m)
{
    (void)m;
    return set(f, r, n, x);
}
fmi3Status fmi3DoStep(fmi3Instance f, fmi3Float64 now, fmi3Float64 h, fmi3Boolean no_rollback, fmi3Boolean *event,
                      fmi3Boolean *end, fmi3Boolean *early, fmi3Float64 *last)
{
    const fmi3Status status = step(f, now, h, no_rollback);

    *event = *early = false;
    *end = ((Fmu *)f)->v[MODE] == END && status == fmi3Discard;
    *last = ((Fmu *)f)->last;
    return status;
}
fmi3Status fmi3GetFMUState(fmi3Instance f, fmi3FMUState *s) { return *s = memcpy(malloc(sizeof(Fmu)), f, sizeof(Fmu)), fmi3OK; }
fmi3Status fmi3SetFMUState(fmi3Instance f, fmi3FMUState s) { return memcpy(f, s, sizeof(Fmu)), fmi3OK; }
fmi3Status fmi3FreeFMUState(fmi3Instance f, fmi3FMUState *s) { return (void)f, free(*s), *s = NULL, fmi3OK; }
#endif

STATUS S(Terminate)(void *f) { return say(f, "terminated"); }
void S(FreeInstance)(void *f)
{
    say(f, "freed");
    free(f);
}
STATUS S(Reset)(void *f)
{
    memset(((Fmu *)f)->v, 0, sizeof ((Fmu *)f)->v);
    ((Fmu *)f)->v[GAIN] = 1.0;
    return S(OK);
}
