/* Flights of one scenario, for a host that sets numbers before each: the step, the law, the arbiter's rules, and the
 * plant behind FMI 3.0's functions. The host reads and writes the arrays in place. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "fmi3Functions.h"

#define EXPORT(name) __attribute__((export_name(#name)))

static fmi3Instance PLANT;

__extension__ typedef unsigned __int128 Wide;
#define WIDE(high, low) ((Wide)UINT64_C(high) << 64 | UINT64_C(low))

#include "loop.h" /* generated: the translated functions, their arrays in a Model, and the scene */

static Model MODEL;
static char MESSAGE[512]; /* why the last flight did not begin, or ended before its time */

static void log_callback(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment, (void)category;
    if (status > fmi3Warning)
        snprintf(MESSAGE, sizeof MESSAGE, "%s", message);
}

/* Puts all to what the scenario has at the beginning. */
EXPORT(begin) int begin(void)
{
    MESSAGE[0] = '\0';
    rewind_model(&MODEL);
    if (PLANT)
        fmi3FreeInstance(PLANT);
    PLANT = fmi3InstantiateCoSimulation("plant", PLANT_TOKEN, NULL, false, true, false, false, NULL, 0, NULL, log_callback, NULL);
    if (!PLANT)
        return 0;
    for (int i = 0; i < N_STARTS; i++)
        if (fmi3SetFloat64(PLANT, &START_REFERENCES[i], 1, &START_VALUES[i], 1) > fmi3Warning)
            return 0;
    for (int i = 0; i < N_WHOLE_STARTS; i++)
        if (fmi3SetInt32(PLANT, &WHOLE_REFERENCES[i], 1, &WHOLE_VALUES[i], 1) > fmi3Warning)
            return 0;
    for (int i = 0; i < N_FLAG_STARTS; i++)
        if (fmi3SetBoolean(PLANT, &FLAG_REFERENCES[i], 1, &FLAG_VALUES[i], 1) > fmi3Warning)
            return 0;
    return 1;
}

/* Tells the plant a number before it starts. */
EXPORT(set_start) int set_start(unsigned reference, double value)
{
    return fmi3SetFloat64(PLANT, &reference, 1, &value, 1) <= fmi3Warning;
}

/* Draws the noise with the bits of NumPy: PCG64 (XSL-RR 128/64), and the layers of its ziggurat. */
static void draw_noise(double position, double velocity)
{
    Wide state = RANDOM_STATE;

    for (int i = 0, word = 0, skipped = 0, tail = 0; i < 6 * N_NOISE;) {
        double number = TAIL[tail];
        if (i == TAIL_INDICES[tail]) {
            tail++;
        } else {
            state = state * WIDE(2549297995355413924, 4865540595714422341) + RANDOM_INCREMENT;
            if (word++ == SKIPPED[skipped]) {
                skipped++;
                continue;
            }
            const uint64_t mixed = (uint64_t)(state >> 64) ^ (uint64_t)state;
            const unsigned turn = (unsigned)(state >> 122);
            const uint64_t bits = mixed >> turn | mixed << (-turn & 63u);
            number = (bits & 0x100 ? -1.0 : 1.0) * (double)(bits >> 9 & UINT64_C(0xfffffffffffff)) * WIDTHS[bits & 0xff];
        }
        NOISE[i] = (i % 6 < 3 ? position : velocity) * number;
        i++;
    }
}

/* Flies from start to end, with noise of these standard deviations [m, m/s] if the state is measured. Returns 0 if the plant
 * refused its start; a refusal on the way is in the metrics. */
EXPORT(fly) int fly(double position_noise, double velocity_noise)
{
    MODEL.exact = position_noise == 0.0 && velocity_noise == 0.0;
    draw_noise(position_noise, velocity_noise);
    memset(ROWS, 0, sizeof ROWS);
    if (fmi3EnterInitializationMode(PLANT, false, 0.0, 0.0, false, 0.0) > fmi3Warning ||
        fmi3ExitInitializationMode(PLANT) > fmi3Warning)
        return 0;
    control_fly(&MODEL);
    for (double *row = ROWS; row < ROWS + N_ROWS * N_COLUMNS; row += N_COLUMNS)
        strengths_evaluate(row + RULE_INPUTS, row + RULES);
    return 1;
}

EXPORT(numbers) double *numbers(void) { return MODEL.numbers; }
EXPORT(integers) int64_t *integers(void) { return MODEL.integers; }
EXPORT(gains) double *gains(void) { return MODEL.gains; }
EXPORT(rows) double *rows(void) { return ROWS; }
EXPORT(message) char *message(void) { return MESSAGE; }
