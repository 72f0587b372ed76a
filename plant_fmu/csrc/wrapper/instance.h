/* One instance of a component behind an FMI wrapper: variables by value reference, modes, checks, messages.
 * Neutral to the FMI version; fmi2.c and fmi3.c translate to and from it. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include <stdbool.h>
#include <stddef.h>

#include "component.h" /* names the functions, and holds the model */

enum { MAX_MESSAGE = 512 }; /* bytes of a logged message */

#define MAX_TIME 1e9 /* s */

typedef enum { CO_SIMULATION, MODEL_EXCHANGE } Interface;

typedef enum {
    MODE_INSTANTIATED = 1,
    MODE_INITIALISING = 2,
    MODE_STEPPING = 4,    /* co-simulation */
    MODE_EVENT = 8,       /* model exchange */
    MODE_CONTINUOUS = 16, /* model exchange */
    MODE_TERMINATED = 32
} Mode; /* bits, so that a call can name all the modes it is allowed in */

typedef enum { LOG_EVENTS = 1, LOG_WARNINGS = 2, LOG_DISCARDS = 4, LOG_ERRORS = 8, LOG_ALL = 15 } LogCategories;

typedef enum { TYPE_REAL, TYPE_INTEGER, TYPE_BOOLEAN } Type;
typedef enum { TIME, STATE, INPUT, OUTPUT, PARAMETER } Role;

typedef struct {
    const char *name;
    Type type; /* a real variable is a double, the others are int */
    Role role;
    size_t offset; /* into Model */
    double start, min, max, nominal;
} Variable;

typedef void LogCallback(const Instance *instance, Status status, const char *category, const char *message);

struct Instance {
    Model model;
    Interface kind;
    Mode mode;
    double start_time;    /* s, of the experiment */
    bool refused;         /* the times of the experiment: there is no initialisation until others are accepted */
    bool unprepared;      /* parameters changed since the component was prepared */
    bool outdated;        /* outputs are older than the state, the inputs or the parameters */
    unsigned categories;  /* of LogCategories, that are wanted */
    char *name;
    LogCallback *log;
    void *environment;    /* of the importer, */
    void (*logger)(void); /* whose callback has another type in each FMI version */
};

/* ---- instance.c: life, modes, messages ---- */

Instance *instance_create(const char *name, const char *token, Interface kind, bool logging_on, LogCallback *log,
                          void *environment, void (*logger)(void));
void instance_free(Instance *instance);
Status instance_reset(Instance *instance);

/* Refuses to enter initialisation where that is over, or was entered already. */
Status instance_require_new(const Instance *instance);
/* Sets the experiment's times; a stop time of INFINITY is none. */
Status instance_set_experiment(Instance *instance, double start_time, double stop_time);
Status instance_enter_initialisation(Instance *instance);
Status instance_exit_initialisation(Instance *instance);
Status instance_terminate(Instance *instance);

/* Refuses an action outside the modes it is allowed in. */
Status instance_require(const Instance *instance, unsigned modes, const char *action);

/* Brings the outputs up to date; fails where the parameters contradict each other. */
Status instance_update(Instance *instance);

/* Brings constants and clocks up to the parameters. */
Status instance_prepare(Instance *instance);

/* Whether initialisation has not ended. */
bool instance_starting(const Instance *instance);

/* Logs an error in printf's manner, unless errors were switched off or there is no instance, and returns STATUS_ERROR, so
 * that a check is one line. */
Status instance_refuse(const Instance *instance, const char *format, ...);

/* Logs, if the category is wanted, in printf's manner. Returns the status that goes with the category. */
Status instance_tell(const Instance *instance, LogCategories category, const char *format, ...);

Status instance_set_logging(Instance *instance, bool on, size_t n, const char *const categories[]);

/* Status of a function that this FMU does not offer. */
Status instance_unsupported(const Instance *instance, const char *function);

/* Refuses NULL as the argument at that place among names with commas between them. */
Status instance_refuse_null(const Instance *instance, const char *function, const char *names, size_t place);

/* Whether there is an instance and, where n is above 0, no NULL among the pointers to n values each. */
static inline bool instance_given(const Instance *instance, const char *function, size_t n,
                                  const void *const pointers[], size_t n_pointers, const char *names)
{
    for (size_t i = 0; i < n_pointers; i++)
        if (n > 0 && !pointers[i])
            return instance_refuse_null(instance, function, names, i) == STATUS_OK;
    return instance != NULL;
}

/* instance_given of the function that it stands in, as INSTANCE_GIVEN(instance, n, first, second). */
#define INSTANCE_GIVEN(instance, n, ...)                                                  \
    instance_given(instance, __func__, n, (const void *const[]){__VA_ARGS__},             \
                   sizeof((const void *const[]){__VA_ARGS__}) / sizeof(void *), #__VA_ARGS__)

/* ---- variables.c ---- */

extern const Variable VARIABLES[]; /* by value reference */
extern const unsigned N_VARIABLES;
extern const char TOKEN[]; /* INSTANTIATION_TOKEN, in the same file: no other has anything of one vehicle alone */

/* Where the model keeps a variable. */
double *variable_real(Model *model, const Variable *variable);
int *variable_integer(Model *model, const Variable *variable);

/* Puts every variable but the outputs to its start value, and all else to zero. */
void variables_start(Model *model);

Status instance_get_reals(Instance *instance, const unsigned references[], size_t n, double values[]);
Status instance_set_reals(Instance *instance, const unsigned references[], size_t n, const double values[]);
Status instance_get_integer(Instance *instance, Type type, unsigned reference, int *value);
Status instance_set_integer(Instance *instance, Type type, unsigned reference, int value);

/* The first variable that is no number or out of its range, among those that are not calculated; NULL if there is none. */
const Variable *variables_stray(const Model *model);
/* The same among the states alone. */
const Variable *variables_stray_state(const Model *model);

/* ---- stepping.c ---- */

Status instance_step(Instance *instance, double time, double step);

/* `from` are the modes that it may be entered from. */
Status instance_enter_event_mode(Instance *instance, unsigned from);
Status instance_enter_continuous_mode(Instance *instance);
Status instance_update_discrete(Instance *instance, bool *states_changed, double *next_event_time);
Status instance_set_time(Instance *instance, double time);
Status instance_set_states(Instance *instance, const double states[], size_t n);
Status instance_get_states(Instance *instance, double states[], size_t n);
Status instance_get_derivatives(Instance *instance, double derivatives[], size_t n);
Status instance_get_nominals(Instance *instance, double nominals[], size_t n);

/* ---- derivatives.c ---- */

/* sensitivity = J seed, with J the partial derivatives of the unknowns with respect to the knowns. */
Status instance_directional_derivative(Instance *instance, const unsigned unknowns[], size_t n_unknowns,
                                       const unsigned knowns[], size_t n_knowns, const double seed[],
                                       double sensitivity[]);

/* sensitivity = J^T seed. */
Status instance_adjoint_derivative(Instance *instance, const unsigned unknowns[], size_t n_unknowns,
                                   const unsigned knowns[], size_t n_knowns, const double seed[],
                                   double sensitivity[]);

/* ---- saved.c: FMU states ---- */

typedef struct Saved Saved;

Status instance_save(Instance *instance, Saved **saved);
Status instance_restore(Instance *instance, const Saved *saved);
Status instance_free_saved(Instance *instance, Saved **saved);
Status instance_serialised_size(Instance *instance, const Saved *saved, size_t *size);
Status instance_serialise(Instance *instance, const Saved *saved, unsigned char bytes[], size_t size);
Status instance_deserialise(Instance *instance, const unsigned char bytes[], size_t size, Saved **saved);

#endif
