/* The component of the draft fmi-ls-wasm: its interfaces over fmi3Functions.h. With -DMODEL_EXCHANGE_OFFERED also that one. */
#include "canonical.h"

__attribute__((export_name("cabi_realloc"))) void *cabi_realloc(void *old, size_t old_size, size_t align, size_t size)
{
    void *block = allocate(size);

    (void)align;
    if (old)
        memcpy(block, old, old_size < size ? old_size : size);
    return block;
}

/* ---- callbacks --------------------------------------------------------------------------------------------- */

__attribute__((import_module("fmi:fmi3/callbacks@3.0.0"), import_name("log-message")))
void callbacks_log_message(const char *name, size_t n_name, int status, const char *category, size_t n_category,
                           const char *message, size_t n_message);

static void log_message(fmi3InstanceEnvironment handle, fmi3Status status, fmi3String category, fmi3String message)
{
    const char *name = ((const Handle *)handle)->name;

    callbacks_log_message(name, strlen(name), (int)status, category, strlen(category), message, strlen(message));
}

/* ---- fmi:fmi3/common --------------------------------------------------------------------------------------- */

__attribute__((export_name("fmi:fmi3/common@3.0.0#get-version"))) Result *common_get_version(void)
{
    const char *version = fmi3GetVersion();

    result.at.words[0] = (size_t)version;
    result.at.words[1] = strlen(version);
    return &result;
}

/* ---- instances --------------------------------------------------------------------------------------------- */

static Handle *new_handle(Text name)
{
    Handle *handle = calloc(1, sizeof *handle);

    if (!handle || !(handle->name = malloc(name.n + 1)))
        __builtin_trap();
    memcpy(handle->name, name.bytes, name.n);
    handle->name[name.n] = '\0';
    return handle;
}

/* An option<instance>: none where the FMU refused. */
static Result *instantiated(Handle *handle, int (*new_resource)(Handle *))
{
    result.at.bytes[0] = handle->fmu != NULL;
    if (handle->fmu) {
        result.at.words[1] = (size_t)new_resource(handle);
    } else {
        free(handle->name);
        free(handle);
    }
    return &result;
}

/* ---- fmi:fmi3/co-simulation -------------------------------------------------------------------------------- */

#define INTERFACE "fmi:fmi3/co-simulation@3.0.0#"
#define RESOURCE "co-simulation-instance"
#define NAME(x) co_simulation_##x
#include "methods.h"

__attribute__((import_module("[export]fmi:fmi3/co-simulation@3.0.0"), import_name("[resource-new]" RESOURCE)))
int co_simulation_new(Handle *handle);

__attribute__((export_name(INTERFACE "[static]" RESOURCE ".instantiate-co-simulation")))
Result *co_simulation_instantiate(const char *name, size_t n_name, const char *token, size_t n_token, const char *path,
                                  size_t n_path, int visible, int logging_on, int event_mode_used,
                                  int early_return_allowed, const unsigned intermediate[], size_t n_intermediate)
{
    Handle *handle = new_handle((Text){name, n_name});

    handle->fmu = fmi3InstantiateCoSimulation(handle->name, c_string((Text){token, n_token}),
                                              c_string((Text){path, n_path}), visible, logging_on, event_mode_used,
                                              early_return_allowed, intermediate, n_intermediate, handle, log_message,
                                              NULL);
    return instantiated(handle, co_simulation_new);
}

__attribute__((export_name("cabi_post_" INTERFACE "[static]" RESOURCE ".instantiate-co-simulation")))
void co_simulation_after_instantiate(void *unused)
{
    (void)unused;
    release();
}

/* FMI 3.0 itself has no such function. */
METHOD("set-input-derivatives")
int co_simulation_set_input_derivatives(Handle *self, const void *requests, size_t n, const double values[], size_t nv)
{
    (void)requests, (void)values, (void)nv;
    return finish(n == 0 ? fmi3OK : (fmi3Status)instance_unsupported(self->fmu, "set-input-derivatives"));
}

METHOD("do-step") Result *co_simulation_do_step(Handle *self, double time, double step, int no_set_state_before)
{
    fmi3Boolean event, terminate, early;
    double last;
    const fmi3Status status = fmi3DoStep(self->fmu, time, step, no_set_state_before, &event, &terminate, &early, &last);

    if (has_failed(status))
        return failure(status, 8);
    result.at.numbers[1] = last;
    result.at.bytes[16] = event;
    result.at.bytes[17] = terminate;
    result.at.bytes[18] = early;
    return success();
}
AFTER("do-step", do_step)

#undef INTERFACE
#undef RESOURCE
#undef NAME

/* ---- fmi:fmi3/model-exchange ------------------------------------------------------------------------------- */

#ifdef MODEL_EXCHANGE_OFFERED

#define INTERFACE "fmi:fmi3/model-exchange@3.0.0#"
#define RESOURCE "model-exchange-instance"
#define NAME(x) model_exchange_##x
#undef METHOD
#undef AFTER
#undef PLAIN
#undef NONE_GOT
#undef NONE_SET
#undef NO_VALUES
#undef VALUES
#undef DERIVATIVE
#include "methods.h"

__attribute__((import_module("[export]fmi:fmi3/model-exchange@3.0.0"), import_name("[resource-new]" RESOURCE)))
int model_exchange_new(Handle *handle);

__attribute__((export_name(INTERFACE "[static]" RESOURCE ".instantiate-model-exchange")))
Result *model_exchange_instantiate(const char *name, size_t n_name, const char *token, size_t n_token, const char *path,
                                   size_t n_path, int visible, int logging_on)
{
    Handle *handle = new_handle((Text){name, n_name});

    handle->fmu = fmi3InstantiateModelExchange(handle->name, c_string((Text){token, n_token}),
                                               c_string((Text){path, n_path}), visible, logging_on, handle, log_message);
    return instantiated(handle, model_exchange_new);
}

__attribute__((export_name("cabi_post_" INTERFACE "[static]" RESOURCE ".instantiate-model-exchange")))
void model_exchange_after_instantiate(void *unused)
{
    (void)unused;
    release();
}

PLAIN("enter-continuous-time-mode", enter_continuous_time_mode, fmi3EnterContinuousTimeMode)

METHOD("set-time") int model_exchange_set_time(Handle *self, double time)
{
    return finish(fmi3SetTime(self->fmu, time));
}

METHOD("set-continuous-states") int model_exchange_set_states(Handle *self, const double states[], size_t n)
{
    return finish(fmi3SetContinuousStates(self->fmu, states, n));
}

#define STATES(method, x, function)                                                      \
    METHOD(method) Result *model_exchange_##x(Handle *self)                              \
    {                                                                                    \
        double *values = allocate(N_STATES * sizeof *values);                                \
        return list(function(self->fmu, values, N_STATES), values, N_STATES);            \
    }                                                                                    \
    AFTER(method, x)

STATES("get-continuous-states", get_states, fmi3GetContinuousStates)
STATES("get-continuous-state-derivatives", get_derivatives, fmi3GetContinuousStateDerivatives)
STATES("get-nominals-of-continuous-states", get_nominals, fmi3GetNominalsOfContinuousStates)

METHOD("get-event-indicators") Result *model_exchange_get_event_indicators(Handle *self)
{
    return list(fmi3GetEventIndicators(self->fmu, NULL, 0), allocate(0), 0);
}
AFTER("get-event-indicators", get_event_indicators)

#define COUNT(method, x, function)                                                       \
    METHOD(method) Result *model_exchange_##x(Handle *self)                              \
    {                                                                                    \
        size_t n = 0;                                                                    \
        const fmi3Status status = function(self->fmu, &n);                               \
        if (has_failed(status))                                                               \
            return failure(status, 8);                                                   \
        result.at.integers[1] = n;                                                       \
        return success();                                                                \
    }                                                                                    \
    AFTER(method, x)

COUNT("get-number-of-event-indicators", get_number_of_event_indicators, fmi3GetNumberOfEventIndicators)
COUNT("get-number-of-continuous-states", get_number_of_states, fmi3GetNumberOfContinuousStates)

METHOD("completed-integrator-step") Result *model_exchange_completed_integrator_step(Handle *self, int no_set_state_before)
{
    fmi3Boolean event, terminate;
    const fmi3Status status = fmi3CompletedIntegratorStep(self->fmu, no_set_state_before, &event, &terminate);

    if (has_failed(status))
        return failure(status, 1);
    result.at.bytes[1] = event;
    result.at.bytes[2] = terminate;
    return success();
}
AFTER("completed-integrator-step", completed_integrator_step)

#endif
