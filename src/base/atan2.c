/* The angle of the vector (x, y).  With s <= l the smaller and the larger of
 * |x| and |y|, and c = i/16 near s/l,
 *     atan(s/l) = atan c + atan r,   r = (s - c l) / (l + c s),  |r| < 0.035
 * out of a table and by Taylor's series; then it is taken from or added to a
 * multiple of pi/2.
 *
 * Whatever can cancel is exact: s - c l by cutting l into halves (Dekker, Num.
 * Math. 18, 1971), and the sum of the table's high parts, multiples of 2^-21.
 * The quotient r comes with its remainder.  So the error, in ulp of the result
 * and before the last rounding's 0.5, is that of the small terms:
 *   r^3 (-1/3 + ...), at most r^2/3 of the result, rounded   0.001
 *   Taylor's remainder, r^12/13 (float r^6/7)        0.0002 (float 0.005)
 * Measured: 0.503, of either type.
 */
#include "jumplink/base.h"
#include "ieee.h"
#include "mathx.h"

#define STEPS 16
/* Not 0.5: s - c l must have no more digits than s, in the first cell too. */
#define ROUND JL_C(0.45)

/* atan(i/16) as a multiple of 2^-21 and the rest. */
static const jl_real cell[STEPS + 1][2] = {
    {JL_C(0.0), JL_C(0.0)},
    {JL_C(0.06241893768310546875), JL_C(-1.2768714812027602e-7)},
    {JL_C(0.124354839324951171875), JL_C(1.5522181026315635e-7)},
    {JL_C(0.185348033905029296875), JL_C(-8.3909334531988974e-8)},
    {JL_C(0.244978427886962890625), JL_C(2.3523990126354708e-7)},
    {JL_C(0.3028850555419921875), JL_C(-1.8716702078193944e-7)},
    {JL_C(0.358770847320556640625), JL_C(-1.7704998442022908e-7)},
    {JL_C(0.412410259246826171875), JL_C(1.8235056113502479e-7)},
    {JL_C(0.4636478424072265625), JL_C(-2.3340642044628574e-7)},
    {JL_C(0.512389659881591796875), JL_C(-1.995708540902084e-7)},
    {JL_C(0.5585994720458984375), JL_C(-1.5670233600152849e-7)},
    {JL_C(0.60228729248046875), JL_C(5.3654495431682123e-8)},
    {JL_C(0.64350128173828125), JL_C(-1.7294499686319719e-7)},
    {JL_C(0.68231678009033203125), JL_C(-2.2521558395299357e-7)},
    {JL_C(0.718830108642578125), JL_C(-1.0902095361958299e-7)},
    {JL_C(0.753151416778564453125), JL_C(-1.3581637006360026e-7)},
    {JL_C(0.785398006439208984375), JL_C(1.5695823932524066e-7)}
};

#define QUARTER_HIGH JL_C(1.570796489715576171875)      /* pi/2 likewise */
#define QUARTER_LOW JL_C(-1.6292067955264368e-7)

#if JL_REAL_FLOAT

#define TINY JL_C(0.0000152587890625)   /* 2^-16: atan r = r */
#define SPLIT JL_C(4097.0)              /* 2^12 + 1 */
#define FAR 60                          /* 2^+-FAR: no digit is lost between */
#define NEARER 80

/* (atan r - r) / r^3 of rr = r^2 */
JL_INLINE jl_real tail(jl_real rr)
{
    return rr * (JL_C(1.0) / 5) - JL_C(1.0) / 3;
}

#else

#define TINY JL_C(9.31322574615478515625e-10)           /* 2^-30 */
#define SPLIT JL_C(134217729.0)                         /* 2^27 + 1 */
#define FAR 500
#define NEARER 600

JL_INLINE jl_real tail(jl_real rr)
{
    return rr * (JL_C(1.0) / 5 - rr * (JL_C(1.0) / 7 - rr * (JL_C(1.0) / 9
        - rr * (JL_C(1.0) / 11)))) - JL_C(1.0) / 3;
}

#endif

/* The upper half of the digits: twice as many hold a product of two halves. */
JL_INLINE jl_real upper(jl_real x)
{
    const jl_real t = x * SPLIT;

    return t - (t - x);
}

/* r = (s - c l) / (l + c s); *rest is what the rounded r lacks of it.  The
 * numerator is exact: c has 5 digits, and the difference is so small that its
 * first digits are 0. */
static jl_real reduced(jl_real *rest, jl_real s, jl_real l, jl_real c)
{
    const jl_real l1 = upper(l), s1 = upper(s);
    const jl_real num = s - c * l1 - c * (l - l1), den = l + c * s;
    const jl_real den_rest = l - den + c * s1 + c * (s - s1);
    const jl_real r = num / den, r1 = upper(r), den1 = upper(den);
    const jl_real lack = num - r1 * den1 - r1 * (den - den1) - (r - r1) * den;

    *rest = (lack - r * den_rest) / den;
    return r;
}

jl_real jl_atan2(jl_real y, jl_real x)
{
    const int left = jli_negative(x), steep = jli_abs(y) > jli_abs(x);
    const int quarters = steep ? 1 : left ? 2 : 0;
    const jl_real sign = steep != left ? -JL_C(1.0) : JL_C(1.0);
    const jl_real *row = cell[0];
    jl_real s = jli_abs(steep ? x : y), l = jli_abs(steep ? y : x);
    jl_real high, low, r, rest = 0, sum;

    if (x != x || y != y)
        return x + y;                   /* NaN */
    if (s >= l) {                       /* also of two zeros or infinities */
        row = cell[l > 0 ? STEPS : 0];
        r = 0;
    } else {
        r = s / l;
        if (r >= TINY) {
            const int i = (int)(r * STEPS + ROUND);

            if (l > jli_pow2(FAR) || l < jli_pow2(-FAR)) {
                const jl_real scale = jli_pow2(l > 1 ? -NEARER : NEARER);

                s *= scale;
                l *= scale;
            }
            row = cell[i];
            r = reduced(&rest, s, l, (jl_real)i / STEPS);
        }
    }
    rest += r * (r * r) * tail(r * r);

    r *= sign;
    high = (jl_real)quarters * QUARTER_HIGH + sign * row[0];
    low = (jl_real)quarters * QUARTER_LOW + sign * (row[1] + rest);
    sum = high + r;
    sum += (high - sum + r) + low;
    return jli_negative(y) ? -sum : sum;
}
