#include "instance.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- messages ---------------------------------------------------------------------------------------------- */

static const struct {
    LogCategories category;
    Status status;
    const char *name;
} CATEGORIES[] = {
    {LOG_EVENTS, STATUS_OK, "logEvents"},
    {LOG_WARNINGS, STATUS_WARNING, "logStatusWarning"},
    {LOG_DISCARDS, STATUS_DISCARD, "logStatusDiscard"},
    {LOG_ALL, STATUS_OK, "logAll"},
    {LOG_ERRORS, STATUS_ERROR, "logStatusError"},
};

enum { N_CATEGORIES = sizeof CATEGORIES / sizeof CATEGORIES[0] };

static void log_formatted(const Instance *instance, Status status, const char *category, const char *format,
                          va_list arguments)
{
    char message[MAX_MESSAGE];

    vsnprintf(message, sizeof message, format, arguments);
    instance->log(instance, status, category, message);
}

Status instance_refuse(const Instance *instance, const char *format, ...)
{
    va_list arguments;

    if (!instance || !(instance->categories & LOG_ERRORS))
        return STATUS_ERROR;
    va_start(arguments, format);
    log_formatted(instance, STATUS_ERROR, "logStatusError", format, arguments);
    va_end(arguments);
    return STATUS_ERROR;
}

Status instance_log(const Instance *instance, LogCategories category, const char *format, ...)
{
    for (int i = 0; i < N_CATEGORIES; i++)
        if (CATEGORIES[i].category == category) {
            if (instance->categories & (unsigned)category) {
                va_list arguments;
                va_start(arguments, format);
                log_formatted(instance, CATEGORIES[i].status, CATEGORIES[i].name, format, arguments);
                va_end(arguments);
            }
            return CATEGORIES[i].status;
        }
    return STATUS_OK;
}

Status instance_refuse_null(const Instance *instance, const char *function, const char *names, size_t index)
{
    for (; index > 0; index--)
        names = strchr(names, ',') + 1;
    names += strspn(names, " ");
    return instance_refuse(instance, "%s: %.*s is NULL", function, (int)strcspn(names, ","), names);
}

Status instance_set_logging(Instance *instance, bool on, size_t n, const char *const categories[])
{
    unsigned selected = n == 0 ? LOG_ALL : 0;

    for (size_t i = 0; i < n; i++) {
        int known = 0;
        for (int j = 0; j < N_CATEGORIES; j++)
            if (categories[i] && strcmp(categories[i], CATEGORIES[j].name) == 0) {
                selected |= (unsigned)CATEGORIES[j].category;
                known = 1;
            }
        if (!known)
            return instance_refuse(instance, "log category \"%s\" is unknown",
                                   categories[i] ? categories[i] : "NULL");
    }
    instance->categories = on ? instance->categories | selected : instance->categories & ~selected;
    return STATUS_OK;
}

Status instance_unsupported(const Instance *instance, const char *function)
{
    return instance_refuse(instance, "%s: not offered by this FMU", function);
}

Status instance_require(const Instance *instance, unsigned modes, const char *action)
{
    if (!instance)
        return STATUS_ERROR;
    if ((unsigned)instance->mode & modes)
        return STATUS_OK;
    const unsigned events = instance->has_event_mode ? 0 : MODE_EVENT;
    const unsigned others = instance->kind == CO_SIMULATION ? events | MODE_CONTINUOUS : MODE_STEPPING;
    if (!(modes & ~others))
        return instance_refuse(instance, "%s: not offered in %s", action,
                               instance->kind == CO_SIMULATION ? "co-simulation" : "model exchange");
    const char *when = "after termination";
    switch (instance->mode) {
    case MODE_INSTANTIATED: when = "before initialization"; break;
    case MODE_INITIALIZING: when = "during initialization"; break;
    case MODE_STEPPING: when = "once initialization has ended"; break;
    case MODE_EVENT: when = "in event mode"; break;
    case MODE_CONTINUOUS: when = "in continuous-time mode"; break;
    case MODE_TERMINATED: break;
    }
    return instance_refuse(instance, "%s: not allowed %s", action, when);
}

/* ---- life cycle -------------------------------------------------------------------------------------------------- */

Instance *instance_create(const char *name, const char *token, Interface kind, bool logging_on, LogCallback *log,
                          void *environment, void (*logger)(void))
{
    const char *copy = name ? name : "";
    Instance *instance = calloc(1, sizeof *instance);

    if (!instance)
        return NULL;
    instance->name = malloc(strlen(copy) + 1);
    if (!instance->name) {
        free(instance);
        return NULL;
    }
    strcpy(instance->name, copy);
    instance->kind = kind;
    instance->categories = logging_on ? LOG_ALL : LOG_ERRORS | LOG_WARNINGS; /* errors and warnings until they are switched off */
    instance->log = log;
    instance->environment = environment;
    instance->logger = logger;
    if (!name) {
        instance_refuse(instance, "instance name is NULL, expected a text");
        instance_free(instance);
        return NULL;
    }
    if (!token || strcmp(token, TOKEN) != 0) {
        instance_refuse(instance, "instantiation token is \"%s\", expected \"%s\"", token ? token : "NULL", TOKEN);
        instance_free(instance);
        return NULL;
    }
    if (kind == NO_INTERFACE) {
        instance_refuse(instance, "FMU type is neither model exchange nor co-simulation");
        instance_free(instance);
        return NULL;
    }
    if (kind == MODEL_EXCHANGE && !COMPONENT.apply_unlagged) {
        instance_refuse(instance, "this FMU offers co-simulation alone");
        instance_free(instance);
        return NULL;
    }
    instance_reset(instance);
    return instance;
}

void instance_free(Instance *instance)
{
    if (!instance)
        return;
    free(instance->name);
    free(instance);
}

Status instance_reset(Instance *instance)
{
    variables_start(&instance->model);
    instance->model.stop_time = INFINITY;
    instance->mode = MODE_INSTANTIATED;
    instance->start_time = instance->model.time;
    instance->refused = false;
    instance->unprepared = true;
    instance->outdated = true;
    return STATUS_OK;
}

/* ---- parameters and outputs -------------------------------------------------------------------------------- */

Status instance_prepare(Instance *instance)
{
    if (!instance->unprepared)
        return STATUS_OK;
    if (COMPONENT.prepare(instance) != STATUS_OK)
        return STATUS_ERROR;
    instance->unprepared = false;
    return STATUS_OK;
}

bool instance_is_starting(const Instance *instance)
{
    return instance->mode == MODE_INSTANTIATED || instance->mode == MODE_INITIALIZING;
}

Status instance_update(Instance *instance)
{
    if (!instance->outdated)
        return STATUS_OK;
    if (instance_is_starting(instance)) { /* the outputs will show the first samples */
        COMPONENT.rewind(&instance->model);
        instance->unprepared = true;
    }
    if (instance_prepare(instance) != STATUS_OK)
        return STATUS_ERROR;
    if (COMPONENT.evaluate)
        COMPONENT.evaluate(instance);
    instance->outdated = false;
    return STATUS_OK;
}

/* ---- modes ------------------------------------------------------------------------------------------------- */

Status instance_set_experiment(Instance *instance, double tolerance, double start_time, double stop_time)
{
    if (instance_require(instance, MODE_INSTANTIATED, "setting the experiment") != STATUS_OK)
        return STATUS_ERROR;
    instance->refused = true; /* until all of them are valid */
    if (!(tolerance >= 0.0))
        return instance_refuse(instance, "tolerance is %g, expected a positive number", tolerance);
    if (!(fabs(start_time) <= MAX_TIME))
        return instance_refuse(instance, "start time is %g s, expected a number within %g", start_time, MAX_TIME);
    if (!(stop_time >= start_time))
        return instance_refuse(instance, "stop time is %g s, expected %g s (start time) or later", stop_time, start_time);
    instance->model.time = instance->start_time = start_time;
    instance->model.stop_time = stop_time;
    instance->refused = false;
    return STATUS_OK;
}

Status instance_require_new(const Instance *instance)
{
    if (instance && instance->mode == MODE_INITIALIZING)
        return instance_refuse(instance, "entering initialization: it was entered already and has not ended");
    return instance_require(instance, MODE_INSTANTIATED, "entering initialization");
}

Status instance_enter_initialization(Instance *instance)
{
    if (instance_require_new(instance) != STATUS_OK)
        return STATUS_ERROR;
    if (instance->refused)
        return instance_refuse(instance, "entering initialization: the experiment was refused, set a valid one first");
    instance->mode = MODE_INITIALIZING;
    return STATUS_OK;
}

Status instance_exit_initialization(Instance *instance)
{
    if (instance_require(instance, MODE_INITIALIZING, "leaving initialization") != STATUS_OK)
        return STATUS_ERROR;
    COMPONENT.rewind(&instance->model); /* the clocks start now */
    instance->unprepared = true;
    if (instance_prepare(instance) != STATUS_OK || (COMPONENT.begin && COMPONENT.begin(instance) != STATUS_OK))
        return STATUS_ERROR;
    instance->mode = instance->kind == CO_SIMULATION && !instance->has_event_mode ? MODE_STEPPING : MODE_EVENT;
    instance->outdated = true;
    instance_log(instance, LOG_EVENTS, "initialized at t = %.9g s", instance->model.time);
    return STATUS_OK;
}

Status instance_terminate(Instance *instance)
{
    if (instance_require(instance, MODE_STEPPING | MODE_EVENT | MODE_CONTINUOUS, "terminating") != STATUS_OK)
        return STATUS_ERROR;
    instance->mode = MODE_TERMINATED;
    return STATUS_OK;
}
