/* Factors U' D U of positive semidefinite matrices. */
#include "jumplink/mat.h"

#include "mat/ud_k.h"

/* The largest diagonal element left of B, in units of A's own; -1: none above
 * rounding. */
static int largest(const jl_real *B, const jl_real *diagonal, int n)
{
    jl_real most = 64 * (jl_real)n * JL_EPSILON;
    int i, best = -1;

    for (i = 0; i < n; i++)
        if (diagonal[i] > 0 && B[i * (n + 1)] / diagonal[i] > most) {
            most = B[i * (n + 1)] / diagonal[i];
            best = i;
        }
    return best;
}

/* By rows in the order of pivots, for small pivots taken early would magnify
 * rounding; each row goes into the triangle, which keeps the order of states.
 * Of what is left the diagonal: as zeros, it would claim to be known. */
void jl_mat_ud(jl_real *S, const jl_real *A, jl_real *work, int n)
{
    jl_real *B = work, *diagonal = B + n * n, *v = diagonal + n;
    int i, j, b, left;

    for (i = 0; i < n; i++) {
        diagonal[i] = A[i * (n + 1)];
        for (j = i; j < n; j++)
            B[i * n + j] = B[j * n + i] = A[i * n + j];
    }
    memset(S, 0, (size_t)(n * n) * sizeof *S);
    for (left = n; left > 0; left--) {
        jl_real d;

        b = largest(B, diagonal, n);
        if (b < 0)
            break;
        d = B[b * (n + 1)];
        for (j = 0; j < n; j++)
            v[j] = B[b * n + j] / d;
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                B[i * n + j] -= d * v[i] * v[j];
        for (i = 0; i < n; i++)
            B[i * n + b] = B[b * n + i] = 0;
        jli_ud_absorb(S, v, d, 0, n);
    }
    for (i = 0; left > 0 && i < n; i++)
        if (B[i * (n + 1)] > 0) {
            memset(v, 0, (size_t)n * sizeof *v);
            v[i] = 1;
            jli_ud_absorb(S, v, B[i * (n + 1)], i, n);
        }
}

void jl_mat_ud_product(jl_real *P, const jl_real *S, int n)
{
    jli_ud_product(P, S, n);
}
