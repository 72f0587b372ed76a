/* A period that is counted: what is due at the beginning of a step, whatever the importer's sum of its steps has become. */
#ifndef TICKS_H
#define TICKS_H

#include <math.h>
#include <stdbool.h>

typedef struct {
    double period; /* s; 0: not begun */
    double since;  /* s, time of tick 0 */
    double count;  /* of ticks that were done */
} Ticks;

/* Begins to count, anew where the period is another. */
static inline void ticks_begin(Ticks *ticks, double period, double time)
{
    if (ticks->period == period)
        return;
    ticks->period = period;
    ticks->since = time;
    ticks->count = 0.0;
}

/* Whether a tick is due; then it is done, with all that have gone by. */
static inline bool ticks_due(Ticks *ticks, double time)
{
    const double by = time + 1e-6 * ticks->period + 1e-15 * (fabs(time) + fabs(ticks->since)); /* sums may lag a little */

    if (!(ticks->since + ticks->count * ticks->period <= by))
        return false;
    ticks->count = fmax(ticks->count, floor((by - ticks->since) / ticks->period)) + 1.0;
    return true;
}

/* Whether a step is so long that a tick would be left out. */
static inline bool ticks_left_out(const Ticks *ticks, double step)
{
    return step > ticks->period * (1.0 + 1e-6);
}

/* Whether counts that were restored can be. */
static inline bool ticks_possible(const Ticks *ticks)
{
    return ticks->period >= 0.0 && ticks->period < 1e9 && fabs(ticks->since) <= 1e9 && ticks->count >= 0.0 &&
           ticks->count < 1e15;
}

#endif
