/* FMI 3.0, co-simulation and model exchange, over instance.h. */
#include <math.h>

#include "instance.h" /* names the functions, before */
#include "fmi3Functions.h"

#define FMI(x) fmi3##x
#include "common_functions.h"

static void log_message(const Instance *instance, Status status, const char *category, const char *message)
{
    if (instance->logger)
        ((fmi3LogMessageCallback)instance->logger)(instance->environment, (fmi3Status)status, category, message);
}

/* ---- version, logging, life -------------------------------------------------------------------------------- */

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
    (void)resourcePath, (void)visible, (void)intermediateUpdate;
    if (nRequiredIntermediateVariables > 0 && !requiredIntermediateVariables)
        return refuse_instance(instanceEnvironment, logMessage, "requiredIntermediateVariables is NULL");
    if (eventModeUsed && N_CLOCK_VARIABLES == 0)
        return refuse_instance(instanceEnvironment, logMessage, "this FMU has no event mode in co-simulation (eventModeUsed)");
    Instance *instance = instance_create(instanceName, instantiationToken, CO_SIMULATION, loggingOn, log_message,
                                         instanceEnvironment, (void (*)(void))logMessage);
    if (instance) { /* without event mode sensors sample at their own times, unseen */
        instance->has_event_mode = eventModeUsed;
        instance->returns_early = eventModeUsed && earlyReturnAllowed;
    }
    return instance;
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
    return refuse_instance(instanceEnvironment, logMessage, COMPONENT.apply_unlagged ? both : "this FMU offers co-simulation alone");
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    if (instance_require_new(instance) != STATUS_OK ||
        instance_set_experiment(instance, toleranceDefined ? tolerance : 0.0, startTime,
                                stopTimeDefined ? stopTime : INFINITY) != STATUS_OK)
        return fmi3Error;
    return (fmi3Status)instance_enter_initialization(instance);
}

/* ---- variables --------------------------------------------------------------------------------------------- */

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues)
{
    REFUSE_NULL(nValueReferences, valueReferences, values);
    return (fmi3Status)instance_get_reals(instance, valueReferences, nValueReferences, values, nValues);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues)
{
    REFUSE_NULL(nValueReferences, valueReferences, values);
    return (fmi3Status)instance_set_reals(instance, valueReferences, nValueReferences, values, nValues);
}

#define INTEGERS(type, Type)                                                                                          \
    fmi3Status fmi3Get##type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                       \
                             size_t nValueReferences, fmi3##type values[], size_t nValues)                            \
    {                                                                                                                 \
        REFUSE_NULL(nValueReferences, valueReferences, values);                                                       \
        if (instance_check_count(instance, Type, valueReferences, nValueReferences, nValues) != STATUS_OK)            \
            return fmi3Error;                                                                                         \
        for (size_t i = 0; i < nValueReferences; i++)                                                                 \
            for (unsigned vr = valueReferences[i], end = vr + VARIABLES[vr].size; vr < end; vr++) {                   \
                int value = 0;                                                                                        \
                if (instance_get_integer(instance, Type, vr, &value) != STATUS_OK)                                    \
                    return fmi3Error;                                                                                 \
                *values++ = (fmi3##type)value;                                                                        \
            }                                                                                                         \
        return fmi3OK;                                                                                                \
    }                                                                                                                 \
                                                                                                                      \
    fmi3Status fmi3Set##type(fmi3Instance instance, const fmi3ValueReference valueReferences[],                       \
                             size_t nValueReferences, const fmi3##type values[], size_t nValues)                      \
    {                                                                                                                 \
        REFUSE_NULL(nValueReferences, valueReferences, values);                                                       \
        if (instance_check_count(instance, Type, valueReferences, nValueReferences, nValues) != STATUS_OK)            \
            return fmi3Error;                                                                                         \
        for (size_t i = 0; i < nValueReferences; i++)                                                                 \
            for (unsigned vr = valueReferences[i], end = vr + VARIABLES[vr].size; vr < end; vr++)                     \
                if (instance_set_integer(instance, Type, vr, *values++) != STATUS_OK)                                 \
                    return fmi3Error;                                                                                 \
        return fmi3OK;                                                                                                \
    }

INTEGERS(Int32, TYPE_INTEGER)
INTEGERS(Boolean, TYPE_BOOLEAN)

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Clock values[])
{
    REFUSE_NULL(nValueReferences, valueReferences, values);
    for (size_t i = 0; i < nValueReferences; i++)
        if (instance_get_clock(instance, valueReferences[i], &values[i]) != STATUS_OK)
            return fmi3Error;
    return fmi3OK;
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    REFUSE_NULL(nUnknowns, unknowns, sensitivity);
    REFUSE_NULL(nKnowns, knowns, seed);
    return (fmi3Status)instance_directional_derivative(instance, (Selection){unknowns, nUnknowns, nSensitivity},
                                                       (Selection){knowns, nKnowns, nSeed}, seed, sensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                    size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity)
{
    REFUSE_NULL(nUnknowns, unknowns, seed);
    REFUSE_NULL(nKnowns, knowns, sensitivity);
    return (fmi3Status)instance_adjoint_derivative(instance, (Selection){unknowns, nUnknowns, nSeed},
                                                   (Selection){knowns, nKnowns, nSensitivity}, seed, sensitivity);
}

/* ---- co-simulation ------------------------------------------------------------------------------------------ */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    REFUSE_NULL(1, eventHandlingNeeded, terminateSimulation, earlyReturn, lastSuccessfulTime);
    (void)noSetFMUStatePriorToCurrentPoint;
    const Status status = instance_step(instance, currentCommunicationPoint, communicationStepSize);
    const Instance *stepped = instance;
    *eventHandlingNeeded = stepped->has_event_mode && variables_has_ticked(&stepped->model);
    *terminateSimulation = fmi3False;
    *earlyReturn = *eventHandlingNeeded && stepped->model.time < currentCommunicationPoint + communicationStepSize;
    *lastSuccessfulTime = stepped->model.time;
    return (fmi3Status)status;
}

/* ---- events, and model exchange ---------------------------------------------------------------------------- */

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    REFUSE_NULL(1, instance);
    const unsigned stepping = ((const Instance *)instance)->has_event_mode ? MODE_STEPPING : 0;
    return (fmi3Status)instance_enter_event_mode(instance, MODE_CONTINUOUS | stepping);
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    return (fmi3Status)instance_enter_step_mode(instance);
}

/* Does nothing: all is evaluated already. No flag offers it, but importers may call it. */
fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    return (fmi3Status)instance_require(instance, MODE_INITIALIZING | MODE_EVENT, "evaluating discrete states");
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation, fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged, fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime)
{
    REFUSE_NULL(1, discreteStatesNeedUpdate, terminateSimulation, nominalsOfContinuousStatesChanged,
                valuesOfContinuousStatesChanged, nextEventTimeDefined, nextEventTime);
    bool again = false, changed = false;
    double next = INFINITY;
    const Status status = instance_update_discrete(instance, &again, &changed, &next);

    *discreteStatesNeedUpdate = again;
    *terminateSimulation = fmi3False;
    *nominalsOfContinuousStatesChanged = fmi3False;
    *valuesOfContinuousStatesChanged = changed;
    *nextEventTimeDefined = isfinite(next);
    *nextEventTime = isfinite(next) ? next : 0.0;
    return (fmi3Status)status;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators)
{
    REFUSE_NULL(1, nEventIndicators);
    *nEventIndicators = 0;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates)
{
    REFUSE_NULL(1, nContinuousStates);
    *nContinuousStates = N_STATES;
    return fmi3OK;
}
