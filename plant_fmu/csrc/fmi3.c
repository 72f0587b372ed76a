/* FMI 3.0 co-simulation over instance.h. */
#include <math.h>

#include "fmi3Functions.h"
#include "instance.h"

static void log_message(const Instance *instance, Status status, const char *category, const char *message)
{
    if (instance->logger)
        ((fmi3LogMessageCallback)instance->logger)(instance->environment, (fmi3Status)status, category, message);
}

/* ---- version, logging, life -------------------------------------------------------------------------------- */

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[])
{
    (void)instance, (void)loggingOn, (void)nCategories, (void)categories; /* errors are always logged, nothing else is */
    return fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
                                         fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                         fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables,
                                         fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate)
{
    (void)resourcePath, (void)visible, (void)loggingOn, (void)eventModeUsed, (void)earlyReturnAllowed, (void)intermediateUpdate;
    (void)requiredIntermediateVariables, (void)nRequiredIntermediateVariables;
    return instance_create(instanceName, instantiationToken, log_message, instanceEnvironment,
                           (void (*)(void))logMessage);
}

static fmi3Instance refuse_type(fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage,
                                const char *message)
{
    if (logMessage)
        logMessage(environment, fmi3Error, "logStatusError", message);
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage)
{
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    return refuse_type(instanceEnvironment, logMessage, "this FMU offers co-simulation, not model exchange");
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption)
{
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    return refuse_type(instanceEnvironment, logMessage, "this FMU offers co-simulation, not scheduled execution");
}

void fmi3FreeInstance(fmi3Instance instance)
{
    instance_free(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    (void)toleranceDefined, (void)tolerance;
    if (instance_set_experiment(instance, startTime, stopTimeDefined ? stopTime : INFINITY) != STATUS_OK)
        return fmi3Error;
    return (fmi3Status)instance_enter_initialisation(instance);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    return (fmi3Status)instance_exit_initialisation(instance);
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    return (fmi3Status)instance_terminate(instance);
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    return (fmi3Status)instance_reset(instance);
}

/* ---- variables --------------------------------------------------------------------------------------------- */

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues)
{
    if (nValues != nValueReferences)
        return (fmi3Status)instance_refuse(instance, "fmi3GetFloat64: all variables are scalars");
    return (fmi3Status)instance_get_reals(instance, valueReferences, nValueReferences, values);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues)
{
    if (nValues != nValueReferences)
        return (fmi3Status)instance_refuse(instance, "fmi3SetFloat64: all variables are scalars");
    return (fmi3Status)instance_set_reals(instance, valueReferences, nValueReferences, values);
}

fmi3Status fmi3GetBoolean(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Boolean values[], size_t nValues)
{
    if (nValues != nValueReferences)
        return (fmi3Status)instance_refuse(instance, "fmi3GetBoolean: all variables are scalars");
    for (size_t i = 0; i < nValueReferences; i++)
        if (instance_get_flag(instance, valueReferences[i], &values[i]) != STATUS_OK)
            return fmi3Error;
    return fmi3OK;
}

/* ---- stepping ---------------------------------------------------------------------------------------------- */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    const Status status = instance_step(instance, currentCommunicationPoint, communicationStepSize);
    if (eventHandlingNeeded)
        *eventHandlingNeeded = fmi3False;
    if (terminateSimulation)
        *terminateSimulation = fmi3False;
    if (earlyReturn)
        *earlyReturn = fmi3False;
    if (lastSuccessfulTime)
        *lastSuccessfulTime = ((const Instance *)instance)->model.time;
    return (fmi3Status)status;
}

/* ---- what this FMU does not offer: logged, and an error ----------------------------------------------------- */

#define UNSUPPORTED(function, parameters, ...)                                          \
    fmi3Status function parameters                                                      \
    {                                                                                   \
        __VA_ARGS__;                                                                    \
        return (fmi3Status)instance_unsupported(instance, #function);                   \
    }

/* reading or writing no variable at all is no fault */
#define UNSUPPORTED_VALUES_OF(function, type)                                                                  \
    fmi3Status function(fmi3Instance instance, const fmi3ValueReference references[], size_t n, type values[], \
                        size_t nValues)                                                                        \
    {                                                                                                          \
        (void)references, (void)values, (void)nValues;                                                         \
        return n == 0 ? fmi3OK : (fmi3Status)instance_unsupported(instance, #function);                        \
    }

#define UNSUPPORTED_VALUES(type)                        \
    UNSUPPORTED_VALUES_OF(fmi3Get##type, fmi3##type)    \
    UNSUPPORTED_VALUES_OF(fmi3Set##type, const fmi3##type)

UNSUPPORTED_VALUES(Float32)
UNSUPPORTED_VALUES(Int8)
UNSUPPORTED_VALUES(UInt8)
UNSUPPORTED_VALUES(Int16)
UNSUPPORTED_VALUES(UInt16)
UNSUPPORTED_VALUES(Int32)
UNSUPPORTED_VALUES(UInt32)
UNSUPPORTED_VALUES(Int64)
UNSUPPORTED_VALUES(UInt64)
UNSUPPORTED_VALUES(String)

UNSUPPORTED_VALUES_OF(fmi3SetBoolean, const fmi3Boolean)
UNSUPPORTED(fmi3GetBinary, (fmi3Instance instance, const fmi3ValueReference r[], size_t n, size_t sizes[],
                            fmi3Binary v[], size_t nv), (void)r, (void)n, (void)sizes, (void)v, (void)nv)
UNSUPPORTED(fmi3SetBinary, (fmi3Instance instance, const fmi3ValueReference r[], size_t n, const size_t sizes[],
                            const fmi3Binary v[], size_t nv), (void)r, (void)n, (void)sizes, (void)v, (void)nv)
UNSUPPORTED(fmi3GetClock, (fmi3Instance instance, const fmi3ValueReference r[], size_t n, fmi3Clock v[]),
            (void)r, (void)n, (void)v)
UNSUPPORTED(fmi3SetClock, (fmi3Instance instance, const fmi3ValueReference r[], size_t n, const fmi3Clock v[]),
            (void)r, (void)n, (void)v)
UNSUPPORTED(fmi3GetNumberOfVariableDependencies, (fmi3Instance instance, fmi3ValueReference r, size_t *n),
            (void)r, (void)n)
UNSUPPORTED(fmi3GetVariableDependencies, (fmi3Instance instance, fmi3ValueReference dependent, size_t elements[],
                                          fmi3ValueReference independents[], size_t independentElements[],
                                          fmi3DependencyKind kinds[], size_t n),
            (void)dependent, (void)elements, (void)independents, (void)independentElements, (void)kinds, (void)n)
UNSUPPORTED(fmi3GetFMUState, (fmi3Instance instance, fmi3FMUState *state), (void)state)
UNSUPPORTED(fmi3SetFMUState, (fmi3Instance instance, fmi3FMUState state), (void)state)
UNSUPPORTED(fmi3FreeFMUState, (fmi3Instance instance, fmi3FMUState *state), (void)state)
UNSUPPORTED(fmi3SerializedFMUStateSize, (fmi3Instance instance, fmi3FMUState state, size_t *size),
            (void)state, (void)size)
UNSUPPORTED(fmi3SerializeFMUState, (fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size),
            (void)state, (void)bytes, (void)size)
UNSUPPORTED(fmi3DeserializeFMUState, (fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *state),
            (void)bytes, (void)size, (void)state)
UNSUPPORTED(fmi3GetDirectionalDerivative, (fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                           const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                           size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity),
            (void)unknowns, (void)nUnknowns, (void)knowns, (void)nKnowns, (void)seed, (void)nSeed, (void)sensitivity,
            (void)nSensitivity)
UNSUPPORTED(fmi3GetAdjointDerivative, (fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                       const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                       size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity),
            (void)unknowns, (void)nUnknowns, (void)knowns, (void)nKnowns, (void)seed, (void)nSeed, (void)sensitivity,
            (void)nSensitivity)
UNSUPPORTED(fmi3EnterConfigurationMode, (fmi3Instance instance), (void)0)
UNSUPPORTED(fmi3ExitConfigurationMode, (fmi3Instance instance), (void)0)
UNSUPPORTED(fmi3EnterEventMode, (fmi3Instance instance), (void)0)
UNSUPPORTED(fmi3EnterStepMode, (fmi3Instance instance), (void)0)
UNSUPPORTED(fmi3EnterContinuousTimeMode, (fmi3Instance instance), (void)0)
UNSUPPORTED(fmi3EvaluateDiscreteStates, (fmi3Instance instance), (void)0)
UNSUPPORTED(fmi3GetIntervalDecimal, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                     fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]),
            (void)r, (void)n, (void)intervals, (void)qualifiers)
UNSUPPORTED(fmi3GetIntervalFraction, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                      fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                      fmi3IntervalQualifier qualifiers[]),
            (void)r, (void)n, (void)counters, (void)resolutions, (void)qualifiers)
UNSUPPORTED(fmi3GetShiftDecimal, (fmi3Instance instance, const fmi3ValueReference r[], size_t n, fmi3Float64 shifts[]),
            (void)r, (void)n, (void)shifts)
UNSUPPORTED(fmi3GetShiftFraction, (fmi3Instance instance, const fmi3ValueReference r[], size_t n, fmi3UInt64 counters[],
                                   fmi3UInt64 resolutions[]), (void)r, (void)n, (void)counters, (void)resolutions)
UNSUPPORTED(fmi3SetIntervalDecimal, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                     const fmi3Float64 intervals[]), (void)r, (void)n, (void)intervals)
UNSUPPORTED(fmi3SetIntervalFraction, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                      const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]),
            (void)r, (void)n, (void)counters, (void)resolutions)
UNSUPPORTED(fmi3SetShiftDecimal, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                  const fmi3Float64 shifts[]), (void)r, (void)n, (void)shifts)
UNSUPPORTED(fmi3SetShiftFraction, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                   const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]),
            (void)r, (void)n, (void)counters, (void)resolutions)
UNSUPPORTED(fmi3UpdateDiscreteStates, (fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                       fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                       fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                       fmi3Float64 *nextEventTime),
            (void)discreteStatesNeedUpdate, (void)terminateSimulation, (void)nominalsOfContinuousStatesChanged,
            (void)valuesOfContinuousStatesChanged, (void)nextEventTimeDefined, (void)nextEventTime)
UNSUPPORTED(fmi3CompletedIntegratorStep, (fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                          fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation),
            (void)noSetFMUStatePriorToCurrentPoint, (void)enterEventMode, (void)terminateSimulation)
UNSUPPORTED(fmi3SetTime, (fmi3Instance instance, fmi3Float64 time), (void)time)
UNSUPPORTED(fmi3SetContinuousStates, (fmi3Instance instance, const fmi3Float64 x[], size_t n), (void)x, (void)n)
UNSUPPORTED(fmi3GetContinuousStateDerivatives, (fmi3Instance instance, fmi3Float64 dx[], size_t n), (void)dx, (void)n)
UNSUPPORTED(fmi3GetEventIndicators, (fmi3Instance instance, fmi3Float64 z[], size_t n), (void)z, (void)n)
UNSUPPORTED(fmi3GetContinuousStates, (fmi3Instance instance, fmi3Float64 x[], size_t n), (void)x, (void)n)
UNSUPPORTED(fmi3GetNominalsOfContinuousStates, (fmi3Instance instance, fmi3Float64 x[], size_t n), (void)x, (void)n)
UNSUPPORTED(fmi3GetNumberOfEventIndicators, (fmi3Instance instance, size_t *n), (void)n)
UNSUPPORTED(fmi3GetNumberOfContinuousStates, (fmi3Instance instance, size_t *n), (void)n)
UNSUPPORTED(fmi3GetOutputDerivatives, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                       const fmi3Int32 orders[], fmi3Float64 v[], size_t nv),
            (void)r, (void)n, (void)orders, (void)v, (void)nv)
UNSUPPORTED(fmi3ActivateModelPartition, (fmi3Instance instance, fmi3ValueReference clock, fmi3Float64 time),
            (void)clock, (void)time)
