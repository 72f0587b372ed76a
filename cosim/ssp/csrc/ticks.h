/* A period that is counted: what is due at the beginning of a step, whatever the importer's sum of its steps has become. */
#ifndef TICKS_H
#define TICKS_H

#include <math.h>
#include <stdbool.h>

typedef struct {
    double period; /* s; 0: not begun */
    double since;  /* s, time of tick 0 */
    double count;  /* of ticks that were done */
    double warned; /* 1: of a tick that was late */
} Ticks;

/* Begins to count, anew where the period is another. */
static inline void ticks_begin(Ticks *ticks, double period, double time)
{
    if (ticks->period == period)
        return;
    ticks->period = period;
    ticks->since = time;
    ticks->count = 0.0;
    ticks->warned = 0.0;
}

/* Up to when a tick is due at a time: sums may lag a little. */
static inline double ticks_by(const Ticks *ticks, double time)
{
    return time + 1e-6 * ticks->period + 1e-15 * (fabs(time) + fabs(ticks->since));
}

/* How late the tick comes that is due [s], 0 if it is in time or another was late before: then the master's steps do not
 * divide the period, which is worth one warning. */
static inline double ticks_first_late(Ticks *ticks, double time)
{
    const double late = time - (ticks->since + ticks->count * ticks->period);

    if (ticks->warned != 0.0 || late <= ticks_by(ticks, time) - time)
        return 0.0;
    ticks->warned = 1.0;
    return late;
}

/* Whether a tick is due; then it is done, with all that have gone by. */
static inline bool ticks_due(Ticks *ticks, double time)
{
    const double by = ticks_by(ticks, time);

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
           ticks->count < 1e15 && (ticks->warned == 0.0 || ticks->warned == 1.0);
}

#endif
