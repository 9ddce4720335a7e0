/* log x = e ln2 - log q + log(1 + r), where x = 2^e m, 1 <= m < 2, q of 8 bits
 * is about 1/m out of a table, and r = m q - 1, |r| <= 2^-5: Tang's method (ACM
 * TOMS 16, 1990) with a table so coarse that r needs no division and is exact,
 * as the sum a + b.
 *
 * Whatever can cancel is exact: e LN2_HIGH, log q's high part and a are
 * multiples of 2^-16 (double: 2^-28), and so is their sum.  So the error, in
 * ulp of the result and before the last rounding's 0.5, is that of the small
 * terms:
 *   r^2 (-1/2 + ...), of results from 32 r^2 up, rounded     0.06
 *   Taylor's remainder, r^11/12 (float r^6/7) times r        0.02 (float 0.01)
 * Measured: 0.549 (every float: 0.546).  Near 1, e ln2 - log q is 0 - 0 or
 * -ln2 + ln2, r is x - 1 and exact, and log 1 is 0.
 */
#include "jumplink/base.h"
#include "ieee.h"

#define CELL_BITS 4

/* Row i is for m around 1 + i/16: q, and -log q as a multiple of 2^-16 and the
 * rest.  In the first and the last row q is exact, so that x - 1 is r. */
static const jl_real cell[(1 << CELL_BITS) + 1][3] = {
    {JL_C(1.0), JL_C(0.0), JL_C(0.0)},
    {JL_C(0.94140625), JL_C(0.0603790283203125), JL_C(1.4826685949798714e-6)},
    {JL_C(0.890625), JL_C(0.1158294677734375), JL_C(2.3477516842050991e-6)},
    {JL_C(0.84375), JL_C(0.1699066162109375), JL_C(-7.5794155400270996e-6)},
    {JL_C(0.80078125), JL_C(0.22216796875), JL_C(-5.0340884570312967e-7)},
    {JL_C(0.76171875), JL_C(0.2721710205078125), JL_C(6.8654080031732884e-6)},
    {JL_C(0.7265625), JL_C(0.319427490234375), JL_C(3.2805319862285962e-6)},
    {JL_C(0.6953125), JL_C(0.3633880615234375), JL_C(5.8326640398276028e-6)},
    {JL_C(0.66796875), JL_C(0.4035186767578125), JL_C(-4.7887809098674617e-6)},
    {JL_C(0.640625), JL_C(0.4453125), JL_C(-1.4833446359473634e-6)},
    {JL_C(0.6171875), JL_C(0.4825897216796875), JL_C(-7.3102270918282523e-6)},
    {JL_C(0.59375), JL_C(0.52130126953125), JL_C(-4.3458979639129229e-6)},
    {JL_C(0.5703125), JL_C(0.5615692138671875), JL_C(1.6089040385368285e-6)},
    {JL_C(0.55078125), JL_C(0.5964202880859375), JL_C(-2.7339845433028783e-6)},
    {JL_C(0.53515625), JL_C(0.6251983642578125), JL_C(-1.8456063749399773e-6)},
    {JL_C(0.515625), JL_C(0.6623687744140625), JL_C(6.7474791291210462e-6)},
    {JL_C(0.5), JL_C(0.693145751953125), JL_C(1.4286068203094172e-6)}
};

#define LN2_HIGH JL_C(0.693145751953125)        /* just as in the last row */
#define LN2_LOW JL_C(1.4286068203094172e-6)

#if JL_REAL_FLOAT

/* (log(1 + r) - r) / r^2 */
JL_INLINE jl_real tail(jl_real r)
{
    const jl_real rr = r * r;

    return (r * (JL_C(1.0) / 3) - JL_C(1.0) / 2)
        + rr * ((r * (JL_C(1.0) / 5) - JL_C(1.0) / 4)
        - rr * (JL_C(1.0) / 6));
}

#else

JL_INLINE jl_real tail(jl_real r)
{
    const jl_real rr = r * r, rrrr = rr * rr;

    return ((r * (JL_C(1.0) / 3) - JL_C(1.0) / 2)
        + rr * (r * (JL_C(1.0) / 5) - JL_C(1.0) / 4))
        + rrrr * (((r * (JL_C(1.0) / 7) - JL_C(1.0) / 6)
        + rr * (r * (JL_C(1.0) / 9) - JL_C(1.0) / 8))
        + rrrr * (r * (JL_C(1.0) / 11) - JL_C(1.0) / 10));
}

#endif

jl_real jl_log(jl_real x)
{
    const jl_real *row;
    jl_real a, b, high, low, n, r, sum, top, rest;
    jl_u32 digits;
    int e = 0;

    if (!(x >= JL_REAL_MIN && x <= JL_REAL_MAX)) {
        if (x == 0)
            return JL_C(-1.0) / (x * x);        /* -infinity */
        if (!(x > 0))
            return (x - x) / (x - x);           /* NaN */
        if (x > JL_REAL_MAX)
            return x;
        x *= jli_pow2(64);                      /* denormal */
        e = -64;
    }
    e += jli_split(&top, &rest, &digits, x);
    row = cell[(digits + (1U << (JLI_TOP_BITS - CELL_BITS - 1)))
               >> (JLI_TOP_BITS - CELL_BITS)];
    n = (jl_real)e;

    a = top * row[0] - 1;
    b = rest * row[0];
    r = a + b;

    /* high + b loses digits of b only; they go to the low part. */
    high = n * LN2_HIGH + row[1] + a;
    low = n * LN2_LOW + row[2];
    sum = high + b;
    return sum + ((high - sum + b) + (low + r * r * tail(r)));
}
