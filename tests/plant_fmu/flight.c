/* A flight of an FMI 3.0 plant that is linked in, as flight.h has it; writes all that it got as doubles. */
#include <stdio.h>

#include "instance.h" /* names the functions */
#include "fmi3Functions.h"

#include "flight.h" /* STEPS, STEP; START and VALUES; FORCED and FORCES; OUTPUTS */

enum { N_START = sizeof START / sizeof START[0], N_FORCED = sizeof FORCED / sizeof FORCED[0],
       N_OUTPUTS = sizeof OUTPUTS / sizeof OUTPUTS[0] };

int main(void)
{
    double got[N_OUTPUTS], last;
    fmi3Boolean event, terminate, early;
    const fmi3Instance plant = fmi3InstantiateCoSimulation("flight", INSTANTIATION_TOKEN, "", 0, 0, 0, 0, NULL, 0, NULL,
                                                           NULL, NULL);

    if (!plant || fmi3SetFloat64(plant, START, N_START, VALUES, N_START) != fmi3OK ||
        fmi3EnterInitializationMode(plant, 0, 0.0, 0.0, 0, 0.0) != fmi3OK || fmi3ExitInitializationMode(plant) != fmi3OK ||
        fmi3SetFloat64(plant, FORCED, N_FORCED, FORCES, N_FORCED) != fmi3OK)
        return 1;
    for (int i = 0; i < STEPS; i++) {
        if (fmi3DoStep(plant, i * STEP, STEP, 1, &event, &terminate, &early, &last) != fmi3OK ||
            fmi3GetFloat64(plant, OUTPUTS, N_OUTPUTS, got, N_OUTPUTS) != fmi3OK)
            return 2;
        fwrite(got, sizeof got[0], N_OUTPUTS, stdout);
    }
    fmi3FreeInstance(plant);
    return 0;
}
