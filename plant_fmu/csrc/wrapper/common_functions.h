/* The functions that FMI 2.0 and FMI 3.0 have in common, over instance.h. fmi2.c and fmi3.c include it after they have
 * defined FMI(x) as the version's name of x; names are those of FMI 3.0, which messages about NULL quote. */
#ifndef COMMON_FUNCTIONS_H
#define COMMON_FUNCTIONS_H

/* Refuses a call without an instance, or with NULL as one of the pointers to n values each. */
#define REFUSE_NULL(n, ...)                            \
    do {                                               \
        if (!CHECK_POINTERS(instance, n, __VA_ARGS__)) \
            return FMI(Error);                         \
    } while (0)

/* ---- version, logging, life -------------------------------------------------------------------------------- */

const char *FMI(GetVersion)(void)
{
    return FMI(Version);
}

FMI(Status) FMI(SetDebugLogging)(FMI(Instance) instance, FMI(Boolean) loggingOn, size_t nCategories, const FMI(String) categories[])
{
    REFUSE_NULL(nCategories, categories);
    return (FMI(Status))instance_set_logging(instance, loggingOn != FMI(False), nCategories, categories);
}

void FMI(FreeInstance)(FMI(Instance) instance)
{
    instance_free(instance);
}

FMI(Status) FMI(ExitInitializationMode)(FMI(Instance) instance)
{
    return (FMI(Status))instance_exit_initialization(instance);
}

FMI(Status) FMI(Terminate)(FMI(Instance) instance)
{
    return (FMI(Status))instance_terminate(instance);
}

FMI(Status) FMI(Reset)(FMI(Instance) instance)
{
    REFUSE_NULL(1, instance);
    return (FMI(Status))instance_reset(instance);
}

/* ---- FMU state --------------------------------------------------------------------------------------------- */

FMI(Status) FMI(GetFMUState)(FMI(Instance) instance, FMI(FMUState) *FMUState)
{
    REFUSE_NULL(1, FMUState);
    return (FMI(Status))instance_save(instance, (Saved **)FMUState);
}

FMI(Status) FMI(SetFMUState)(FMI(Instance) instance, FMI(FMUState) FMUState)
{
    REFUSE_NULL(1, FMUState);
    return (FMI(Status))instance_restore(instance, FMUState);
}

FMI(Status) FMI(FreeFMUState)(FMI(Instance) instance, FMI(FMUState) *FMUState)
{
    REFUSE_NULL(1, instance);
    return (FMI(Status))instance_free_saved(instance, (Saved **)FMUState);
}

FMI(Status) FMI(SerializedFMUStateSize)(FMI(Instance) instance, FMI(FMUState) FMUState, size_t *size)
{
    REFUSE_NULL(1, FMUState, size);
    return (FMI(Status))instance_serialized_size(instance, FMUState, size);
}

FMI(Status) FMI(SerializeFMUState)(FMI(Instance) instance, FMI(FMUState) FMUState, FMI(Byte) serializedState[], size_t size)
{
    REFUSE_NULL(1, FMUState, serializedState);
    return (FMI(Status))instance_serialize(instance, FMUState, (unsigned char *)serializedState, size);
}

FMI(Status) FMI(DeserializeFMUState)(FMI(Instance) instance, const FMI(Byte) serializedState[], size_t size, FMI(FMUState) *FMUState)
{
    REFUSE_NULL(1, serializedState, FMUState);
    return (FMI(Status))instance_deserialize(instance, (const unsigned char *)serializedState, size, (Saved **)FMUState);
}

/* ---- model exchange ---------------------------------------------------------------------------------------- */

FMI(Status) FMI(EnterContinuousTimeMode)(FMI(Instance) instance)
{
    return (FMI(Status))instance_enter_continuous_mode(instance);
}

FMI(Status) FMI(CompletedIntegratorStep)(FMI(Instance) instance, FMI(Boolean) noSetFMUStatePriorToCurrentPoint,
                                         FMI(Boolean) *enterEventMode, FMI(Boolean) *terminateSimulation)
{
    REFUSE_NULL(1, enterEventMode, terminateSimulation);
    (void)noSetFMUStatePriorToCurrentPoint;
    *enterEventMode = FMI(False);
    *terminateSimulation = FMI(False);
    return (FMI(Status))instance_require(instance, MODE_CONTINUOUS, "completing an integrator step");
}

FMI(Status) FMI(SetTime)(FMI(Instance) instance, double time)
{
    return (FMI(Status))instance_set_time(instance, time);
}

#define VALUES_OF_STATES(function, type, values, action)                       \
    FMI(Status) FMI(function)(FMI(Instance) instance, type values[], size_t n) \
    {                                                                          \
        REFUSE_NULL(n, values);                                                \
        return (FMI(Status))action(instance, values, n);                       \
    }

VALUES_OF_STATES(SetContinuousStates, const double, continuousStates, instance_set_states)
VALUES_OF_STATES(GetContinuousStates, double, continuousStates, instance_get_states)
VALUES_OF_STATES(GetContinuousStateDerivatives, double, derivatives, instance_get_derivatives)
VALUES_OF_STATES(GetNominalsOfContinuousStates, double, nominals, instance_get_nominals)

FMI(Status) FMI(GetEventIndicators)(FMI(Instance) instance, double eventIndicators[], size_t n)
{
    REFUSE_NULL(n, eventIndicators);
    return n == 0 ? FMI(OK) : (FMI(Status))instance_refuse(instance, "event indicators: there are none");
}

#endif
