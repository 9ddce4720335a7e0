/* Matrix operations of run-time size. */
#include "jumplink/mat.h"

#include "mat/mat_k.h"

void jl_mat_mul(jl_real *C, const jl_real *A, const jl_real *B,
                int n, int m, int p)
{
    jli_mul(C, A, B, n, m, p);
}

void jl_mat_mul_t(jl_real *C, const jl_real *A, const jl_real *B,
                  int n, int m, int p)
{
    jli_mul_t(C, A, B, n, m, p);
}

void jl_mat_sandwich(jl_real *C, const jl_real *A, const jl_real *P,
                     const jl_real *Q, jl_real *work, int n, int m)
{
    jli_mul(work, A, P, n, m, m);
    jli_mul_t_sym(C, work, A, Q, n, m);
}

void jl_mat_apply(jl_real *y, const jl_real *A, const jl_real *x,
                  const jl_real *b, int n, int m)
{
    jli_apply(y, A, x, b, n, m);
}

int jl_mat_cholesky(jl_real *L, const jl_real *A, int n)
{
    return jli_cholesky(L, A, n);
}

void jl_mat_cholesky_solve(const jl_real *L, jl_real *X, int n, int m)
{
    jli_lower_solve(L, X, n, m);
    jli_lower_t_solve(L, X, n, m);
}

void jl_mat_lower_solve(const jl_real *L, jl_real *y, int n)
{
    jli_lower_solve(L, y, n, 1);
}
