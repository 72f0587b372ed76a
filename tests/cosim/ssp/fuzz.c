/* Calls a co-simulation FMU of FMI 3.0 in random orders with random values: fuzz SEED CALLS. Built with the FMU's sources and
 * the sanitizers, which end it at the first fault; an output that is no number ends it too. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "instance.h"
#include "fmi3Functions.h"

static uint64_t seed;

static uint64_t draw(uint64_t n)
{
    seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
    return (seed >> 11) % n;
}

static double value_of(const Variable *v)
{
    static const double odd[] = {NAN, INFINITY, -INFINITY, 0.0, -0.0, 1e308, -1e308, 1e-320, 1e9, 1e-6, -1.0};
    const double share = (double)draw(1u << 30) / (1u << 30);

    if (draw(20) == 0)
        return odd[draw(sizeof odd / sizeof odd[0])];
    if (draw(4) == 0 || v->role == INPUT)
        return fmax(v->min, -1e3) + share * (fmin(v->max, 1e3) - fmax(v->min, -1e3));
    return draw(3) ? v->start : v->start * (0.5 + share);
}

int main(int argc, char **argv)
{
    long accepted[9] = {0}, calls = argc > 2 ? atol(argv[2]) : 0;
    double time = 0.0;
    fmi3FMUState kept = NULL;

    seed = 88172645463325252u + (uint64_t)atol(argv[1]);
    fmi3Instance unit = fmi3InstantiateCoSimulation("u", INSTANTIATION_TOKEN, NULL, 0, 0, 0, 0, NULL, 0, NULL, NULL, NULL);
    for (long i = 0; i < calls && unit; i++) {
        const unsigned reference = (unsigned)draw(N_VARIABLES + (draw(50) == 0));
        double value = reference < N_VARIABLES ? value_of(&VARIABLES[reference]) : 0.0, last = time;
        size_t size = 0;
        bool event, end, early;
        int what = draw(40) ? draw(3) ? draw(2) ? 0 : 2 : 1 : (int)draw(9), status = fmi3Error;

        switch (what) {
        case 0: status = fmi3SetFloat64(unit, &reference, 1, &value, 1); break;
        case 1: status = fmi3GetFloat64(unit, &reference, 1, &value, 1); break;
        case 2:
            status = fmi3DoStep(unit, time, draw(9) ? 0.01 : value, 1, &event, &end, &early, &last);
            time = last;
            break;
        case 3: status = fmi3EnterInitializationMode(unit, 0, 0.0, time = value, 0, 0.0); break;
        case 4: status = fmi3ExitInitializationMode(unit); break;
        case 5: status = fmi3Reset(unit), time = 0.0; break;
        case 6: status = fmi3GetFMUState(unit, &kept); break;
        case 7: status = kept ? (int)fmi3SetFMUState(unit, kept) : (int)fmi3Error; break;
        case 8:
            if (kept && fmi3SerializedFMUStateSize(unit, kept, &size) == fmi3OK) {
                fmi3Byte *bytes = malloc(size);
                fmi3FMUState other = NULL;
                fmi3SerializeFMUState(unit, kept, bytes, size);
                if (draw(2))
                    bytes[draw(size)] ^= (fmi3Byte)(1 << draw(8));
                status = fmi3DeserializeFMUState(unit, bytes, size, &other);
                fmi3FreeFMUState(unit, &other);
                free(bytes);
            }
        }
        if (what == 1 && status == fmi3OK && !isfinite(value)) {
            printf("%s is %g\n", VARIABLES[reference].name, value);
            return 1;
        }
        accepted[what] += status == fmi3OK;
        if (((Instance *)unit)->mode == MODE_INSTANTIATED && draw(3) == 0 &&
            fmi3EnterInitializationMode(unit, 0, 0.0, time = 0.0, 0, 0.0) == fmi3OK && fmi3ExitInitializationMode(unit) != fmi3OK)
            fmi3Reset(unit);
        time = ((Instance *)unit)->model.time;
    }
    fmi3FreeFMUState(unit, &kept);
    fmi3FreeInstance(unit);
    printf("accepted");
    for (int i = 0; i < 9; i++)
        printf(" %ld", accepted[i]);
    return 0;
}
