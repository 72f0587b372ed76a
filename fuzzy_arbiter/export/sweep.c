
/* Height of the envelope at a share of the piece whose degrees begin at left and right. */
static double envelope(const double *cuts, int terms, const double *left, const double *right, double share, int scaled)
{
    double height = 0.0;
    for (int t = 0; t < terms; t++) {
        double degree = left[t] + (right[t] - left[t]) * share;
        degree = scaled ? degree * cuts[t] : degree < cuts[t] ? degree : cuts[t];
        if (degree > height) {
            height = degree;
        }
    }
    return height;
}

/* Puts a place where the envelope may break among those before it, in rising order. */
static void insert(double *breaks, int n, double place)
{
    while (n > 0 && breaks[n - 1] > place) {
        breaks[n] = breaks[n - 1];
        n--;
    }
    breaks[n] = place;
}

/* Centroid of clipped (or scaled) terms, joined by their maximum; not all cuts are 0. */
static double centroid(const double *given, int terms, int pieces, const double *places, const double *left,
                       const double *right, int scaled)
{
    double cuts[TERMS], largest = 0.0, area = 0.0, moment = 0.0;
    for (int t = 0; t < terms; t++) {
        largest = given[t] > largest ? given[t] : largest;
    }
    for (int t = 0; t < terms; t++) {
        /* if no cut is greater, all are made larger alike: the centroid stays, and nothing underflows */
        cuts[t] = largest < 1e-120 ? given[t] * 0x1p266 : given[t];
    }
    for (int piece = 0; piece < pieces; piece++, left += terms, right += terms) {
        double width = places[piece + 1] - places[piece], start = places[piece] - places[0];
        /* where the envelope may break, in shares of the piece */
        double breaks[2 + 2 * TERMS * TERMS] = {0.0, 1.0};
        int n = 2;
        for (int t = 0; t < terms; t++) {
            double a = left[t], b = right[t];
            if (scaled) {
                a *= cuts[t];
                b *= cuts[t];
            }
            for (int u = 0; u < terms; u++) {
                if (!scaled && (a < cuts[u]) != (b < cuts[u])) {
                    insert(breaks, n++, (cuts[u] - a) / (b - a));
                }
                if (u < t) {
                    double c = left[u], d = right[u];
                    if (scaled) {
                        c *= cuts[u];
                        d *= cuts[u];
                    }
                    if ((a < c) != (b < d)) {
                        insert(breaks, n++, (c - a) / ((b - a) - (d - c)));
                    }
                }
            }
        }
        double x0 = 0.0, y0 = envelope(cuts, terms, left, right, x0, scaled);
        for (int i = 0; i < n; i++) {
            double x1 = breaks[i];
            if (x0 < x1 && x1 <= 1.0) {
                double y1 = envelope(cuts, terms, left, right, x1, scaled);
                double w = (x1 - x0) * width;
                area += w * (y0 + y1) / 2;
                moment += w * ((start + x0 * width) * (2 * y0 + y1) + (start + x1 * width) * (y0 + 2 * y1)) / 6;
                x0 = x1;
                y0 = y1;
            }
        }
    }
    return places[0] + moment / area;
}
