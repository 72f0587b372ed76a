/* Elementary functions from arithmetic and square roots alone. C libraries differ in the last bit of theirs; these give
 * the same bits on every processor and system, within 2 units in the last place. */
#ifndef ELEMENTARY_H
#define ELEMENTARY_H

#include "model.h" /* names the functions */

double elementary_log(double x); /* of a finite number above 0 */
double elementary_expm1(double x); /* exp(x) - 1 of a number up to 0 */
double elementary_cos_turns(double turns); /* the cosine of a part of a turn in [0, 1) */
double elementary_atan2(double y, double x); /* of finite numbers */
double elementary_hypot(double x, double y); /* of numbers whose squares do not overflow */

#endif
