/* The least a co-simulation master can cost: a loop over an FMU's own functions, for FMI 2.0 and 3.0.
 *
 * Each of `steps` steps of h seconds sets the inputs, advances, and reads the real and the Boolean outputs; with
 * `step_only` it advances alone. Returns the number of steps that were taken. */
#include <stddef.h>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

typedef struct {
    void *instance;
    void (*set_reals)(void), (*do_step)(void), (*get_reals)(void), (*get_flags)(void); /* types differ by version */
    const unsigned *input_references, *output_references, *flag_references;
    size_t n_inputs, n_outputs, n_flags;
    const double *inputs;
    double *outputs;
    void *flags; /* int in FMI 2.0, bool in 3.0 */
} CoSimulationInstance;

#if defined(_WIN32)
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
long loop_fmi2(const CoSimulationInstance *s, long first, long steps, double h, int step_only)
{
    fmi2SetRealTYPE *set_reals = (fmi2SetRealTYPE *)s->set_reals;
    fmi2DoStepTYPE *do_step = (fmi2DoStepTYPE *)s->do_step;
    fmi2GetRealTYPE *get_reals = (fmi2GetRealTYPE *)s->get_reals;
    fmi2GetBooleanTYPE *get_flags = (fmi2GetBooleanTYPE *)s->get_flags;

    for (long k = 0; k < steps; k++) {
        if (!step_only && set_reals(s->instance, s->input_references, s->n_inputs, s->inputs) > fmi2Warning)
            return k;
        if (do_step(s->instance, (double)(first + k) * h, h, fmi2True) > fmi2Warning)
            return k;
        if (!step_only && (get_reals(s->instance, s->output_references, s->n_outputs, s->outputs) > fmi2Warning ||
                           get_flags(s->instance, s->flag_references, s->n_flags, s->flags) > fmi2Warning))
            return k;
    }
    return steps;
}

#if defined(_WIN32)
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
long loop_fmi3(const CoSimulationInstance *s, long first, long steps, double h, int step_only)
{
    fmi3SetFloat64TYPE *set_reals = (fmi3SetFloat64TYPE *)s->set_reals;
    fmi3DoStepTYPE *do_step = (fmi3DoStepTYPE *)s->do_step;
    fmi3GetFloat64TYPE *get_reals = (fmi3GetFloat64TYPE *)s->get_reals;
    fmi3GetBooleanTYPE *get_flags = (fmi3GetBooleanTYPE *)s->get_flags;
    fmi3Boolean event, terminate, early;
    double last;

    for (long k = 0; k < steps; k++) {
        if (!step_only &&
            set_reals(s->instance, s->input_references, s->n_inputs, s->inputs, s->n_inputs) > fmi3Warning)
            return k;
        if (do_step(s->instance, (double)(first + k) * h, h, fmi3True, &event, &terminate, &early, &last) > fmi3Warning)
            return k;
        if (!step_only &&
            (get_reals(s->instance, s->output_references, s->n_outputs, s->outputs, s->n_outputs) > fmi3Warning ||
             get_flags(s->instance, s->flag_references, s->n_flags, s->flags, s->n_flags) > fmi3Warning))
            return k;
    }
    return steps;
}
