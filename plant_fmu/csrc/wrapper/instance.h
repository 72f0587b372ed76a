/* One instance of a component behind an FMI wrapper: variables by value reference, modes, checks, messages.
 * Neutral to the FMI version; fmi2.c and fmi3.c translate to and from it. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include <stdbool.h>
#include <stddef.h>

#include "component.h" /* names the functions, and holds the model */

enum { MAX_MESSAGE = 512 }; /* bytes of a logged message */

#define MAX_TIME 1e9 /* s */

typedef enum { CO_SIMULATION, MODEL_EXCHANGE, NO_INTERFACE } Interface;

typedef enum {
    MODE_INSTANTIATED = 1,
    MODE_INITIALIZING = 2,
    MODE_STEPPING = 4,    /* co-simulation */
    MODE_EVENT = 8,       /* model exchange, and co-simulation with clocks */
    MODE_CONTINUOUS = 16, /* model exchange */
    MODE_TERMINATED = 32
} Mode; /* bits, so that a call can name all the modes in which it is allowed */

typedef enum { LOG_EVENTS = 1, LOG_WARNINGS = 2, LOG_DISCARDS = 4, LOG_ERRORS = 8, LOG_ALL = 15 } LogCategories;

typedef enum { TYPE_REAL, TYPE_INTEGER, TYPE_BOOLEAN, TYPE_CLOCK } Type;
typedef enum { TIME, STATE, INPUT, OUTPUT, PARAMETER } Role;

typedef struct {
    const char *name;
    Type type; /* a real variable is a double, the others are int; a clock is an output */
    Role role;
    unsigned size; /* elements from here on of the array that begins here; 1: a scalar, 0: within an array */
    size_t offset; /* into Model */
    double start, min, max, nominal;
} Variable;

typedef void LogCallback(const Instance *instance, Status status, const char *category, const char *message);

struct Instance {
    Model model;
    Model before;         /* of the step, for a component that undoes one */
    Interface kind;
    Mode mode;
    double start_time;    /* s, of the experiment */
    bool refused;         /* invalid experiment times: no initialization until valid ones are set */
    bool unprepared;      /* parameters changed since the component was prepared */
    bool outdated;        /* outputs are older than the state, the inputs or the parameters */
    bool has_event_mode;  /* co-simulation: the importer handles events */
    bool returns_early;   /* and steps end where a clock ticks */
    unsigned categories;  /* enabled LogCategories */
    char *name;
    LogCallback *log;
    void *environment;    /* of the importer */
    void (*logger)(void); /* of the importer; its type differs between FMI versions */
};

/* ---- instance.c: life cycle, modes, messages ---- */

Instance *instance_create(const char *name, const char *token, Interface kind, bool logging_on, LogCallback *log,
                          void *environment, void (*logger)(void));
void instance_free(Instance *instance);
Status instance_reset(Instance *instance);

/* Refuses to enter initialization twice, or after it has ended. */
Status instance_require_new(const Instance *instance);
/* Sets the experiment's times; a stop time of INFINITY: none. */
Status instance_set_experiment(Instance *instance, double tolerance, double start_time, double stop_time);
Status instance_enter_initialization(Instance *instance);
Status instance_exit_initialization(Instance *instance);
Status instance_terminate(Instance *instance);

/* Refuses an action outside its allowed modes. */
Status instance_require(const Instance *instance, unsigned modes, const char *action);

/* Updates the outputs; fails if parameters contradict each other. */
Status instance_update(Instance *instance);

/* Updates constants and clocks from the parameters. */
Status instance_prepare(Instance *instance);

/* True until initialization ends. */
bool instance_is_starting(const Instance *instance);

/* Logs an error with printf's arguments, unless errors are switched off or there is no instance. Returns STATUS_ERROR, so
 * that a check is one line. */
Status instance_refuse(const Instance *instance, const char *format, ...);

/* Logs with printf's arguments, if the category is enabled. Returns the status of the category. */
Status instance_log(const Instance *instance, LogCategories category, const char *format, ...);

Status instance_set_logging(Instance *instance, bool on, size_t n, const char *const categories[]);

/* Refuses a function that this FMU does not offer. */
Status instance_unsupported(const Instance *instance, const char *function);

/* Refuses a NULL argument, named by its index in a comma-separated list of names. */
Status instance_refuse_null(const Instance *instance, const char *function, const char *names, size_t index);

/* True if there is an instance and, for n above 0, no NULL among the pointers to n values each. */
static inline bool instance_check_pointers(const Instance *instance, const char *function, size_t n,
                                  const void *const pointers[], size_t n_pointers, const char *names)
{
    for (size_t i = 0; i < n_pointers; i++)
        if (n > 0 && !pointers[i])
            return instance_refuse_null(instance, function, names, i) == STATUS_OK;
    return instance != NULL;
}

/* Calls instance_check_pointers for the enclosing function, as CHECK_POINTERS(instance, n, first, second). */
#define CHECK_POINTERS(instance, n, ...)                                                  \
    instance_check_pointers(instance, __func__, n, (const void *const[]){__VA_ARGS__},             \
                   sizeof((const void *const[]){__VA_ARGS__}) / sizeof(void *), #__VA_ARGS__)

/* ---- variables.c ---- */

extern const Variable VARIABLES[]; /* by value reference */
extern const unsigned N_VARIABLES;
extern const char TOKEN[]; /* INSTANTIATION_TOKEN; its file alone depends on the vehicle */

/* Returns the address of a variable in the model. */
double *variable_real(Model *model, const Variable *variable);
int *variable_integer(Model *model, const Variable *variable);

/* Sets every variable except outputs to its start value, and everything else to zero. */
void variables_start(Model *model);

/* True if a clock has ticked since they were cleared. */
bool variables_has_ticked(const Model *model);
void variables_clear_clocks(Model *model);

/* Checks the references of variables of a type, and that there is a value for each of their elements. */
Status instance_check_count(const Instance *instance, Type type, const unsigned references[], size_t n, size_t n_values);

/* Values are those of all elements, side by side. */
Status instance_get_reals(Instance *instance, const unsigned references[], size_t n, double values[], size_t n_values);
Status instance_set_reals(Instance *instance, const unsigned references[], size_t n, const double values[], size_t n_values);
/* A reference may be that of an element. */
Status instance_get_integer(Instance *instance, Type type, unsigned reference, int *value);
Status instance_set_integer(Instance *instance, Type type, unsigned reference, int value);

/* Returns the first independent variable that is not finite or out of its range; NULL: none. */
const Variable *variables_first_invalid(const Model *model);
/* The same for the states alone. */
const Variable *variables_first_invalid_state(const Model *model);

/* ---- stepping.c ---- */

Status instance_step(Instance *instance, double time, double step);

/* Enters event mode, which is allowed in the modes `from`. */
Status instance_enter_event_mode(Instance *instance, unsigned from);
Status instance_enter_continuous_mode(Instance *instance);
Status instance_enter_step_mode(Instance *instance);
/* Deactivates the clocks; sets `again` if one ticks in this very call. */
Status instance_update_discrete(Instance *instance, bool *again, bool *states_changed, double *next_event_time);
/* A clock is active in event mode, from its tick to the update. */
Status instance_get_clock(Instance *instance, unsigned reference, bool *active);
Status instance_set_time(Instance *instance, double time);
Status instance_set_states(Instance *instance, const double states[], size_t n);
Status instance_get_states(Instance *instance, double states[], size_t n);
Status instance_get_derivatives(Instance *instance, double derivatives[], size_t n);
Status instance_get_nominals(Instance *instance, double nominals[], size_t n);

/* ---- derivatives.c ---- */

/* Variables, and how many values they have together. */
typedef struct {
    const unsigned *references;
    size_t n, n_values;
} Selection;

/* sensitivity = J seed, with J the partial derivatives of the unknowns with respect to the knowns. */
Status instance_directional_derivative(Instance *instance, Selection unknowns, Selection knowns, const double seed[],
                                       double sensitivity[]);

/* sensitivity = J^T seed. */
Status instance_adjoint_derivative(Instance *instance, Selection unknowns, Selection knowns, const double seed[],
                                   double sensitivity[]);

/* ---- saved.c: FMU states ---- */

typedef struct Saved Saved;

Status instance_save(Instance *instance, Saved **saved);
Status instance_restore(Instance *instance, const Saved *saved);
Status instance_free_saved(Instance *instance, Saved **saved);
Status instance_serialized_size(Instance *instance, const Saved *saved, size_t *size);
Status instance_serialize(Instance *instance, const Saved *saved, unsigned char bytes[], size_t size);
Status instance_deserialize(Instance *instance, const unsigned char bytes[], size_t size, Saved **saved);

#endif
