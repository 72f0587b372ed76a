/* FMI 2.0, co-simulation and model exchange, over instance.h. */
#include <math.h>

#include "instance.h" /* names the functions, before */
#include "fmi2Functions.h"

#define FMI(x) fmi2##x

/* FMI 2.0's spelling of FMI 3.0's names */
#define FMUState FMUstate
#define continuousStates x
#define nominals x_nominal
#define fmi2Instance fmi2Component
#define fmi2FMUState fmi2FMUstate
#define fmi2GetFMUState fmi2GetFMUstate
#define fmi2SetFMUState fmi2SetFMUstate
#define fmi2FreeFMUState fmi2FreeFMUstate
#define fmi2SerializedFMUStateSize fmi2SerializedFMUstateSize
#define fmi2SerializeFMUState fmi2SerializeFMUstate
#define fmi2DeserializeFMUState fmi2DeSerializeFMUstate
#define fmi2GetContinuousStateDerivatives fmi2GetDerivatives

#include "common_functions.h"

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

/* ---- version, logging, life -------------------------------------------------------------------------------- */

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    (void)fmuResourceLocation, (void)visible;
    if (!functions)
        return NULL;
    const Interface kind = fmuType == fmi2CoSimulation ? CO_SIMULATION : fmuType == fmi2ModelExchange ? MODEL_EXCHANGE : NO_INTERFACE;
    return instance_create(instanceName, fmuGUID, kind, loggingOn != fmi2False, log_message,
                           functions->componentEnvironment, (void (*)(void))functions->logger);
}

fmi2Status fmi2SetupExperiment(fmi2Component instance, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime)
{
    return (fmi2Status)instance_set_experiment(instance, toleranceDefined ? tolerance : 0.0, startTime, stopTimeDefined ? stopTime : INFINITY);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component instance)
{
    return (fmi2Status)instance_enter_initialization(instance);
}

/* ---- variables --------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    REFUSE_NULL(nvr, vr, value);
    return (fmi2Status)instance_get_reals(instance, vr, nvr, value, nvr);
}

fmi2Status fmi2SetReal(fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    REFUSE_NULL(nvr, vr, value);
    return (fmi2Status)instance_set_reals(instance, vr, nvr, value, nvr);
}

#define INTEGERS(type, Type)                                                                                              \
    fmi2Status fmi2Get##type(fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, fmi2##type value[])       \
    {                                                                                                                     \
        REFUSE_NULL(nvr, vr, value);                                                                                      \
        for (size_t i = 0; i < nvr; i++)                                                                                  \
            if (instance_get_integer(instance, Type, vr[i], &value[i]) != STATUS_OK)                                      \
                return fmi2Error;                                                                                         \
        return fmi2OK;                                                                                                    \
    }                                                                                                                     \
                                                                                                                          \
    fmi2Status fmi2Set##type(fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, const fmi2##type value[]) \
    {                                                                                                                     \
        REFUSE_NULL(nvr, vr, value);                                                                                      \
        for (size_t i = 0; i < nvr; i++)                                                                                  \
            if (instance_set_integer(instance, Type, vr[i], value[i]) != STATUS_OK)                                       \
                return fmi2Error;                                                                                         \
        return fmi2OK;                                                                                                    \
    }

INTEGERS(Integer, TYPE_INTEGER)
INTEGERS(Boolean, TYPE_BOOLEAN) /* an int, too */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component instance, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown,
                                        const fmi2Real dvKnown[], fmi2Real dvUnknown[])
{
    REFUSE_NULL(nUnknown, vUnknown_ref, dvUnknown);
    REFUSE_NULL(nKnown, vKnown_ref, dvKnown);
    const Selection unknowns = {vUnknown_ref, nUnknown, nUnknown}, knowns = {vKnown_ref, nKnown, nKnown};
    return (fmi2Status)instance_directional_derivative(instance, unknowns, knowns, dvKnown, dvUnknown);
}

/* ---- co-simulation ----------------------------------------------------------------------------------------- */

fmi2Status fmi2DoStep(fmi2Component instance, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    return (fmi2Status)instance_step(instance, currentCommunicationPoint, communicationStepSize);
}

fmi2Status fmi2GetRealStatus(fmi2Component instance, const fmi2StatusKind s, fmi2Real *value)
{
    REFUSE_NULL(1, value);
    if (s != fmi2LastSuccessfulTime)
        return (fmi2Status)instance_unsupported(instance, "fmi2GetRealStatus of this kind");
    *value = ((const Instance *)instance)->model.time;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component instance, const fmi2StatusKind s, fmi2Boolean *value)
{
    REFUSE_NULL(1, value);
    if (s != fmi2Terminated)
        return (fmi2Status)instance_unsupported(instance, "fmi2GetBooleanStatus of this kind");
    *value = fmi2False; /* no component terminates a simulation */
    return fmi2OK;
}

/* ---- model exchange ---------------------------------------------------------------------------------------- */

fmi2Status fmi2EnterEventMode(fmi2Component instance)
{
    return (fmi2Status)instance_enter_event_mode(instance, MODE_EVENT | MODE_CONTINUOUS); /* repeating it is allowed in 2.0 */
}

fmi2Status fmi2NewDiscreteStates(fmi2Component instance, fmi2EventInfo *fmi2eventInfo)
{
    REFUSE_NULL(1, fmi2eventInfo);
    bool again = false, changed = false;
    double next = INFINITY;
    const Status status = instance_update_discrete(instance, &again, &changed, &next);

    fmi2eventInfo->newDiscreteStatesNeeded = again ? fmi2True : fmi2False;
    fmi2eventInfo->terminateSimulation = fmi2False;
    fmi2eventInfo->nominalsOfContinuousStatesChanged = fmi2False;
    fmi2eventInfo->valuesOfContinuousStatesChanged = changed ? fmi2True : fmi2False;
    fmi2eventInfo->nextEventTimeDefined = isfinite(next) ? fmi2True : fmi2False;
    fmi2eventInfo->nextEventTime = isfinite(next) ? next : 0.0;
    return (fmi2Status)status;
}

/* ---- what this FMU does not offer: logged, and an error ----------------------------------------------------- */

#define UNSUPPORTED(function, parameters, ...)                        \
    fmi2Status function parameters                                    \
    {                                                                 \
        __VA_ARGS__;                                                  \
        return (fmi2Status)instance_unsupported(instance, #function); \
    }

/* an empty list of variables is allowed */
#define UNSUPPORTED_VALUES(function, type)                                                               \
    fmi2Status function(fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, type value[]) \
    {                                                                                                    \
        (void)vr, (void)value;                                                                           \
        return instance && nvr == 0 ? fmi2OK : (fmi2Status)instance_unsupported(instance, #function);    \
    }

#define UNSUPPORTED_DERIVATIVES(function, type)                                                                       \
    fmi2Status function(fmi2Component instance, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[], \
                        type value[])                                                                                 \
    {                                                                                                                 \
        (void)vr, (void)order, (void)value;                                                                           \
        return instance && nvr == 0 ? fmi2OK : (fmi2Status)instance_unsupported(instance, #function);                 \
    }

UNSUPPORTED_VALUES(fmi2GetString, fmi2String)
UNSUPPORTED_VALUES(fmi2SetString, const fmi2String)
UNSUPPORTED_DERIVATIVES(fmi2SetRealInputDerivatives, const fmi2Real)
UNSUPPORTED_DERIVATIVES(fmi2GetRealOutputDerivatives, fmi2Real)
UNSUPPORTED(fmi2CancelStep, (fmi2Component instance), (void)0)
UNSUPPORTED(fmi2GetStatus, (fmi2Component instance, const fmi2StatusKind s, fmi2Status *v), (void)s, (void)v)
UNSUPPORTED(fmi2GetIntegerStatus, (fmi2Component instance, const fmi2StatusKind s, fmi2Integer *v), (void)s, (void)v)
UNSUPPORTED(fmi2GetStringStatus, (fmi2Component instance, const fmi2StatusKind s, fmi2String *v), (void)s, (void)v)
