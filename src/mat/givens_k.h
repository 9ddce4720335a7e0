/* Kernel of triangularisation by Givens rotations, with the sizes as last
 * arguments.  The contract is mat.h's. */
#ifndef JL_GIVENS_K_H
#define JL_GIVENS_K_H

#include "base/mathx.h"
#include "jumplink/mat.h"

/* Two tiny numbers times this, a power of two, have squares that are normal. */
#define JLI_MAGNIFY (JL_EPSILON / JL_REAL_MIN)

/* The rotation that takes (r, x), x not 0, to (r', 0), r' > 0: c = r / r',
 * s = x / r'.  Returns r'. */
JL_INLINE jl_real jli_rotation(jl_real *c, jl_real *s, jl_real r, jl_real x)
{
    jl_real sum = r * r + x * x, scale = 1, length;

    if (sum < 1 / JLI_MAGNIFY) {
        scale = JLI_MAGNIFY;
        r *= scale;
        x *= scale;
        sum = r * r + x * x;
    }
    length = jli_sqrt(sum);
    *c = r / length;
    *s = x / length;
    return length / scale;
}

/* Column by column, and down each: what a row meets, and in which order, is
 * what it meets in a triangle of cells that is fed row by row (Gentleman, Kung
 * 1981, Matrix Triangularization by Systolic Arrays). */
JL_INLINE void jli_givens(jl_real *A, int rows, int cols)
{
    int i, j, k;

    for (j = 0; j < rows && j < cols; j++) {
        jl_real *top = A + j * cols;

        for (i = j + 1; i < rows; i++) {
            jl_real *row = A + i * cols, c, s;

            if (row[j] == 0)
                continue;
            top[j] = jli_rotation(&c, &s, top[j], row[j]);
            row[j] = 0;
            for (k = j + 1; k < cols; k++) {
                jl_real r = top[k], x = row[k];

                top[k] = c * r + s * x;
                row[k] = c * x - s * r;
            }
        }
        if (top[j] < 0)
            for (k = j; k < cols; k++)
                top[k] = -top[k];
    }
}

#endif
