/* What the library needs of math.h: the square root, which is exact, and two
 * questions that C89 has no word for. */
#ifndef JL_MATHX_H
#define JL_MATHX_H

#include <math.h>

#include "cc.h"
#include "jumplink/base.h"

#if JL_REAL_FLOAT
/* C89's math.h has no float functions, but every C library does. */
extern float sqrtf(float x);
#define jli_sqrt sqrtf
#else
#define jli_sqrt sqrt
#endif

JL_INLINE jl_real jli_abs(jl_real x)
{
    return x < 0 ? -x : x;
}

/* 0 for NaN and for infinity; holds without isfinite. */
JL_INLINE int jli_finite(jl_real x)
{
    return x >= -JL_REAL_MAX && x <= JL_REAL_MAX;
}

#endif
