/* FMI 3.0, co-simulation and model exchange, over instance.h. */
#include <math.h>

#include "instance.h" /* names the functions, before */
#include "fmi3Functions.h"

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
    return (fmi3Status)instance_set_logging(instance, loggingOn, nCategories, categories);
}

static fmi3Instance refuse_instance(fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage,
                                const char *message)
{
    if (logMessage)
        logMessage(environment, fmi3Error, "logStatusError", message);
    return NULL;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken,
                                         fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                         fmi3Boolean eventModeUsed, fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables,
                                         fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate)
{
    (void)resourcePath, (void)visible, (void)earlyReturnAllowed, (void)intermediateUpdate;
    (void)requiredIntermediateVariables, (void)nRequiredIntermediateVariables;
    if (eventModeUsed)
        return refuse_instance(instanceEnvironment, logMessage, "this FMU has no event mode in co-simulation (eventModeUsed)");
    return instance_create(instanceName, instantiationToken, CO_SIMULATION, loggingOn, log_message, instanceEnvironment,
                           (void (*)(void))logMessage);
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage)
{
    (void)resourcePath, (void)visible;
    return instance_create(instanceName, instantiationToken, MODEL_EXCHANGE, loggingOn, log_message, instanceEnvironment,
                           (void (*)(void))logMessage);
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
    const char *both = "this FMU offers co-simulation and model exchange, not scheduled execution";
    return refuse_instance(instanceEnvironment, logMessage, COMPONENT.settle ? both : "this FMU offers co-simulation alone");
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

#define INTEGERS(type, Type)                                                                                          \
    fmi3Status fmi3Get##type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                       \
                             size_t nValueReferences, fmi3##type values[], size_t nValues)                            \
    {                                                                                                                 \
        if (nValues != nValueReferences)                                                                              \
            return (fmi3Status)instance_refuse(instance, "fmi3Get" #type ": all variables are scalars");              \
        for (size_t i = 0; i < nValueReferences; i++) {                                                               \
            int value = 0;                                                                                            \
            if (instance_get_integer(instance, Type, valueReferences[i], &value) != STATUS_OK)                        \
                return fmi3Error;                                                                                     \
            values[i] = (fmi3##type)value;                                                                            \
        }                                                                                                             \
        return fmi3OK;                                                                                                \
    }                                                                                                                 \
                                                                                                                      \
    fmi3Status fmi3Set##type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                       \
                             size_t nValueReferences, const fmi3##type values[], size_t nValues)                      \
    {                                                                                                                 \
        if (nValues != nValueReferences)                                                                              \
            return (fmi3Status)instance_refuse(instance, "fmi3Set" #type ": all variables are scalars");              \
        for (size_t i = 0; i < nValueReferences; i++)                                                                 \
            if (instance_set_integer(instance, Type, valueReferences[i], values[i]) != STATUS_OK)                     \
                return fmi3Error;                                                                                     \
        return fmi3OK;                                                                                                \
    }

INTEGERS(Int32, TYPE_INTEGER)
INTEGERS(Boolean, TYPE_BOOLEAN)

static Status require_scalars(const Instance *instance, size_t nUnknowns, size_t nKnowns, size_t nSeed,
                              size_t nSensitivity)
{
    if (nSeed == nKnowns && nSensitivity == nUnknowns)
        return STATUS_OK;
    return instance_refuse(instance, "derivatives: all variables are scalars");
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    if (require_scalars(instance, nUnknowns, nKnowns, nSeed, nSensitivity) != STATUS_OK)
        return fmi3Error;
    return (fmi3Status)instance_directional_derivative(instance, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    if (require_scalars(instance, nKnowns, nUnknowns, nSeed, nSensitivity) != STATUS_OK)
        return fmi3Error;
    return (fmi3Status)instance_adjoint_derivative(instance, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity);
}

/* ---- FMU state --------------------------------------------------------------------------------------------- */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    return (fmi3Status)instance_save(instance, (Saved **)FMUState);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    return (fmi3Status)instance_restore(instance, FMUState);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    return (fmi3Status)instance_free_saved(instance, (Saved **)FMUState);
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    return (fmi3Status)instance_serialised_size(instance, FMUState, size);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size)
{
    return (fmi3Status)instance_serialise(instance, FMUState, serializedState, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState)
{
    return (fmi3Status)instance_deserialise(instance, serializedState, size, (Saved **)FMUState);
}

/* ---- co-simulation ------------------------------------------------------------------------------------------ */

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

/* ---- model exchange ---------------------------------------------------------------------------------------- */

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    return (fmi3Status)instance_enter_event_mode(instance, MODE_CONTINUOUS);
}

/* There is nothing to evaluate that would not be, and no flag that offers it: importers may call it all the same. */
fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    return (fmi3Status)instance_require(instance, MODE_INITIALISING | MODE_EVENT, "evaluating discrete states");
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime)
{
    bool changed = false;
    double next = INFINITY;
    const Status status = instance_update_discrete(instance, &changed, &next);

    *discreteStatesNeedUpdate = fmi3False;
    *terminateSimulation = fmi3False;
    *nominalsOfContinuousStatesChanged = fmi3False;
    *valuesOfContinuousStatesChanged = changed;
    *nextEventTimeDefined = isfinite(next);
    *nextEventTime = isfinite(next) ? next : 0.0;
    return (fmi3Status)status;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    return (fmi3Status)instance_enter_continuous_mode(instance);
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation)
{
    (void)noSetFMUStatePriorToCurrentPoint;
    *enterEventMode = fmi3False;
    *terminateSimulation = fmi3False;
    return (fmi3Status)instance_require(instance, MODE_CONTINUOUS, "completing an integrator step");
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    return (fmi3Status)instance_set_time(instance, time);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[],
                                   size_t nContinuousStates)
{
    return (fmi3Status)instance_set_states(instance, continuousStates, nContinuousStates);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[], size_t nContinuousStates)
{
    return (fmi3Status)instance_get_derivatives(instance, derivatives, nContinuousStates);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators)
{
    (void)eventIndicators;
    return nEventIndicators == 0 ? fmi3OK
                                 : (fmi3Status)instance_refuse(instance, "fmi3GetEventIndicators: there are none");
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates)
{
    return (fmi3Status)instance_get_states(instance, continuousStates, nContinuousStates);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates)
{
    return (fmi3Status)instance_get_nominals(instance, nominals, nContinuousStates);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators)
{
    (void)instance;
    *nEventIndicators = 0;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates)
{
    (void)instance;
    *nContinuousStates = N_STATES;
    return fmi3OK;
}

/* ---- what this FMU does not offer: logged, and an error ----------------------------------------------------- */

#define UNSUPPORTED(function, parameters, ...)                                          \
    fmi3Status function parameters                                                      \
    {                                                                                   \
        __VA_ARGS__;                                                                    \
        return (fmi3Status)instance_unsupported(instance, #function);                   \
    }

/* reading or writing no variable at all is no fault */
#define UNSUPPORTED_FOR_ALL(function, parameters, ...)                                            \
    fmi3Status function parameters                                                                \
    {                                                                                             \
        __VA_ARGS__;                                                                              \
        return n == 0 ? fmi3OK : (fmi3Status)instance_unsupported(instance, #function);           \
    }

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
UNSUPPORTED_VALUES(UInt32)
UNSUPPORTED_VALUES(Int64)
UNSUPPORTED_VALUES(UInt64)
UNSUPPORTED_VALUES(String)

UNSUPPORTED_FOR_ALL(fmi3GetBinary, (fmi3Instance instance, const fmi3ValueReference r[], size_t n, size_t sizes[],
                            fmi3Binary v[], size_t nv), (void)r, (void)sizes, (void)v, (void)nv)
UNSUPPORTED_FOR_ALL(fmi3SetBinary, (fmi3Instance instance, const fmi3ValueReference r[], size_t n, const size_t sizes[],
                            const fmi3Binary v[], size_t nv), (void)r, (void)sizes, (void)v, (void)nv)
UNSUPPORTED_FOR_ALL(fmi3GetClock, (fmi3Instance instance, const fmi3ValueReference r[], size_t n, fmi3Clock v[]),
            (void)r, (void)v)
UNSUPPORTED_FOR_ALL(fmi3SetClock, (fmi3Instance instance, const fmi3ValueReference r[], size_t n, const fmi3Clock v[]),
            (void)r, (void)v)
UNSUPPORTED(fmi3GetNumberOfVariableDependencies, (fmi3Instance instance, fmi3ValueReference r, size_t *n),
            (void)r, (void)n)
UNSUPPORTED(fmi3GetVariableDependencies, (fmi3Instance instance, fmi3ValueReference dependent, size_t elements[],
                                          fmi3ValueReference independents[], size_t independentElements[],
                                          fmi3DependencyKind kinds[], size_t n),
            (void)dependent, (void)elements, (void)independents, (void)independentElements, (void)kinds, (void)n)
UNSUPPORTED(fmi3EnterConfigurationMode, (fmi3Instance instance), (void)0)
UNSUPPORTED(fmi3ExitConfigurationMode, (fmi3Instance instance), (void)0)
UNSUPPORTED(fmi3EnterStepMode, (fmi3Instance instance), (void)0)
UNSUPPORTED_FOR_ALL(fmi3GetIntervalDecimal, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                     fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]),
            (void)r, (void)intervals, (void)qualifiers)
UNSUPPORTED_FOR_ALL(fmi3GetIntervalFraction, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                      fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                      fmi3IntervalQualifier qualifiers[]),
            (void)r, (void)counters, (void)resolutions, (void)qualifiers)
UNSUPPORTED_FOR_ALL(fmi3GetShiftDecimal, (fmi3Instance instance, const fmi3ValueReference r[], size_t n, fmi3Float64 shifts[]),
            (void)r, (void)shifts)
UNSUPPORTED_FOR_ALL(fmi3GetShiftFraction, (fmi3Instance instance, const fmi3ValueReference r[], size_t n, fmi3UInt64 counters[],
                                   fmi3UInt64 resolutions[]), (void)r, (void)counters, (void)resolutions)
UNSUPPORTED_FOR_ALL(fmi3SetIntervalDecimal, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                     const fmi3Float64 intervals[]), (void)r, (void)intervals)
UNSUPPORTED_FOR_ALL(fmi3SetIntervalFraction, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                      const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]),
            (void)r, (void)counters, (void)resolutions)
UNSUPPORTED_FOR_ALL(fmi3SetShiftDecimal, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                  const fmi3Float64 shifts[]), (void)r, (void)shifts)
UNSUPPORTED_FOR_ALL(fmi3SetShiftFraction, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                   const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]),
            (void)r, (void)counters, (void)resolutions)
UNSUPPORTED_FOR_ALL(fmi3GetOutputDerivatives, (fmi3Instance instance, const fmi3ValueReference r[], size_t n,
                                       const fmi3Int32 orders[], fmi3Float64 v[], size_t nv),
            (void)r, (void)orders, (void)v, (void)nv)
UNSUPPORTED(fmi3ActivateModelPartition, (fmi3Instance instance, fmi3ValueReference clock, fmi3Float64 time),
            (void)clock, (void)time)
