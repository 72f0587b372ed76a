
typedef double (*Height)(double x, const double *cuts);

/* Adds the area over an interval and its moment about a position to two sums, by one rule of quadrature; returns the
   area that bends at its ends may hide. */
static double integrate(Height height, const double *cuts, double start, double end, double low, double sums[2])
{
    static const double nodes[] = {NODES}, weights[] = {WEIGHTS}, ends[] = {ENDS};
    double half = (end - start) / 2;
    double first = -height(start + 1e-9 * half, cuts), last = -height(end - 1e-9 * half, cuts);
    for (int i = 0; i < 8; i++) {
        double x = (start + end) / 2 + half * nodes[i], y = height(x, cuts);
        sums[0] += weights[i] * y * half;
        sums[1] += weights[i] * y * half * (x - low);
        first += ends[7 - i] * y;
        last += ends[i] * y;
    }
    return (fabs(first) + fabs(last)) * (1.0 - nodes[7]) * half;
}

/* Returns the area, its moment about the start, and the first position up to which the area reaches a target, in sums.
   Panels are halved until the integral is that over both halves. */
static void integrate_panels(Height height, const double *cuts, const double *edges, int panels, double tolerance,
                             double target, double sums[3])
{
    double ends[PANELS + 60], start = edges[0];
    int n = panels;
    for (int k = 0; k < n; k++) {
        ends[k] = edges[n - k]; /* the next one last */
    }
    sums[0] = sums[1] = 0.0;
    sums[2] = edges[n];
    while (n > 0) {
        double whole[2] = {0.0, 0.0}, both[2] = {0.0, 0.0}, end = ends[n - 1], middle = (start + end) / 2;
        integrate(height, cuts, start, end, edges[0], whole);
        double left = integrate(height, cuts, start, middle, edges[0], both);
        double right = integrate(height, cuts, middle, end, edges[0], both);
        double off = fmax(fabs(both[0] - whole[0]), fmax(left, right));
        int same = off <= tolerance && fabs(both[1] - whole[1]) <= tolerance * (end - edges[0]);
        if (same || n == panels + 60 || !(start < middle && middle < end)) {
            if (sums[0] < target && target <= sums[0] + both[0]) {
                double inside = start;
                sums[2] = end;
                for (int i = 0; i < 60; i++) {
                    double part[2] = {sums[0], 0.0};
                    middle = (inside + sums[2]) / 2;
                    integrate(height, cuts, start, middle, edges[0], part);
                    *(part[0] < target ? &inside : &sums[2]) = middle;
                }
            }
            sums[0] += both[0];
            sums[1] += both[1];
            start = end;
            n--;
        } else {
            ends[n++] = middle;
        }
    }
}

/* Returns the centroid, or the position that halves the area, of several the middle one; NaN where there is none. */
static inline double center_of_area(Height height, const double *cuts, const double *edges, int panels, int halves)
{
    double sums[3], first[3], last[3];
    integrate_panels(height, cuts, edges, panels, 1e300, 1e300, sums);
    double tolerance = 1e-13 * sums[0];
    integrate_panels(height, cuts, edges, panels, tolerance, 1e300, sums);
    if (!(sums[0] > 0.0)) {
        return NAN;
    }
    if (halves) {
        integrate_panels(height, cuts, edges, panels, tolerance, sums[0] / 2 * (1.0 - 1e-11), first);
        integrate_panels(height, cuts, edges, panels, tolerance, sums[0] / 2 * (1.0 + 1e-11), last);
        return (first[2] + last[2]) / 2;
    }
    return fmin(fmax(edges[0] + sums[1] / sums[0], edges[0]), edges[panels]);
}

/* Returns a position of the maximum height in an interval. */
static double highest(Height height, const double *cuts, double start, double end)
{
    double best = start;
    for (int i = 0; i < 33; i++) {
        double x = i < 32 ? start + (end - start) * i / 32 : end;
        best = height(x, cuts) > height(best, cuts) ? x : best;
    }
    double left = fmax(best - (end - start) / 32, start), right = fmin(best + (end - start) / 32, end);
    for (int i = 0; i < 80; i++) {
        double first = left + (right - left) / 3, second = right - (right - left) / 3;
        int rises = height(first, cuts) < height(second, cuts);
        left = rises ? first : left;
        right = rises ? right : second;
    }
    return height(best, cuts) >= height(left, cuts) ? best : left;
}

/* Returns the last position from one of the maximum height towards another to which the height is constant. */
static double boundary(Height height, const double *cuts, double top, double x, double outside)
{
    double level = top * (1.0 - 1e-12), inside = height(outside, cuts) >= level ? outside : x;
    for (int i = 0; i < 80; i++) {
        double middle = (inside + outside) / 2;
        int reaches = height(middle, cuts) >= level;
        inside = reaches ? middle : inside;
        outside = reaches ? outside : middle;
    }
    return height((x + inside) / 2, cuts) >= top * (1.0 - 1e-13) ? inside : x;
}

/* Returns the smallest (side -1), mean (0) or largest (1) position of the maximum height; NaN where that is 0. */
static inline double position_of_maximum(Height height, const double *cuts, const double *edges, int panels, int side)
{
    double width = edges[panels] - edges[0], top = 0.0, length = 0.0, moment = 0.0, count = 0.0, total = 0.0;
    double smallest = edges[panels], largest = edges[0] - width;
    for (int k = 0; k < panels; k++) {
        top = fmax(top, height(highest(height, cuts, edges[k], edges[k + 1]), cuts));
    }
    if (!(top > 0.0)) {
        return NAN;
    }
    for (int k = 0; k < panels; k++) {
        double x = highest(height, cuts, edges[k], edges[k + 1]);
        if (height(x, cuts) >= top * (1.0 - 1e-12)) {
            double left = boundary(height, cuts, top, x, edges[k]);
            double right = boundary(height, cuts, top, x, edges[k + 1]), middle = (left + right) / 2;
            length += right - left;
            moment += (right - left) * (middle - edges[0]);
            count += left - largest > 1e-9 * width ? 1.0 : 0.0;
            total += left - largest > 1e-9 * width ? middle - edges[0] : 0.0;
            smallest = fmin(smallest, left);
            largest = right;
        }
    }
    return side < 0   ? smallest
           : side > 0 ? largest
                      : edges[0] + (length > 1e-9 * width ? moment / length : total / count);
}
