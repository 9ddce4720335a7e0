#include "chi_square.h"

#include <math.h>

/* Abramowitz and Stegun, 26.4.4 and 26.4.5: one term for every second degree,
 * all of them positive. */
double chi_square_tail(double x, int m)
{
    double y = x / 2, k = m % 2 == 0 ? 1 : 0.5;
    double sum = m % 2 == 0 ? exp(-y) : erfc(sqrt(y));

    for (; k < 0.5 * m; k += 1)
        sum += exp(k * log(y) - y - lgamma(k + 1));
    return sum;
}

/* Halving an interval whose ends are powers of 2 ends at numbers of few bits:
 * an error of the tail in its last bit cannot be seen in them. */
double chi_square_quantile(double p, int m)
{
    double q = 1 - p, low = 0, high = 1, middle;
    int halvings = 40;

    for (; chi_square_tail(high, m) > q; high *= 2)
        low = high;
    for (; halvings > 0; halvings--) {
        middle = (low + high) / 2;
        if (chi_square_tail(middle, m) > q)
            low = middle;
        else
            high = middle;
    }
    return high;
}
