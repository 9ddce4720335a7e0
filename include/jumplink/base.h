/* The words everything else uses: number type, status codes, assertions, and
 * elementary functions whose bits are the same on every machine. */
#ifndef JL_BASE_H
#define JL_BASE_H

#include <float.h>
#include <limits.h>
#include <stddef.h>

#include "config.h"
#include "names.h"

/* --- numbers ----------------------------------------------------------- */

#ifdef JL_REAL_FILE
#include JL_REAL_FILE
#elif JL_REAL_FLOAT
typedef float jl_real;
#define JL_C(x) x##f                    /* a constant of type jl_real */
#define JL_EPSILON FLT_EPSILON
#define JL_REAL_MIN FLT_MIN
#define JL_REAL_MAX FLT_MAX
#define JL_LARGE JL_C(1.0e18)
#else
typedef double jl_real;
#define JL_C(x) x
#define JL_EPSILON DBL_EPSILON
#define JL_REAL_MIN DBL_MIN
#define JL_REAL_MAX DBL_MAX
#define JL_LARGE JL_C(1.0e150)
#endif
/* JL_LARGE: the largest magnitude a state component may have, and its square
 * the largest a covariance may have: so the sums of squares in mixing and
 * combining cannot overflow, and those stages cannot fail. */

#ifdef __cplusplus
extern "C" {
#endif

/* At least 32 bits; the library keeps values below 2^32 in it. */
#if UINT_MAX >= 4294967295UL
typedef unsigned int jl_u32;
#else
typedef unsigned long jl_u32;
#endif

/* --- status ------------------------------------------------------------ */

/* 0 is success; a failure is negative and keeps its number for ever. */
enum {
    JL_OK = 0,
    JL_EDIM = -1,       /* a size out of range; sizes that do not fit       */
    JL_ENOMEM = -2,     /* the caller's array is too small                  */
    JL_ENONFINITE = -3, /* NaN, infinity, or beyond JL_LARGE: given, or met */
    JL_EASYM = -4,      /* a covariance that is not symmetric               */
    JL_EDEF = -5,       /* ... or not positive (semi)definite               */
    JL_EPROB = -6,      /* probabilities below 0, or not summing to 1       */
    JL_ESINGULAR = -7,  /* the innovation covariance S is not positive      */
    JL_ERANGE = -8,     /* an argument outside the function's domain        */
    JL_EORDER = -9,     /* a call out of order: filter before mix           */
    JL_ETIME = -10,     /* a time that goes back                            */
    JL_ETIMEOUT = -11,  /* nothing happened before the deadline             */
    JL_ECLOSED = -12,   /* the other end of the channel has closed          */
    JL_ETOOLONG = -13,  /* a message longer than the channel or the buffer  */
    JL_EDEADLOCK = -14, /* everybody waits for everybody (port loop)        */
    JL_EPEER = -15,     /* the other end restarted, or is not who it was    */
    JL_EIO = -16,       /* the carrier failed                               */
    JL_EAGAIN = -17,    /* nothing there yet, or no room yet: try later     */
    JL_EMAGIC = -18,    /* octets that are not a frame                      */
    JL_EVERSION = -19,  /* a frame of another version                       */
    JL_ENUMBER = -20,   /* a frame with numbers of another type             */
    JL_ELENGTH = -21,   /* a frame or message of the wrong length           */
    JL_ECRC = -22,      /* a frame damaged on its way                       */
    JL_EMSG = -23,      /* a message that does not belong here              */
    JL_EMODEL = -24,    /* the PEs were given different models              */
    JL_ESILENT = -25,   /* the other end has not been heard for too long    */
    JL_ECHAIN = -26,    /* a chain that an all-reduce cannot serve          */
    JL_EGATE = -27      /* ... or a gate                                    */
};

/* What a code means, in words: "innovation covariance S is not positive
 * definite".  Never NULL; an unknown code is "unknown status". */
const char *jl_status_text(int status);

/* --- assertions -------------------------------------------------------- */

/* Programming errors that no input can cause.  Off unless defined. */
#ifndef JL_ASSERT
#define JL_ASSERT(condition) ((void)0)
#endif

/* A declaration that compiles only if the constant condition holds. */
#define JL_STATIC_ASSERT(condition, name) \
    typedef char jl_static_assert_##name[(condition) ? 1 : -1]

/* --- elementary functions ---------------------------------------------- */

/* C libraries differ in the last bit; these are plain arithmetic, the same
 * bits wherever jl_real is an IEEE number with gradual underflow and the
 * compiler neither contracts nor reorders (-ffp-contract=off, no -ffast-math)
 * nor keeps excess precision (32-bit x86: -msse2 -mfpmath=sse). */

/* e^x, at most 1 ulp off.  Gradual underflow to 0; overflow to infinity;
 * NaN for NaN. */
jl_real jl_exp(jl_real x);

/* The natural logarithm, at most 1 ulp off, of any x >= 0, denormal numbers
 * included; -infinity for 0; NaN for x < 0 and for NaN. */
jl_real jl_log(jl_real x);

/* *s = sin x, *c = cos x for |x| <= 1024 [rad]: at most 1 ulp off, or an
 * absolute 2^-53 (float: 2^-24), whichever is more.
 * Returns JL_OK, or JL_ERANGE for any other x: *s and *c are untouched. */
int jl_sincos(jl_real *s, jl_real *c, jl_real x);

/* The angle [rad] of the vector (x, y), from -pi to pi, at most 1 ulp off.
 * All cases of C99's atan2 (F.9.1.4): a zero's sign counts, so (0, -1) is at
 * pi and (-0, -1) at -pi; two zeros are taken as x = +-1, y = +-0; an infinity
 * is infinitely further than any number and as far as another; NaN for NaN. */
jl_real jl_atan2(jl_real y, jl_real x);

/* The square root, exactly rounded: the C library's, for jl_real (C89's math.h
 * has none for float).  NaN for x < 0 and for NaN. */
jl_real jl_sqrt(jl_real x);

#ifdef __cplusplus
}
#endif
#endif
