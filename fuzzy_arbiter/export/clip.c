
/* Returns the centroid of clipped terms, aggregated by maximum; not all cuts are 0. In each piece the lines of the terms
   have one order, the highest first; each adds the area between the cuts of those before it and its own. */
static double centroid_of_clipped(const double *cuts, int terms, int pieces, const double *places, const int *first,
                                  const int *term, const double *left, const double *right, const int *order)
{
    double largest = 0.0;
    for (int t = 0; t < terms; t++) {
        largest = greatest(cuts[t], largest);
    }
    double larger = 1.0; /* scales all cuts if the greatest is tiny: the centroid stays, nothing underflows */
    if (largest < 1e-120) {
        larger = LARGER;
    }
    double area = 0.0;
    double moment = 0.0;
    for (int piece = 0; piece < pieces; piece++) {
        double width = places[piece + 1] - places[piece];
        double start = places[piece] - places[0];
        double below = 0.0; /* the greatest cut of the lines above */
        for (int i = first[piece]; i < first[piece + 1]; i++) {
            double cut = cuts[term[order[i]]] * larger;
            double a = left[order[i]];
            double b = right[order[i]];
            if (cut > below) {
                double low = least(a, b); /* a falling line is treated as the mirrored rising one */
                double high = greatest(a, b);
                double y0 = greatest(least(cut, low), below);
                double y1 = greatest(least(cut, high), below);
                double h0 = y0 - below;
                double h1 = y1 - below;
                double s0 = 0.0; /* where the line has these heights, as fractions of the piece */
                double s1 = 0.0;
                if (low < high) {
                    s0 = least(greatest((y0 - low) / (high - low), 0.0), 1.0);
                    s1 = least(greatest((y1 - low) / (high - low), 0.0), 1.0);
                }
                double band = (s1 - s0) * (h0 + h1) / 2 + (1.0 - s1) * h1;
                double lever = (s1 - s0) * (s0 * (2 * h0 + h1) + s1 * (h0 + 2 * h1)) / 6;
                lever = lever + (1.0 - s1) * (1.0 + s1) / 2 * h1;
                if (a > b) {
                    lever = band - lever;
                }
                area += width * band;
                moment += width * (start * band + width * lever);
                below = cut;
            }
        }
    }
    return places[0] + moment / area;
}
