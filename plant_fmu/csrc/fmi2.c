/* FMI 2.0 co-simulation over instance.h. */
#include <math.h>

#include "fmi2Functions.h"
#include "instance.h"

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

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[])
{
    (void)c, (void)loggingOn, (void)nCategories, (void)categories; /* errors are always logged, and nothing else */
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean loggingOn)
{
    (void)fmuResourceLocation, (void)visible, (void)loggingOn;
    if (!functions)
        return NULL;
    if (fmuType != fmi2CoSimulation) {
        if (functions->logger)
            functions->logger(functions->componentEnvironment, instanceName, fmi2Error, "logStatusError",
                              "this FMU offers co-simulation, not model exchange");
        return NULL;
    }
    return instance_create(instanceName, fmuGUID, log_message, functions->componentEnvironment,
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
    return (fmi2Status)instance_enter_initialisation(c);
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    return (fmi2Status)instance_exit_initialisation(c);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    return (fmi2Status)instance_terminate(c);
}

fmi2Status fmi2Reset(fmi2Component c)
{
    return (fmi2Status)instance_reset(c);
}

/* ---- variables --------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[])
{
    return (fmi2Status)instance_get_reals(c, vr, nvr, value);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[])
{
    return (fmi2Status)instance_set_reals(c, vr, nvr, value);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[])
{
    for (size_t i = 0; i < nvr; i++) {
        bool flag;
        if (instance_get_flag(c, vr[i], &flag) != STATUS_OK)
            return fmi2Error;
        value[i] = flag ? fmi2True : fmi2False;
    }
    return fmi2OK;
}

/* ---- stepping ---------------------------------------------------------------------------------------------- */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    return (fmi2Status)instance_step(c, currentCommunicationPoint, communicationStepSize);
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value)
{
    if (s != fmi2LastSuccessfulTime)
        return (fmi2Status)instance_unsupported(c, "fmi2GetRealStatus of this kind");
    *value = ((const Instance *)c)->model.time;
    return fmi2OK;
}

/* ---- what this FMU does not offer: logged, and an error ----------------------------------------------------- */

#define UNSUPPORTED(function, parameters, ...)                     \
    fmi2Status function parameters                                 \
    {                                                              \
        __VA_ARGS__;                                               \
        return (fmi2Status)instance_unsupported(c, #function);     \
    }

/* reading or writing no variable at all is no fault */
#define UNSUPPORTED_VALUES(function, type)                                                            \
    fmi2Status function(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, type value[])     \
    {                                                                                                 \
        (void)vr, (void)value;                                                                        \
        return nvr == 0 ? fmi2OK : (fmi2Status)instance_unsupported(c, #function);                    \
    }

UNSUPPORTED_VALUES(fmi2GetInteger, fmi2Integer)
UNSUPPORTED_VALUES(fmi2GetString, fmi2String)
UNSUPPORTED_VALUES(fmi2SetInteger, const fmi2Integer)
UNSUPPORTED_VALUES(fmi2SetBoolean, const fmi2Boolean)
UNSUPPORTED_VALUES(fmi2SetString, const fmi2String)
UNSUPPORTED(fmi2GetFMUstate, (fmi2Component c, fmi2FMUstate *state), (void)state)
UNSUPPORTED(fmi2SetFMUstate, (fmi2Component c, fmi2FMUstate state), (void)state)
UNSUPPORTED(fmi2FreeFMUstate, (fmi2Component c, fmi2FMUstate *state), (void)state)
UNSUPPORTED(fmi2SerializedFMUstateSize, (fmi2Component c, fmi2FMUstate state, size_t *size), (void)state, (void)size)
UNSUPPORTED(fmi2SerializeFMUstate, (fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size),
            (void)state, (void)bytes, (void)size)
UNSUPPORTED(fmi2DeSerializeFMUstate, (fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state),
            (void)bytes, (void)size, (void)state)
UNSUPPORTED(fmi2GetDirectionalDerivative, (fmi2Component c, const fmi2ValueReference unknown[], size_t nUnknown,
                                           const fmi2ValueReference known[], size_t nKnown, const fmi2Real seed[],
                                           fmi2Real sensitivity[]),
            (void)unknown, (void)nUnknown, (void)known, (void)nKnown, (void)seed, (void)sensitivity)
UNSUPPORTED(fmi2EnterEventMode, (fmi2Component c), (void)0)
UNSUPPORTED(fmi2NewDiscreteStates, (fmi2Component c, fmi2EventInfo *info), (void)info)
UNSUPPORTED(fmi2EnterContinuousTimeMode, (fmi2Component c), (void)0)
UNSUPPORTED(fmi2CompletedIntegratorStep, (fmi2Component c, fmi2Boolean noSet, fmi2Boolean *event, fmi2Boolean *stop),
            (void)noSet, (void)event, (void)stop)
UNSUPPORTED(fmi2SetTime, (fmi2Component c, fmi2Real time), (void)time)
UNSUPPORTED(fmi2SetContinuousStates, (fmi2Component c, const fmi2Real x[], size_t n), (void)x, (void)n)
UNSUPPORTED(fmi2GetDerivatives, (fmi2Component c, fmi2Real dx[], size_t n), (void)dx, (void)n)
UNSUPPORTED(fmi2GetEventIndicators, (fmi2Component c, fmi2Real z[], size_t n), (void)z, (void)n)
UNSUPPORTED(fmi2GetContinuousStates, (fmi2Component c, fmi2Real x[], size_t n), (void)x, (void)n)
UNSUPPORTED(fmi2GetNominalsOfContinuousStates, (fmi2Component c, fmi2Real x[], size_t n), (void)x, (void)n)
UNSUPPORTED(fmi2SetRealInputDerivatives, (fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                          const fmi2Integer order[], const fmi2Real v[]),
            (void)vr, (void)n, (void)order, (void)v)
UNSUPPORTED(fmi2GetRealOutputDerivatives, (fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                           const fmi2Integer order[], fmi2Real v[]),
            (void)vr, (void)n, (void)order, (void)v)
UNSUPPORTED(fmi2CancelStep, (fmi2Component c), (void)0)
UNSUPPORTED(fmi2GetStatus, (fmi2Component c, const fmi2StatusKind s, fmi2Status *v), (void)s, (void)v)
UNSUPPORTED(fmi2GetIntegerStatus, (fmi2Component c, const fmi2StatusKind s, fmi2Integer *v), (void)s, (void)v)
UNSUPPORTED(fmi2GetBooleanStatus, (fmi2Component c, const fmi2StatusKind s, fmi2Boolean *v), (void)s, (void)v)
UNSUPPORTED(fmi2GetStringStatus, (fmi2Component c, const fmi2StatusKind s, fmi2String *v), (void)s, (void)v)
