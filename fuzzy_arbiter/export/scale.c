
/* Inserts a possible kink of the envelope among those before it, in increasing order. */
static int insert_break(double *breaks, int n, double place)
{
    int i = n;
    while (i > 0 && breaks[i - 1] > place) {
        breaks[i] = breaks[i - 1];
        i--;
    }
    breaks[i] = place;
    return n + 1;
}

/* Returns the centroid of scaled terms, aggregated by maximum; not all cuts are 0. */
static double centroid_of_scaled(const double *given, int terms, int pieces, const double *places, const int *first,
                                 const int *term, const double *left, const double *right, const int *order)
{
    (void)order;
    double cuts[TERMS];
    double breaks[2 + TERMS * TERMS]; /* possible kinks of the envelope, as fractions of the piece */
    double largest = 0.0;
    for (int t = 0; t < terms; t++) {
        largest = greatest(given[t], largest);
    }
    double larger = 1.0; /* scales all cuts if the greatest is tiny: the centroid stays, nothing underflows */
    if (largest < 1e-120) {
        larger = LARGER;
    }
    for (int t = 0; t < terms; t++) {
        cuts[t] = given[t] * larger;
    }
    double area = 0.0;
    double moment = 0.0;
    for (int piece = 0; piece < pieces; piece++) {
        double width = places[piece + 1] - places[piece];
        double start = places[piece] - places[0];
        breaks[0] = 1.0;
        int n = 1;
        for (int t = first[piece]; t < first[piece + 1]; t++) {
            for (int u = first[piece]; u < t; u++) {
                double a = left[t] * cuts[term[t]];
                double b = right[t] * cuts[term[t]];
                double c = left[u] * cuts[term[u]];
                double d = right[u] * cuts[term[u]];
                if ((a < c) != (b < d)) {
                    n = insert_break(breaks, n, (a - c) / ((a - c) - (b - d)));
                }
            }
        }
        double x0 = 0.0;
        for (int i = 0; i < n; i++) {
            double x1 = breaks[i];
            if (x0 < x1) {
                double height = 0.0; /* the greatest line is that of the middle; at an end rounding would hide it */
                double y0 = 0.0;
                double y1 = 0.0;
                double w = (x1 - x0) * width;
                for (int t = first[piece]; t < first[piece + 1]; t++) {
                    double cut = cuts[term[t]];
                    double rise = right[t] - left[t];
                    double degree = (left[t] + rise * ((x0 + x1) / 2)) * cut;
                    if (degree > height) {
                        height = degree;
                        y0 = (left[t] + rise * x0) * cut;
                        y1 = (left[t] + rise * x1) * cut;
                    }
                }
                area += w * (y0 + y1) / 2;
                moment += w * ((start + x0 * width) * (2 * y0 + y1) + (start + x1 * width) * (y0 + 2 * y1)) / 6;
                x0 = x1;
            }
        }
    }
    return places[0] + moment / area;
}
