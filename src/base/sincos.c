/* x = n pi/2 + r, |r| <= pi/4, by Cody and Waite's reduction (Software Manual
 * for the Elementary Functions, 1980) with pi/2 in three parts; then Taylor's
 * series of sin r and cos r, swapped and negated by n.
 *
 * The three parts leave an error of n pi/2 below 2^-120, |n| <= 652, and x is
 * never closer to n pi/2 than 2^-61: so the results near the zeros of sine and
 * cosine have all their digits too, and the absolute bound that base.h allows
 * is not used.  (Float: below 2^-48, x not closer than 2^-28; 0.35 ulp at the
 * worst x, 161 pi/2 to the nearest.)
 *
 * Error in ulp of the result, before the last rounding's 0.5:
 *   sine: r^3/6 (1 - ...), at most 0.08, and its factors rounded      0.3
 *   cosine: r^4/24 (1 - ...) rounded; 1 - cut^2/2 is exact            0.1
 *   Taylor's remainders, r^19/19! and r^18/18!
 *   (float r^11/11! and r^12/12!)                           0.01 (float 0.03)
 * Measured: 0.81 (every float: 0.79).
 */
#include "jumplink/base.h"
#include "ieee.h"
#include "mathx.h"

#define LIMIT JL_C(1024.0)
#define TURN 1024                       /* makes n positive; a multiple of 4 */
#define PER_QUARTER JL_C(0.63661977236758134)           /* 2 / pi */

#if JL_REAL_FLOAT

#define TINY JL_C(0.0001220703125)      /* 2^-13: sin x = x, cos x = 1 */

/* pi/2: 14 bits, 14 bits (n, of 10 bits, times them is exact), and the rest. */
#define QUARTER_1 JL_C(1.57080078125)
#define QUARTER_2 JL_C(-0.000004454515874385833740234375)
#define QUARTER_3 JL_C(6.07710063e-11)

/* Adding and subtracting it leaves a multiple of 2^-11: 1 minus half of the
 * square of such a number is exact. */
#define CUT JL_C(6144.0)                /* 1.5 * 2^12 */

/* (sin r - r) / r^3 of rr = r^2 */
JL_INLINE jl_real sine_tail(jl_real rr)
{
    return rr * (JL_C(1.0) / 120 + rr * (rr * (JL_C(1.0) / 362880)
        - JL_C(1.0) / 5040)) - JL_C(1.0) / 6;
}

/* (cos r - 1 + r^2/2) / r^4 */
JL_INLINE jl_real cosine_tail(jl_real rr)
{
    return JL_C(1.0) / 24 + rr * (rr * (JL_C(1.0) / 40320
        - rr * (JL_C(1.0) / 3628800)) - JL_C(1.0) / 720);
}

#else

#define TINY JL_C(7.450580596923828125e-9)              /* 2^-27 */

/* pi/2: 43 bits, 43 bits, and the rest. */
#define QUARTER_1 JL_C(1.570796326794834385509602725505828857421875)
#define QUARTER_2 JL_C(6.2233721718962612e-14)
#define QUARTER_3 JL_C(3.5215598651832002e-27)

#define CUT JL_C(100663296.0)           /* 1.5 * 2^26: a multiple of 2^-26 */

JL_INLINE jl_real sine_tail(jl_real rr)
{
    const jl_real r4 = rr * rr;

    return rr * ((JL_C(1.0) / 120 - rr * (JL_C(1.0) / 5040))
        + r4 * ((JL_C(1.0) / 362880 - rr * (JL_C(1.0) / 39916800))
        + r4 * ((JL_C(1.0) / 6227020800.0 - rr * (JL_C(1.0) / 1307674368000.0))
        + r4 * (JL_C(1.0) / 355687428096000.0)))) - JL_C(1.0) / 6;
}

JL_INLINE jl_real cosine_tail(jl_real rr)
{
    const jl_real r4 = rr * rr;

    return (JL_C(1.0) / 24 - rr * (JL_C(1.0) / 720))
        + r4 * ((JL_C(1.0) / 40320 - rr * (JL_C(1.0) / 3628800))
        + r4 * ((JL_C(1.0) / 479001600 - rr * (JL_C(1.0) / 87178291200.0))
        + r4 * (JL_C(1.0) / 20922789888000.0)));
}

#endif

int jl_sincos(jl_real *s, jl_real *c, jl_real x)
{
    jl_real base, cosine, cut, low, n, part, r, rest, rr, sine;
    int quarter;

    if (!(x >= -LIMIT && x <= LIMIT))
        return JL_ERANGE;
    if (jli_abs(x) < TINY) {            /* keeps the sign of 0 */
        *s = x;
        *c = 1;
        return JL_OK;
    }
    quarter = (int)(x * PER_QUARTER + (TURN + JL_C(0.5)));
    n = (jl_real)(quarter - TURN);

    /* r + low = x - n pi/2; the first difference is exact. */
    rest = x - n * QUARTER_1;
    part = n * QUARTER_2;
    r = rest - part;
    low = (rest - r - part) - n * QUARTER_3;

    /* r^2/2 would be rounded: 1/4 ulp.  Of r^2 = cut^2 + (r + cut) (r - cut)
     * only the last, small product is. */
    rr = r * r;
    cut = (r + CUT) - CUT;
    base = 1 - cut * cut / 2;
    cosine = base
        + (rr * rr * cosine_tail(rr) - (r + cut) * (r - cut + low) / 2);
    sine = r + (low * base + r * rr * sine_tail(rr));

    *s = quarter & 1 ? cosine : sine;
    *c = quarter & 1 ? sine : cosine;
    if (quarter & 2)
        *s = -*s;
    if ((quarter + 1) & 2)
        *c = -*c;
    return JL_OK;
}
