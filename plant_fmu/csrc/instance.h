/* One instance of the plant behind an FMI wrapper: variables by value reference, modes, checks, messages.
 * Neutral to the FMI version; fmi2.c and fmi3.c translate to and from it. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include <stdbool.h>
#include <stddef.h>

#include "plant.h"

enum { MAX_MESSAGE = 512 }; /* bytes of a logged message */

typedef enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL } Status; /* as in FMI */

typedef enum {
    MODE_INSTANTIATED = 1,
    MODE_INITIALISING = 2,
    MODE_STEPPING = 4,
    MODE_TERMINATED = 8
} Mode; /* bits, so that a call can name all the modes it is allowed in */

typedef struct {
    Plant plant;
    State state;
    Inputs inputs;
    struct {
        Actuators actuators;            /* present forces */
        double wrench[6];               /* what they put on the body */
        double euler[3];
        int thrust_cut[N_THRUSTERS];    /* a command was beyond its limits */
        int wrench_cut;
    } outputs;
    double time;
    double stop_time; /* INFINITY if there is none */
} Model; /* plain data: all that an FMU state holds */

typedef struct Instance Instance;
typedef void LogCallback(const Instance *instance, Status status, const char *category, const char *message);

struct Instance {
    Model model;
    Mode mode;
    bool unprepared;      /* parameters changed since plant_prepare */
    bool outdated;        /* outputs are older than the state, the inputs or the parameters */
    char *name;
    LogCallback *log;
    void *environment;    /* of the importer, */
    void (*logger)(void); /* whose callback has another type in each FMI version */
};

Instance *instance_create(const char *name, const char *token, LogCallback *log, void *environment,
                          void (*logger)(void));
void instance_free(Instance *instance);

Status instance_get_reals(Instance *instance, const unsigned references[], size_t n, double values[]);
Status instance_set_reals(Instance *instance, const unsigned references[], size_t n, const double values[]);
Status instance_get_flag(Instance *instance, unsigned reference, bool *value);

/* Sets the experiment's times; a stop time of INFINITY is none. */
Status instance_set_experiment(Instance *instance, double start_time, double stop_time);
Status instance_enter_initialisation(Instance *instance);
Status instance_exit_initialisation(Instance *instance);
Status instance_step(Instance *instance, double time, double step);
Status instance_terminate(Instance *instance);
Status instance_reset(Instance *instance);

/* Status of a function that this FMU does not offer. */
Status instance_unsupported(Instance *instance, const char *function);

/* Logs an error in printf's manner, whether logging is on or off, and returns STATUS_ERROR, so that a check is one line.
 * Nothing but errors is logged. */
Status instance_refuse(const Instance *instance, const char *format, ...);

#endif
