
typedef double (*Height)(double x, const double *cuts);

/* Returns the area over an interval, its moment about a position, and the area that bends at its ends may hide. */
static void integrate(Height height, const double *cuts, double start, double end, double low, double result[3])
{
    static const double nodes[] = {NODES}, weights[] = {WEIGHTS}, ends[] = {ENDS};
    double area = 0.0, moment = 0.0, half = (end - start) / 2;
    double first = -height(start + 1e-9 * half, cuts), last = -height(end - 1e-9 * half, cuts);
    for (int i = 0; i < 8; i++) {
        double x = (start + end) / 2 + half * nodes[i], y = height(x, cuts);
        area += weights[i] * y * half;
        moment += weights[i] * y * half * (x - low);
        first += ends[7 - i] * y;
        last += ends[i] * y;
    }
    result[0] = area;
    result[1] = moment;
    result[2] = (fabs(first) + fabs(last)) * (1.0 - nodes[7]) * half;
}

/* Returns the area, its moment about the start, and the position that halves a total area, of several the middle one.
   Panels are halved until the integral is that over both halves. */
static void integrate_panels(Height height, const double *cuts, const double *edges, int panels, double tolerance,
                             double total, double result[3])
{
    double ends[PANELS + 60], positions[2] = {edges[panels], edges[panels]}; /* the first and the last one */
    double area = 0.0, moment = 0.0, start = edges[0];
    int n = panels, halvings = 0;
    for (int k = 0; k < n; k++) {
        ends[k] = edges[n - k]; /* the next one last */
    }
    while (n > 0) {
        double coarse[3], left[3], right[3], end = ends[n - 1], middle = (start + end) / 2;
        integrate(height, cuts, start, end, edges[0], coarse);
        integrate(height, cuts, start, middle, edges[0], left);
        integrate(height, cuts, middle, end, edges[0], right);
        double fine = left[0] + right[0];
        tolerance = fmax(tolerance, 1e-13 * (area + fine));
        /* of degrees by rounding */
        double noise = end - start < 1e-6 * (ends[0] - edges[0]) ? 4e-16 * (end - start) : 0.0;
        double error = fmax(fmax(fabs(fine - coarse[0]), left[2]), right[2]);
        double moment_error = fabs(left[1] + right[1] - coarse[1]);
        int converged = error <= tolerance + noise && moment_error <= (tolerance + noise) * (end - edges[0]);
        if (converged || n == panels + 60 || halvings == 4096 || !(start < middle && middle < end)) {
            for (int i = 0; i < 2; i++) {
                double target = total / 2 * (1.0 + (2 * i - 1) * 1e-11), inside = start;
                if (area < target && target <= area + fine) {
                    positions[i] = end;
                    for (int j = 0; j < 60; j++) {
                        double part[3];
                        middle = (inside + positions[i]) / 2;
                        integrate(height, cuts, start, middle, edges[0], part);
                        *(area + part[0] < target ? &inside : &positions[i]) = middle;
                    }
                }
            }
            area += fine;
            moment += left[1] + right[1];
            start = end;
            n--;
        } else {
            ends[n++] = middle;
            halvings++;
        }
    }
    result[0] = area;
    result[1] = moment;
    result[2] = (positions[0] + positions[1]) / 2;
}

/* Returns the centroid, or the position that halves the area, of several the middle one; NaN where there is none. */
static inline double center_of_area(Height height, const double *cuts, const double *edges, int panels, int is_bisector)
{
    double result[3];
    integrate_panels(height, cuts, edges, panels, 1e300, 1e300, result);
    double tolerance = 1e-13 * result[0];
    integrate_panels(height, cuts, edges, panels, tolerance, 1e300, result);
    if (!(result[0] > 0.0)) {
        return NAN;
    }
    if (is_bisector) {
        integrate_panels(height, cuts, edges, panels, tolerance, result[0], result);
        return result[2];
    }
    return fmin(fmax(edges[0] + result[1] / result[0], edges[0]), edges[panels]);
}

/* Returns a position of the maximum height in an interval. */
static double find_maximum(Height height, const double *cuts, double start, double end)
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
static double plateau_end(Height height, const double *cuts, double top, double x, double outside)
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
    double tops[PANELS], smallest = edges[panels], largest = edges[0] - width;
    for (int k = 0; k < panels; k++) {
        tops[k] = find_maximum(height, cuts, edges[k], edges[k + 1]);
        top = fmax(top, height(tops[k], cuts));
    }
    if (!(top > 0.0)) {
        return NAN;
    }
    for (int k = 0; k < panels; k++) {
        if (height(tops[k], cuts) >= top * (1.0 - 1e-12)) {
            double left = plateau_end(height, cuts, top, tops[k], edges[k]);
            double right = plateau_end(height, cuts, top, tops[k], edges[k + 1]), middle = (left + right) / 2;
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
