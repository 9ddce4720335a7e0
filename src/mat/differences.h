/* Derivatives of functions that have none of their own. */
#ifndef JL_DIFFERENCES_H
#define JL_DIFFERENCES_H

#include "jumplink/mat.h"

#if JL_REAL_FLOAT
#define jli_checked jli_checked_f32
#define jli_differences jli_differences_f32
#endif

typedef int (*jli_function)(jl_real *y, const jl_real *x, void *context);
typedef void (*jli_residual)(jl_real *d, const jl_real *a, const jl_real *b,
                             void *context);

/* What a function of the user's returned, and v [n], what it computed: JL_OK,
 * its code, or JL_ENONFINITE.  Nothing that keeps factors must ever see what is
 * not finite. */
int jli_checked(int status, const jl_real *v, int n);

/* J [rows,n] of a function at x [n], by central differences; residual tells
 * what they are, NULL: plain ones.  scratch [n + 2 rows]
 * Returns as jli_checked. */
int jli_differences(jl_real *J, jli_function of, jli_residual residual,
                    void *context, const jl_real *x, jl_real *scratch,
                    int rows, int n);

#endif
