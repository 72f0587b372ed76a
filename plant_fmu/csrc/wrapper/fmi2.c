/* FMI 2.0, co-simulation and model exchange, over instance.h. */
#include <math.h>

#include "instance.h" /* names the functions, before */
#include "fmi2Functions.h"

/* The importer's logger is variadic, like printf. The message goes as the format itself, each % doubled, so that it also
 * reaches importers that cannot read variadic arguments. */
static void log_message(const Instance *instance, Status status, const char *category, const char *message)
{
    char format[2 * MAX_MESSAGE];
    size_t n = 0;

    if (!instance->logger)
        return;
    for (; *message && n < sizeof format - 2; message++) {
        format[n++] = *message;
        if (*message == '%')
            format[n++] = '%';
    }
    format[n] = '\0';
    ((fmi2CallbackLogger)instance->logger)(instance->environment, instance->name, (fmi2Status)status, category, format);
}

/* Refuses a call without an instance, or with NULL as one of the pointers to n values each. */
#define REFUSE_NULL(n, ...)                                    \
    do {                                                       \
        if (!CHECK_POINTERS(c, n, __VA_ARGS__))                \
            return fmi2Error;                                  \
    } while (0)

/* ---- version, logging, life -------------------------------------------------------------------------------- */

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[])
{
    REFUSE_NULL(nCategories, categories);
    return (fmi2Status)instance_set_logging(c, loggingOn != fmi2False, nCategories, categories);
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    (void)fmuResourceLocation, (void)visible;
    if (!functions)
        return NULL;
    return instance_create(instanceName, fmuGUID, fmuType == fmi2ModelExchange ? MODEL_EXCHANGE : CO_SIMULATION,
                           loggingOn != fmi2False, log_message, functions->componentEnvironment,
                           (void (*)(void))functions->logger);
}

void fmi2FreeInstance(fmi2Component c)
{
    instance_free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    (void)toleranceDefined, (void)tolerance;
    return (fmi2Status)instance_set_experiment(c, startTime, stopTimeDefined ? stopTime : INFINITY);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return (fmi2Status)instance_enter_initialization(c);
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    return (fmi2Status)instance_exit_initialization(c);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    return (fmi2Status)instance_terminate(c);
}

fmi2Status fmi2Reset(fmi2Component c)
{
    REFUSE_NULL(1, c);
    return (fmi2Status)instance_reset(c);
}

/* ---- variables --------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    REFUSE_NULL(nvr, vr, value);
    return (fmi2Status)instance_get_reals(c, vr, nvr, value);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    REFUSE_NULL(nvr, vr, value);
    return (fmi2Status)instance_set_reals(c, vr, nvr, value);
}

#define INTEGERS(type, Type)                                                                                       \
    fmi2Status fmi2Get##type(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2##type value[])       \
    {                                                                                                              \
        REFUSE_NULL(nvr, vr, value);                                                                               \
        for (size_t i = 0; i < nvr; i++)                                                                           \
            if (instance_get_integer(c, Type, vr[i], &value[i]) != STATUS_OK)                                      \
                return fmi2Error;                                                                                  \
        return fmi2OK;                                                                                             \
    }                                                                                                              \
                                                                                                                   \
    fmi2Status fmi2Set##type(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2##type value[]) \
    {                                                                                                              \
        REFUSE_NULL(nvr, vr, value);                                                                               \
        for (size_t i = 0; i < nvr; i++)                                                                           \
            if (instance_set_integer(c, Type, vr[i], value[i]) != STATUS_OK)                                       \
                return fmi2Error;                                                                                  \
        return fmi2OK;                                                                                             \
    }

INTEGERS(Integer, TYPE_INTEGER)
INTEGERS(Boolean, TYPE_BOOLEAN) /* an int, too */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown,
                                        const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    REFUSE_NULL(nUnknown, vUnknown_ref, dvUnknown);
    REFUSE_NULL(nKnown, vKnown_ref, dvKnown);
    return (fmi2Status)instance_directional_derivative(c, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, dvUnknown);
}

/* ---- FMU state --------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    REFUSE_NULL(1, FMUstate);
    return (fmi2Status)instance_save(c, (Saved **)FMUstate);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    REFUSE_NULL(1, FMUstate);
    return (fmi2Status)instance_restore(c, FMUstate);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    REFUSE_NULL(1, c);
    return (fmi2Status)instance_free_saved(c, (Saved **)FMUstate);
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size)
{
    REFUSE_NULL(1, FMUstate, size);
    return (fmi2Status)instance_serialized_size(c, FMUstate, size);
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size)
{
    REFUSE_NULL(1, FMUstate, serializedState);
    return (fmi2Status)instance_serialize(c, FMUstate, (unsigned char *)serializedState, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size, fmi2FMUstate *FMUstate)
{
    REFUSE_NULL(1, serializedState, FMUstate);
    return (fmi2Status)instance_deserialize(c, (const unsigned char *)serializedState, size, (Saved **)FMUstate);
}

/* ---- co-simulation ----------------------------------------------------------------------------------------- */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    return (fmi2Status)instance_step(c, currentCommunicationPoint, communicationStepSize);
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    REFUSE_NULL(1, value);
    if (s != fmi2LastSuccessfulTime)
        return (fmi2Status)instance_unsupported(c, "fmi2GetRealStatus of this kind");
    *value = ((const Instance *)c)->model.time;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value)
{
    REFUSE_NULL(1, value);
    if (s != fmi2Terminated)
        return (fmi2Status)instance_unsupported(c, "fmi2GetBooleanStatus of this kind");
    *value = fmi2False; /* no component terminates a simulation */
    return fmi2OK;
}

/* ---- model exchange ---------------------------------------------------------------------------------------- */

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    return (fmi2Status)instance_enter_event_mode(c, MODE_EVENT | MODE_CONTINUOUS); /* repeating it is allowed in 2.0 */
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *fmi2eventInfo)
{
    REFUSE_NULL(1, fmi2eventInfo);
    bool changed = false;
    double next = INFINITY;
    const Status status = instance_update_discrete(c, &changed, &next);

    fmi2eventInfo->newDiscreteStatesNeeded = fmi2False;
    fmi2eventInfo->terminateSimulation = fmi2False;
    fmi2eventInfo->nominalsOfContinuousStatesChanged = fmi2False;
    fmi2eventInfo->valuesOfContinuousStatesChanged = changed ? fmi2True : fmi2False;
    fmi2eventInfo->nextEventTimeDefined = isfinite(next) ? fmi2True : fmi2False;
    fmi2eventInfo->nextEventTime = isfinite(next) ? next : 0.0;
    return (fmi2Status)status;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    return (fmi2Status)instance_enter_continuous_mode(c);
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi2Boolean *enterEventMode, fmi2Boolean *terminateSimulation)
{
    REFUSE_NULL(1, enterEventMode, terminateSimulation);
    (void)noSetFMUStatePriorToCurrentPoint;
    *enterEventMode = fmi2False;
    *terminateSimulation = fmi2False;
    return (fmi2Status)instance_require(c, MODE_CONTINUOUS, "completing an integrator step");
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    return (fmi2Status)instance_set_time(c, time);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx)
{
    REFUSE_NULL(nx, x);
    return (fmi2Status)instance_set_states(c, x, nx);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx)
{
    REFUSE_NULL(nx, derivatives);
    return (fmi2Status)instance_get_derivatives(c, derivatives, nx);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni)
{
    REFUSE_NULL(ni, eventIndicators);
    return ni == 0 ? fmi2OK : (fmi2Status)instance_refuse(c, "fmi2GetEventIndicators: there are none");
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx)
{
    REFUSE_NULL(nx, x);
    return (fmi2Status)instance_get_states(c, x, nx);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx)
{
    REFUSE_NULL(nx, x_nominal);
    return (fmi2Status)instance_get_nominals(c, x_nominal, nx);
}

/* ---- what this FMU does not offer: logged, and an error ----------------------------------------------------- */

#define UNSUPPORTED(function, parameters, ...)                     \
    fmi2Status function parameters                                 \
    {                                                              \
        __VA_ARGS__;                                               \
        return (fmi2Status)instance_unsupported(c, #function);     \
    }

/* an empty list of variables is allowed */
#define UNSUPPORTED_VALUES(function, type)                                                            \
    fmi2Status function(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, type value[])     \
    {                                                                                                 \
        (void)vr, (void)value;                                                                        \
        return c && nvr == 0 ? fmi2OK : (fmi2Status)instance_unsupported(c, #function);               \
    }

#define UNSUPPORTED_DERIVATIVES(function, type)                                                             \
    fmi2Status function(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[], \
                        type value[])                                                                       \
    {                                                                                                       \
        (void)vr, (void)order, (void)value;                                                                 \
        return c && nvr == 0 ? fmi2OK : (fmi2Status)instance_unsupported(c, #function);                     \
    }

UNSUPPORTED_VALUES(fmi2GetString, fmi2String)
UNSUPPORTED_VALUES(fmi2SetString, const fmi2String)
UNSUPPORTED_DERIVATIVES(fmi2SetRealInputDerivatives, const fmi2Real)
UNSUPPORTED_DERIVATIVES(fmi2GetRealOutputDerivatives, fmi2Real)
UNSUPPORTED(fmi2CancelStep, (fmi2Component c), (void)0)
UNSUPPORTED(fmi2GetStatus, (fmi2Component c, const fmi2StatusKind s, fmi2Status *v), (void)s, (void)v)
UNSUPPORTED(fmi2GetIntegerStatus, (fmi2Component c, const fmi2StatusKind s, fmi2Integer *v), (void)s, (void)v)
UNSUPPORTED(fmi2GetStringStatus, (fmi2Component c, const fmi2StatusKind s, fmi2String *v), (void)s, (void)v)
