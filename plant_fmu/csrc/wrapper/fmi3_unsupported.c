/* Functions of FMI 3.0 that this FMU does not offer: each logs and returns an error. */
#include "instance.h" /* names the functions, before */
#include "fmi3Functions.h"

#define UNSUPPORTED(function, parameters, ...)                                          \
    fmi3Status function parameters                                                      \
    {                                                                                   \
        __VA_ARGS__;                                                                    \
        return (fmi3Status)instance_unsupported(instance, #function);                   \
    }

/* an empty list of variables is allowed */
#define UNSUPPORTED_FOR_ALL(function, parameters, ...)                                               \
    fmi3Status function parameters                                                                   \
    {                                                                                                \
        __VA_ARGS__;                                                                                 \
        return instance && n == 0 ? fmi3OK : (fmi3Status)instance_unsupported(instance, #function);  \
    }

#define UNSUPPORTED_VALUES_OF(function, type)                                                                  \
    fmi3Status function(fmi3Instance instance, const fmi3ValueReference references[], size_t n, type values[], \
                        size_t nValues)                                                                        \
    {                                                                                                          \
        (void)references, (void)values, (void)nValues;                                                         \
        return instance && n == 0 ? fmi3OK : (fmi3Status)instance_unsupported(instance, #function);            \
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
