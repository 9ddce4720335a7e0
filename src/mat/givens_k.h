/* Kernel of triangularisation by Givens rotations, with the sizes as last
 * arguments.  The contract is mat.h's. */
#ifndef JL_GIVENS_K_H
#define JL_GIVENS_K_H

#include "base/mathx.h"
#include "jumplink/mat.h"

/* Below this a sum of squares may have lost digits to underflow, and a tiny
 * number times JLI_MAGNIFY has a normal square. */
#define JLI_FEW (JL_REAL_MIN / JL_EPSILON)
#define JLI_MAGNIFY (JL_EPSILON / JL_REAL_MIN)

/* |(r, x)| of tiny numbers; *c, *s as in jli_givens_some. */
JL_INLINE jl_real jli_tiny_rotation(jl_real *c, jl_real *s, jl_real r,
                                    jl_real x)
{
    jl_real length;

    r *= JLI_MAGNIFY;
    x *= JLI_MAGNIFY;
    length = jli_sqrt(r * r + x * x);
    *c = r / length;
    *s = x / length;
    return length / JLI_MAGNIFY;
}

/* The first `pivots` columns, and down each: what a row meets, and in which
 * order, is what it meets in a triangle of cells that is fed row by row
 * (Gentleman, Kung 1981, Matrix Triangularization by Systolic Arrays).  So the
 * first pivots, and then the others on the rows and columns that are left, give
 * the bits of all at once.
 * A rotation takes (r, x) to (r', 0): c = r / r', s = x / r'.  r'^2 is kept
 * beside r', so that the next rotation's root need not wait for this one's. */
JL_INLINE void jli_givens_some(jl_real *A, int pivots, int rows, int cols)
{
    int i, j, k;

    for (j = 0; j < pivots; j++) {
        jl_real *top = A + j * cols;
        jl_real r = top[j], sum = r * r;

        for (i = j + 1; i < rows; i++) {
            jl_real *row = A + i * cols, x = row[j], length, c, s;

            if (x == 0)
                continue;
            sum += x * x;
            if (sum < JLI_FEW) {
                length = jli_tiny_rotation(&c, &s, r, x);
                sum = length * length;
            } else {
                length = jli_sqrt(sum);
                s = 1 / length;
                c = r * s;
                s *= x;
            }
            r = length;
            row[j] = 0;
            for (k = j + 1; k < cols; k++) {
                jl_real t = top[k], y = row[k];

                top[k] = c * t + s * y;
                row[k] = c * y - s * t;
            }
        }
        top[j] = r;
        if (r < 0)
            for (k = j; k < cols; k++)
                top[k] = -top[k];
    }
}

JL_INLINE void jli_givens(jl_real *A, int rows, int cols)
{
    jli_givens_some(A, rows < cols ? rows : cols, rows, cols);
}

#endif
