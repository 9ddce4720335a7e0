/* Triangles by Givens rotations. */
#include "jumplink/mat.h"

#include "mat/givens_k.h"

void jl_mat_givens(jl_real *A, int rows, int cols)
{
    jli_givens(A, rows, cols);
}
