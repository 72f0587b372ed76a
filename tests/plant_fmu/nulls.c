/* Calls every function of FMI with each of its pointers NULL in turn; nulls.py fills in what stands between at signs. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi@FMI@Functions.h"

#define TOKEN "@TOKEN@"
enum { STATES = @STATES@, SOME_STATES = STATES > 0 ? STATES : 1 };

static char said[2000];

#if @FMI@ == 2
typedef fmi2Component Unit;
typedef fmi2FMUstate Kept;
typedef fmi2String Text;

static void log_callback(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status, fmi2String category, fmi2String text, ...)
{
    (void)e, (void)name, (void)status, (void)category;
    snprintf(said + strlen(said), sizeof said - strlen(said), "%s; ", text);
}

static fmi2CallbackFunctions callbacks;
#else
typedef fmi3Instance Unit;
typedef fmi3FMUState Kept;
typedef fmi3String Text;

static void tell(fmi3InstanceEnvironment e, fmi3Status status, fmi3String category, fmi3String text)
{
    (void)e, (void)status, (void)category;
    snprintf(said + strlen(said), sizeof said - strlen(said), "%s; ", text);
}

static fmi3LogMessageCallback log_callback;
#endif

#define CALL(name) fmi@FMI@##name

static const char *const MODES[] = {"instantiated", "initializing", "stepping", "silent", "events", "continuous"};
enum { N_MODES = STATES > 0 ? 6 : 4 };

static Unit c;
static Kept saved, slot;
static size_t size;
static double area[1024]; /* what else a pointer points to */
static Text names[] = {"logAll"};

/* An instance in a mode, and a state of it. Says first what comes next. */
static int begin(int mode, const char *function, const char *argument)
{
    printf("%s\t%s\t%s\t", MODES[mode], function, argument);
    fflush(stdout);
#if @FMI@ == 2
    callbacks.logger = mode == 3 ? NULL : log_callback;
#else
    log_callback = mode == 3 ? NULL : tell;
#endif
    memset(area, 0, sizeof area);
    c = @INSTANTIATE@;
    if (!c)
        exit(2);
    if (mode > 0)
        @START@;
    if (mode > 1)
        CALL(ExitInitializationMode)(c);
    if (mode > 4)
        CALL(EnterContinuousTimeMode)(c);
    saved = slot = NULL;
    CALL(GetFMU@FMUSTATE@)(c, &saved);
    CALL(SerializedFMU@FMUSTATE@Size)(c, saved, &size);
    if (!saved || size > sizeof area)
        exit(3);
    said[0] = '\0';
    return 1;
}

/* Says what came of it, and frees all. */
static void end(int status)
{
    printf("%d\t%s\n", status, said);
    fflush(stdout);
    CALL(FreeFMU@FMUSTATE@)(c, &slot);
    CALL(FreeFMU@FMUSTATE@)(c, &saved);
    CALL(FreeInstance)(c);
}

/* A status for an instance, which is freed. */
static int taken(Unit unit)
{
    CALL(FreeInstance)(unit);
    return unit ? 0 : 3;
}

static void sweep(int mode)
{
    int status;

@CASES@
}

int main(void)
{
    for (int mode = 0; mode < N_MODES; mode++)
        sweep(mode);
    return 0;
}
