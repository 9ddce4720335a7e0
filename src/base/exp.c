/* e^x = 2^k * 2^(j/16) * e^r, where x = (16 k + j) ln2/16 + r and |r| < 0.0217:
 * Cody and Waite's reduction (Software Manual for the Elementary Functions,
 * 1980) and Tang's table (ACM TOMS 15, 1989), both cut to fit.
 *
 * Error in ulp of the result, before the last rounding's 0.5:
 *   Taylor's remainder, r^8/8! (float r^5/5!)               0.006 (float 0.001)
 *   r, and e^r - 1 = r + r^2 (1/2 + ...), rounded           0.03
 *   2^(j/16) (e^r - 1) and its sum with the low part        0.04
 * Measured: 0.565 (every float: 0.558).  A denormal result is rounded twice,
 * but the first time to a finer number; measured: 0.76.
 */
#include "jumplink/base.h"
#include "ieee.h"

#define STEPS 16

/* 2^(j/16) as a number of 24 bits and the rest. */
static const jl_real power[STEPS][2] = {
    {JL_C(1.0), JL_C(0.0)},
    {JL_C(1.04427373409271240234375), JL_C(4.8334701437978216e-8)},
    {JL_C(1.0905077457427978515625), JL_C(-1.3077540192355489e-8)},
    {JL_C(1.13878858089447021484375), JL_C(5.386222143886008e-8)},
    {JL_C(1.1892070770263671875), JL_C(3.79763538792175e-8)},
    {JL_C(1.2418577671051025390625), JL_C(4.4968381509531177e-8)},
    {JL_C(1.29683959484100341796875), JL_C(-4.0189993752034996e-8)},
    {JL_C(1.35425555706024169921875), JL_C(-1.0123348970920735e-8)},
    {JL_C(1.41421353816986083984375), JL_C(2.4203234208957939e-8)},
    {JL_C(1.476826190948486328125), JL_C(-4.5008987016738093e-8)},
    {JL_C(1.5422108173370361328125), JL_C(8.0709046907997919e-9)},
    {JL_C(1.610490322113037109375), JL_C(9.8362171988045207e-9)},
    {JL_C(1.68179285526275634765625), JL_C(-2.4755327261593999e-8)},
    {JL_C(1.75625216960906982421875), JL_C(-9.2357703411065894e-9)},
    {JL_C(1.83400809764862060546875), JL_C(-1.1239278141981667e-8)},
    {JL_C(1.91520655155181884765625), JL_C(9.8453284462163613e-9)}
};

#define STEPS_PER_UNIT JL_C(23.083120654223415)         /* 16 / ln2 */

#if JL_REAL_FLOAT

#define LOWEST JL_C(-104.0)             /* below it e^x < 2^-150 becomes 0 */
#define HIGHEST JL_C(89.0)              /* above it e^x > 2^128 */
#define BIAS 151                        /* makes k positive */
#define LEAST_K (FLT_MIN_EXP - 1)       /* 2^k is normal */
#define MOST_K (FLT_MAX_EXP - 1)

/* ln2/16: 12 bits, so that a step number of 12 bits times it is exact; rest. */
#define STEP_HIGH JL_C(0.0433197021484375)
#define STEP_LOW JL_C(1.99663646e-6)

/* (e^r - 1 - r) / r^2 */
JL_INLINE jl_real tail(jl_real r)
{
    return JL_C(1.0) / 2 + r * (JL_C(1.0) / 6 + r * (JL_C(1.0) / 24));
}

#else

#define LOWEST JL_C(-746.0)             /* 2^-1075 */
#define HIGHEST JL_C(710.0)             /* 2^1024 */
#define BIAS 1077
#define LEAST_K (DBL_MIN_EXP - 1)
#define MOST_K (DBL_MAX_EXP - 1)

/* ln2/16: 37 bits, for step numbers of 15 bits, and the rest. */
#define STEP_HIGH JL_C(0.0433216987848936696536839008331298828125)
#define STEP_LOW JL_C(1.0291218489310676e-13)

JL_INLINE jl_real tail(jl_real r)
{
    const jl_real rr = r * r;

    return ((JL_C(1.0) / 2 + r * (JL_C(1.0) / 6))
        + rr * (JL_C(1.0) / 24 + r * (JL_C(1.0) / 120)))
        + rr * rr * (JL_C(1.0) / 720 + r * (JL_C(1.0) / 5040));
}

#endif

jl_real jl_exp(jl_real x)
{
    const jl_real bias = JLI_WHOLE + STEPS * BIAS;
    jl_real n, r, y;
    jl_u32 step;
    int j, k;

    if (x < LOWEST)
        return 0;
    if (!(x <= HIGHEST))
        return x * JL_REAL_MAX;         /* infinity, or NaN */

    n = x * STEPS_PER_UNIT + bias;
    step = jli_integer(n);
    n -= bias;
    j = (int)(step & (STEPS - 1));
    k = (int)(step / STEPS) - BIAS;

    r = (x - n * STEP_HIGH) - n * STEP_LOW;
    r = r + r * r * tail(r);
    y = power[j][0] + (power[j][1] + (power[j][0] + power[j][1]) * r);

    /* 2^k itself may be too large or too small; of its two halves the first
     * changes no digit of y, so that a denormal result is rounded once here. */
    if (k >= LEAST_K && k <= MOST_K)
        return y * jli_pow2(k);
    return y * jli_pow2(k / 2) * jli_pow2(k - k / 2);
}
