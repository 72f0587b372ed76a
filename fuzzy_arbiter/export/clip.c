
/* Returns the centroid of clipped terms, aggregated by maximum; not all cuts are 0. In each piece the lines of the terms
   have one order, the highest first; each adds the area between the cuts of those before it and its own. */
static double centroid_of_clipped(const double *cuts, int terms, int pieces, const double *places,
                                  const int *first, const int *term, const double *left, const double *right,
                                  const int *order)
{
    double largest = 0.0, larger = 1.0, area = 0.0, moment = 0.0;
    for (int t = 0; t < terms; t++) {
        largest = cuts[t] > largest ? cuts[t] : largest;
    }
    if (largest < 1e-120) {
        larger = 0x1p266; /* scales all cuts if the greatest is tiny: the centroid stays, nothing underflows */
    }
    for (int piece = 0; piece < pieces; piece++) {
        double width = places[piece + 1] - places[piece], start = places[piece] - places[0], below = 0.0;
        for (int i = first[piece]; i < first[piece + 1]; i++) {
            double cut = cuts[term[order[i]]] * larger, a = left[order[i]], b = right[order[i]];
            if (cut > below) {
                double low = a < b ? a : b, high = a > b ? a : b, s0 = 0.0, s1 = 0.0;
                double y0 = cut < low ? cut : low, y1 = cut < high ? cut : high;
                y0 = y0 > below ? y0 : below;
                y1 = y1 > below ? y1 : below;
                double h0 = y0 - below, h1 = y1 - below;
                if (low < high) {
                    s0 = (y0 - low) / (high - low);
                    s1 = (y1 - low) / (high - low);
                    s0 = s0 < 0.0 ? 0.0 : s0 > 1.0 ? 1.0 : s0;
                    s1 = s1 < 0.0 ? 0.0 : s1 > 1.0 ? 1.0 : s1;
                }
                double band = (s1 - s0) * (h0 + h1) / 2 + (1.0 - s1) * h1;
                double lever = (s1 - s0) * (s0 * (2 * h0 + h1) + s1 * (h0 + 2 * h1)) / 6
                             + (1.0 - s1) * (1.0 + s1) / 2 * h1;
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
