/* The methods of one resource of the draft fmi-ls-wasm, over fmi3Functions.h; included once for each interface, with
 *     INTERFACE  its name, such as "fmi:fmi3/co-simulation@3.0.0#",
 *     RESOURCE   of the instances, such as "co-simulation-instance",
 *     NAME(x)    a name in C for the method x.
 * Arguments and results have the form that the Component Model's canonical ABI gives them: see canonical.h. */

#define METHOD(method) __attribute__((export_name(INTERFACE "[method]" RESOURCE "." method)))
#define AFTER(method, x) \
    __attribute__((export_name("cabi_post_" INTERFACE "[method]" RESOURCE "." method))) void NAME(after_##x)(void *result) \
    {                                                                                                         \
        (void)result;                                                                                         \
        release();                                                                                            \
    }

__attribute__((export_name(INTERFACE "[dtor]" RESOURCE))) void NAME(drop)(Handle *self)
{
    fmi3FreeInstance(self->fmu);
    free(self->name);
    free(self);
}

/* ---- life -------------------------------------------------------------------------------------------------- */

METHOD("set-debug-logging") int NAME(set_debug_logging)(Handle *self, int on, const Text categories[], size_t n)
{
    const char **names = allocate(n * sizeof *names);

    for (size_t i = 0; i < n; i++)
        names[i] = c_string(categories[i]);
    return finish(fmi3SetDebugLogging(self->fmu, on, n, names));
}

METHOD("enter-initialization-mode")
int NAME(enter_initialization_mode)(Handle *self, int with_tolerance, double tolerance, double start, int with_stop, double stop)
{
    return finish(fmi3EnterInitializationMode(self->fmu, with_tolerance, tolerance, start, with_stop, stop));
}

#define PLAIN(method, x, function) \
    METHOD(method) int NAME(x)(Handle *self) { return finish(function(self->fmu)); }

PLAIN("exit-initialization-mode", exit_initialization_mode, fmi3ExitInitializationMode)
PLAIN("enter-event-mode", enter_event_mode, fmi3EnterEventMode)
PLAIN("enter-step-mode", enter_step_mode, fmi3EnterStepMode)
PLAIN("enter-configuration-mode", enter_configuration_mode, fmi3EnterConfigurationMode)
PLAIN("exit-configuration-mode", exit_configuration_mode, fmi3ExitConfigurationMode)
PLAIN("evaluate-discrete-states", evaluate_discrete_states, fmi3EvaluateDiscreteStates)
PLAIN("terminate", terminate, fmi3Terminate)
PLAIN("reset", reset, fmi3Reset)

METHOD("update-discrete-states") Result *NAME(update_discrete_states)(Handle *self)
{
    fmi3Boolean needed, terminate, nominals, values, defined;
    double next;
    const fmi3Status status = fmi3UpdateDiscreteStates(self->fmu, &needed, &terminate, &nominals, &values, &defined, &next);

    if (has_failed(status))
        return failure(status, 8);
    result.at.bytes[8] = needed;
    result.at.bytes[9] = terminate;
    result.at.bytes[10] = nominals;
    result.at.bytes[11] = values;
    result.at.bytes[12] = defined;
    result.at.numbers[2] = next;
    return success();
}
AFTER("update-discrete-states", update_discrete_states)

/* ---- variables --------------------------------------------------------------------------------------------- */

#define VALUES(type, x, Type, c_type)                                                                                        \
    METHOD("get-" type) Result *NAME(get_##x)(Handle *self, const unsigned references[], size_t n)                          \
    {                                                                                                                       \
        c_type *values = allocate(n * sizeof *values);                                                                      \
                                                                                                                            \
        return list(fmi3Get##Type(self->fmu, references, n, values, n), values, n);                                         \
    }                                                                                                                       \
    AFTER("get-" type, get_##x)                                                                                             \
    METHOD("set-" type) int NAME(set_##x)(Handle *self, const unsigned r[], size_t n, const c_type values[], size_t nv)     \
    {                                                                                                                       \
        return finish(fmi3Set##Type(self->fmu, r, n, values, nv));                                                          \
    }

VALUES("float64", float64, Float64, double)
VALUES("int32", int32, Int32, int)
VALUES("boolean", boolean, Boolean, bool)

/* types without a variable in this FMU: only an empty list succeeds */
#define NONE_GOT(method, x, ...)                                                             \
    METHOD(method) Result *NAME(x)(Handle *self, const unsigned references[], size_t n)      \
    {                                                                                        \
        return list(__VA_ARGS__, allocate(0), 0);                                                \
    }                                                                                        \
    AFTER(method, x)
#define NONE_SET(method, x, ...)                                                                        \
    METHOD(method) int NAME(x)(Handle *self, const unsigned references[], size_t n, const void *values, size_t nv) \
    {                                                                                                   \
        (void)values, (void)nv;                                                                         \
        return finish(__VA_ARGS__);                                                                       \
    }
#define NO_VALUES(type, x, Type)                                                                 \
    NONE_GOT("get-" type, get_##x, fmi3Get##Type(self->fmu, references, n, NULL, n))            \
    NONE_SET("set-" type, set_##x, fmi3Set##Type(self->fmu, references, n, values, n))

NO_VALUES("float32", float32, Float32)
NO_VALUES("int8", int8, Int8)
NO_VALUES("int16", int16, Int16)
NO_VALUES("int64", int64, Int64)
NO_VALUES("uint8", uint8, UInt8)
NO_VALUES("uint16", uint16, UInt16)
NO_VALUES("uint32", uint32, UInt32)
NO_VALUES("uint64", uint64, UInt64)
NO_VALUES("string", string, String)
NONE_GOT("get-binary", get_binary, fmi3GetBinary(self->fmu, references, n, NULL, NULL, n))
NONE_SET("set-binary", set_binary, fmi3SetBinary(self->fmu, references, n, NULL, NULL, n))
NONE_GOT("get-clock", get_clock, fmi3GetClock(self->fmu, references, n, NULL))
NONE_SET("set-clock", set_clock, fmi3SetClock(self->fmu, references, n, NULL))

NONE_GOT("get-interval-decimal", get_interval_decimal, fmi3GetIntervalDecimal(self->fmu, references, n, NULL, NULL))
NONE_GOT("get-interval-fraction", get_interval_fraction,
         fmi3GetIntervalFraction(self->fmu, references, n, NULL, NULL, NULL))
NONE_GOT("get-shift-decimal", get_shift_decimal, fmi3GetShiftDecimal(self->fmu, references, n, NULL))
NONE_GOT("get-shift-fraction", get_shift_fraction, fmi3GetShiftFraction(self->fmu, references, n, NULL, NULL))
NONE_SET("set-interval-decimal", set_interval_decimal, fmi3SetIntervalDecimal(self->fmu, references, n, NULL))
NONE_SET("set-interval-fraction", set_interval_fraction, fmi3SetIntervalFraction(self->fmu, references, n, NULL, NULL))
NONE_SET("set-shift-decimal", set_shift_decimal, fmi3SetShiftDecimal(self->fmu, references, n, NULL))
NONE_SET("set-shift-fraction", set_shift_fraction, fmi3SetShiftFraction(self->fmu, references, n, NULL, NULL))
/* its list is of pairs; only its length matters */
NONE_GOT("get-output-derivatives", get_output_derivatives,
         fmi3GetOutputDerivatives(self->fmu, references, n, NULL, NULL, n))

METHOD("get-number-of-variable-dependencies") Result *NAME(get_number_of_dependencies)(Handle *self, unsigned reference)
{
    return failure(fmi3GetNumberOfVariableDependencies(self->fmu, reference, NULL), 8);
}
AFTER("get-number-of-variable-dependencies", get_number_of_dependencies)

METHOD("get-variable-dependencies") Result *NAME(get_dependencies)(Handle *self, unsigned reference)
{
    return failure(fmi3GetVariableDependencies(self->fmu, reference, NULL, NULL, NULL, NULL, 0), 4);
}
AFTER("get-variable-dependencies", get_dependencies)

/* ---- derivatives ------------------------------------------------------------------------------------------- */

#define DERIVATIVE(method, x, function, n_values)                                                                  \
    METHOD(method) Result *NAME(x)(Handle *self, const unsigned unknowns[], size_t nu, const unsigned knowns[],    \
                                   size_t nk, const double seed[], size_t ns)                                      \
    {                                                                                                              \
        double *values = allocate(n_values * sizeof *values);                                                      \
                                                                                                                   \
        return list(function(self->fmu, unknowns, nu, knowns, nk, seed, ns, values, n_values), values, n_values);  \
    }                                                                                                              \
    AFTER(method, x)

DERIVATIVE("get-directional-derivative", get_directional_derivative, fmi3GetDirectionalDerivative, nu)
DERIVATIVE("get-adjoint-derivative", get_adjoint_derivative, fmi3GetAdjointDerivative, nk)

/* ---- FMU state --------------------------------------------------------------------------------------------- */

METHOD("get-fmu-state") Result *NAME(get_fmu_state)(Handle *self)
{
    fmi3FMUState state = NULL;
    size_t size = 0;
    unsigned char *bytes = NULL;
    fmi3Status status = fmi3GetFMUState(self->fmu, &state);

    if (!has_failed(status))
        status = fmi3SerializedFMUStateSize(self->fmu, state, &size);
    if (!has_failed(status)) {
        bytes = allocate(size);
        status = fmi3SerializeFMUState(self->fmu, state, bytes, size);
    }
    if (state)
        fmi3FreeFMUState(self->fmu, &state);
    return list(status, bytes, size);
}
AFTER("get-fmu-state", get_fmu_state)

METHOD("set-fmu-state") int NAME(set_fmu_state)(Handle *self, const unsigned char bytes[], size_t size)
{
    fmi3FMUState state = NULL;
    fmi3Status status = fmi3DeserializeFMUState(self->fmu, bytes, size, &state);

    if (!has_failed(status))
        status = fmi3SetFMUState(self->fmu, state);
    if (state)
        fmi3FreeFMUState(self->fmu, &state);
    return finish(status);
}
