
typedef double (*Height)(double x, const double *cuts);

/* Computes the area over an interval, its moment about a position, and the area that bends at its ends may hide. */
static void integrate(Height height, const double *cuts, double start, double end, double low, double *result)
{
    double half = (end - start) / 2;
    double first = -height(start + 1e-9 * half, cuts);
    double last = -height(end - 1e-9 * half, cuts);
    double area = 0.0;
    double moment = 0.0;
    for (int i = 0; i < 8; i++) {
        double x = (start + end) / 2 + half * NODES[i];
        double y = height(x, cuts);
        area += WEIGHTS[i] * y * half;
        moment += WEIGHTS[i] * y * half * (x - low);
        first += ENDS[7 - i] * y;
        last += ENDS[i] * y;
    }
    result[0] = area;
    result[1] = moment;
    result[2] = (fabs(first) + fabs(last)) * (1.0 - NODES[7]) * half;
}

/* Computes the area, its moment about the start, and the position that halves a total area, of several the middle one.
   The height is smooth between the edges of panels but for where terms meet their cuts and each other. A panel is halved
   until the integral over it is that over its halves. */
static void integrate_panels(Height height, const double *cuts, const double *edges, int panels, double tolerance,
                             double total, double *result)
{
    double ends[PANELS + 60]; /* of panels, the next one last */
    double positions[2]; /* the first and the last one that halve the total */
    double coarse[3];
    double left[3];
    double right[3];
    double part[3];
    for (int k = 0; k < panels; k++) {
        ends[k] = edges[panels - k];
    }
    positions[0] = edges[panels];
    positions[1] = edges[panels];
    double area = 0.0;
    double moment = 0.0;
    double start = edges[0];
    int n = panels;
    int halvings = 0;
    while (n > 0) {
        double end = ends[n - 1];
        double middle = (start + end) / 2;
        integrate(height, cuts, start, end, edges[0], coarse);
        integrate(height, cuts, start, middle, edges[0], left);
        integrate(height, cuts, middle, end, edges[0], right);
        double fine = left[0] + right[0];
        tolerance = greatest(tolerance, 1e-13 * (area + fine));
        double noise = 0.0; /* of degrees by rounding */
        if (end - start < 1e-6 * (ends[0] - edges[0])) {
            noise = 4e-16 * (end - start);
        }
        double error = greatest(greatest(fabs(fine - coarse[0]), left[2]), right[2]);
        double moment_error = fabs(left[1] + right[1] - coarse[1]);
        int converged = error <= tolerance + noise && moment_error <= (tolerance + noise) * (end - edges[0]);
        if (converged || n == panels + 60 || halvings == 4096 || !(start < middle && middle < end)) {
            for (int i = 0; i < 2; i++) {
                double target = total / 2 * (1.0 + (2 * i - 1) * 1e-11);
                if (area < target && target <= area + fine) {
                    double inside = start;
                    positions[i] = end;
                    for (int j = 0; j < 60; j++) {
                        middle = (inside + positions[i]) / 2;
                        integrate(height, cuts, start, middle, edges[0], part);
                        if (area + part[0] < target) {
                            inside = middle;
                        } else {
                            positions[i] = middle;
                        }
                    }
                }
            }
            area += fine;
            moment += left[1] + right[1];
            start = end;
            n--;
        } else {
            ends[n] = middle;
            n++;
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
    return least(greatest(edges[0] + result[1] / result[0], edges[0]), edges[panels]);
}

/* Returns a position of the maximum height in an interval. */
static double find_maximum(Height height, const double *cuts, double start, double end)
{
    double best = start;
    for (int i = 0; i < 33; i++) {
        double x = end;
        if (i < 32) {
            x = start + (end - start) * i / 32;
        }
        if (height(x, cuts) > height(best, cuts)) {
            best = x;
        }
    }
    double left = greatest(best - (end - start) / 32, start);
    double right = least(best + (end - start) / 32, end);
    for (int i = 0; i < 80; i++) {
        double first = left + (right - left) / 3;
        double second = right - (right - left) / 3;
        if (height(first, cuts) < height(second, cuts)) {
            left = first;
        } else {
            right = second;
        }
    }
    if (height(best, cuts) < height(left, cuts)) {
        best = left;
    }
    return best;
}

/* Returns the last position from one of the maximum height towards another to which the height is constant. */
static double plateau_end(Height height, const double *cuts, double top, double x, double outside)
{
    double level = top * (1.0 - 1e-12);
    double inside = x;
    if (height(outside, cuts) >= level) {
        inside = outside;
    }
    for (int i = 0; i < 80; i++) {
        double middle = (inside + outside) / 2;
        if (height(middle, cuts) >= level) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    if (height((x + inside) / 2, cuts) < top * (1.0 - 1e-13)) {
        inside = x;
    }
    return inside;
}

/* Returns the smallest (side -1), mean (0) or largest (1) position of the maximum height; NaN where that is 0. */
static inline double position_of_maximum(Height height, const double *cuts, const double *edges, int panels, int side)
{
    double tops[PANELS];
    double width = edges[panels] - edges[0];
    double top = 0.0;
    for (int k = 0; k < panels; k++) {
        tops[k] = find_maximum(height, cuts, edges[k], edges[k + 1]);
        top = greatest(top, height(tops[k], cuts));
    }
    if (!(top > 0.0)) {
        return NAN;
    }
    double length = 0.0;
    double moment = 0.0;
    double count = 0.0;
    double total = 0.0;
    double smallest = edges[panels];
    double largest = edges[0] - width;
    for (int k = 0; k < panels; k++) {
        if (height(tops[k], cuts) >= top * (1.0 - 1e-12)) {
            double left = plateau_end(height, cuts, top, tops[k], edges[k]);
            double right = plateau_end(height, cuts, top, tops[k], edges[k + 1]);
            double middle = (left + right) / 2;
            length += right - left;
            moment += (right - left) * (middle - edges[0]);
            if (left - largest > 1e-9 * width) {
                count += 1.0;
                total += middle - edges[0];
            }
            smallest = least(smallest, left);
            largest = right;
        }
    }
    if (side < 0) {
        return smallest;
    }
    if (side > 0) {
        return largest;
    }
    if (length > 1e-9 * width) {
        return edges[0] + moment / length;
    }
    return edges[0] + total / count;
}
