
/* Heights of the envelope at both ends of a part of the piece whose degrees begin at left and right. */
static void envelope(const double *cuts, int terms, const double *left, const double *right, double x0, double x1,
                     int scaled, double *y)
{
    double middle = (x0 + x1) / 2, height = y[0] = y[1] = 0.0;
    for (int t = 0; t < terms; t++) {
        double cut = cuts[t], rise = right[t] - left[t], degree = left[t] + rise * middle;
        double start = left[t] + rise * x0, end = left[t] + rise * x1;
        if (scaled) {
            degree *= cut;
            start *= cut;
            end *= cut;
        } else if (degree >= cut) {
            degree = start = end = cut;
        }
        if (degree > height) {
            height = degree;
            y[0] = start;
            y[1] = end;
        }
    }
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
                    insert(breaks, n++, (a - cuts[u]) / ((a - cuts[u]) - (b - cuts[u])));
                }
                if (u < t) {
                    double c = left[u], d = right[u];
                    if (scaled) {
                        c *= cuts[u];
                        d *= cuts[u];
                    }
                    if ((a < c) != (b < d)) {
                        insert(breaks, n++, (a - c) / ((a - c) - (b - d)));
                    }
                }
            }
        }
        double x0 = 0.0;
        for (int i = 0; i < n; i++) {
            double x1 = breaks[i];
            if (x0 < x1) {
                double y[2], w = (x1 - x0) * width;
                envelope(cuts, terms, left, right, x0, x1, scaled, y);
                area += w * (y[0] + y[1]) / 2;
                moment += w * ((start + x0 * width) * (2 * y[0] + y[1]) + (start + x1 * width) * (y[0] + 2 * y[1])) / 6;
                x0 = x1;
            }
        }
    }
    return places[0] + moment / area;
}
