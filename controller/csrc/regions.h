/* Regions of a scene, to be kept within or out of, evaluated together. The same functions as those of
 * controller/regions, in the same order of operations. One sign everywhere: g <= 0 is satisfied, g > 0 is violated.
 *
 * Written for the type `Real` of real.h: a double, or several side by side. Code selects by data with masks, not
 * branches; kinds, signs and offsets are the same in all lanes. */
#ifndef REGIONS_H
#define REGIONS_H

#include "real.h"
#include "shapes.h" /* SHAPE_SPHERE and so on, as `kind` of each shape in Python: generated */

typedef struct {
    int n;
    const int *kinds;
    const double *signs;      /* +1 kept within, -1 kept out of */
    const int *offsets;       /* n + 1 offsets, into numbers */
    const Real *numbers;      /* of all shapes in their order, as `packed` gives them */
    const Real (*shifts)[3];  /* m, NED: shift of each from the place of its numbers */
} Regions;

/* Evaluates every region at a pose: value g_i, at most 0 where satisfied, in the unit of the shape; its gradient
 * dg_i/dp, world frame; the clearance to its surface [m, rad for shapes of attitude], negative where violated. */
void regions_evaluate(const Regions *regions, const Real position[3], const Real quaternion[4], Real value[],
                      Real gradient[][3], Real clearance[]);

/* Returns the membership of a region, given the clearance: 1 where it is violated, decreasing to 0 at `width` outside; NaN
 * for NaN. */
Real regions_ramp(Real clearance, Real width);

#endif
