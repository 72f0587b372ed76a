/* A small importer, to run an FMU's library where Python cannot: FMI 2.0 if FMI is 2, else FMI 3.0.
 * Arguments: library, guid or token, number of steps, step in s, reference and value of one input, references to print.
 * Prints the numbers with all their digits, one a line. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#ifdef _WIN32
#include <windows.h>
#define OPEN(path) ((void *)LoadLibraryA(path))
#define FIND(library, name) ((void *)GetProcAddress((HMODULE)(library), name))
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define FIND(library, name) dlsym(library, name)
#endif

#if FMI == 2
#include "fmi2FunctionTypes.h"
#else
#include "fmi3FunctionTypes.h"
#endif

#define CHECK(condition) \
    do { \
        if (!(condition)) { \
            fprintf(stderr, "failed: %s\n", #condition); \
            exit(1); \
        } \
    } while (0)
#define CALL(function, ...) CHECK(((function##TYPE *)FIND(library, #function))(__VA_ARGS__) == 0)

#if FMI == 2
static void tell(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                 fmi2String message, ...)
{
    (void)environment, (void)name, (void)status, (void)category;
    fprintf(stderr, "%s\n", message);
}
#else
static void tell(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment, (void)status, (void)category;
    fprintf(stderr, "%s\n", message);
}
#endif

int main(int argc, char **argv)
{
    CHECK(argc > 6);
    void *library = OPEN(argv[1]);
    CHECK(library != NULL);
    int steps = atoi(argv[3]);
    double step = atof(argv[4]), value = atof(argv[6]);
    unsigned input = (unsigned)atoi(argv[5]);

#if FMI == 2
    fmi2CallbackFunctions callbacks = {tell, calloc, free, NULL, NULL};
    fmi2Component instance = ((fmi2InstantiateTYPE *)FIND(library, "fmi2Instantiate"))(
        "importer", fmi2CoSimulation, argv[2], "", &callbacks, fmi2False, fmi2False);
    CHECK(instance != NULL);
    CALL(fmi2SetupExperiment, instance, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    CALL(fmi2EnterInitializationMode, instance);
    CALL(fmi2ExitInitializationMode, instance);
    CALL(fmi2SetReal, instance, &input, 1, &value);
    for (int i = 0; i < steps; i++)
        CALL(fmi2DoStep, instance, i * step, step, fmi2True);
#else
    fmi3Instance instance = ((fmi3InstantiateCoSimulationTYPE *)FIND(library, "fmi3InstantiateCoSimulation"))(
        "importer", argv[2], "", fmi3False, fmi3False, fmi3False, fmi3False, NULL, 0, NULL, tell, NULL);
    CHECK(instance != NULL);
    CALL(fmi3EnterInitializationMode, instance, fmi3False, 0.0, 0.0, fmi3False, 0.0);
    CALL(fmi3ExitInitializationMode, instance);
    CALL(fmi3SetFloat64, instance, &input, 1, &value, 1);
    for (int i = 0; i < steps; i++) {
        fmi3Boolean event, terminate, early;
        double last;
        CALL(fmi3DoStep, instance, i * step, step, fmi3True, &event, &terminate, &early, &last);
    }
#endif
    for (int i = 7; i < argc; i++) {
        unsigned output = (unsigned)atoi(argv[i]);
        double got;
#if FMI == 2
        CALL(fmi2GetReal, instance, &output, 1, &got);
#else
        CALL(fmi3GetFloat64, instance, &output, 1, &got, 1);
#endif
        printf("%.17g\n", got);
    }
    return 0;
}
