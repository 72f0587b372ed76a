/* Counted periods: ticks due at the beginning of a step, whatever the rounding of the importer's summed time. */
#ifndef TICKS_H
#define TICKS_H

#include <math.h>
#include <stdbool.h>

typedef struct {
    double period; /* s; 0: not begun */
    double since;  /* s, time of tick 0 */
    double count;  /* of ticks that were done */
    double warned; /* 1: a late tick has been warned of */
} Ticks;

/* Starts to count, again if the period has changed. */
static inline void ticks_begin(Ticks *ticks, double period, double time)
{
    if (ticks->period == period)
        return;
    ticks->period = period;
    ticks->since = time;
    ticks->count = 0.0;
    ticks->warned = 0.0;
}

/* Returns the time up to which ticks are due, with a tolerance for summed steps. */
static inline double ticks_by(const Ticks *ticks, double time)
{
    return time + 1e-6 * ticks->period + 1e-15 * (fabs(time) + fabs(ticks->since));
}

/* Returns the lateness of the tick that is due [s]; 0 if it is in time, or an earlier one was late. Lateness means that the
 * master's steps do not divide the period, which is worth one warning. */
static inline double ticks_first_late(Ticks *ticks, double time)
{
    const double late = time - (ticks->since + ticks->count * ticks->period);

    if (ticks->warned != 0.0 || late <= ticks_by(ticks, time) - time)
        return 0.0;
    ticks->warned = 1.0;
    return late;
}

/* Returns true if a tick is due, and counts it with all missed ones. */
static inline bool ticks_due(Ticks *ticks, double time)
{
    const double by = ticks_by(ticks, time);

    if (!(ticks->since + ticks->count * ticks->period <= by))
        return false;
    ticks->count = fmax(ticks->count, floor((by - ticks->since) / ticks->period)) + 1.0;
    return true;
}

/* Returns true if a step is so long that it would skip a tick. */
static inline bool ticks_would_skip(const Ticks *ticks, double step)
{
    return step > ticks->period * (1.0 + 1e-6);
}

/* Returns true if restored counts are valid. */
static inline bool ticks_valid(const Ticks *ticks)
{
    return ticks->period >= 0.0 && ticks->period < 1e9 && fabs(ticks->since) <= 1e9 && ticks->count >= 0.0 &&
           ticks->count < 1e15 && (ticks->warned == 0.0 || ticks->warned == 1.0);
}

#endif
