/* Packed symmetric matrices.  A file of their own: every filter needs these. */
#include "jumplink/mat.h"

void jl_mat_pack(jl_real *p, const jl_real *A, int n)
{
    int i, j;

    for (i = 0; i < n; i++)
        for (j = i; j < n; j++)
            *p++ = A[i * n + j];
}

void jl_mat_unpack(jl_real *A, const jl_real *p, int n)
{
    int i, j;

    for (i = 0; i < n; i++)
        for (j = i; j < n; j++) {
            A[i * n + j] = *p;
            A[j * n + i] = *p++;
        }
}
