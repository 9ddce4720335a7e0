/* Estimates that keep a factor of the covariance. */
#include "kf/cov_ud_k.h"

void jli_ud_take(jl_real *S, const jl_real *P, jl_real *scratch, int n)
{
    jl_mat_ud(S, P, scratch, n);
}

static void pool(jl_real *mean, jl_real *S, const jl_real *w,
                 const jl_real *x, const jl_real *Ss, jl_real *scratch,
                 int M, int n)
{
    jli_ud_pool(mean, S, w, x, Ss, scratch, M, n);
}

static void blend(jl_real *x, jl_real *S, jl_real a, const jl_real *x1,
                  const jl_real *S1, jl_real b, const jl_real *x2,
                  const jl_real *S2, jl_real *scratch, int n)
{
    jli_ud_blend(x, S, a, x1, S1, b, x2, S2, scratch, n);
}

/* Element map[i] of row r of Sn, whose 1 and zeros are not stored as such. */
static jl_real element(const jl_real *Sn, int r, int at, int n)
{
    return at > r ? Sn[r * n + at] : (jl_real)(at == r);
}

/* Columns are left out, and the rows made a triangle again. */
void jli_ud_part(jl_real *S, const jl_real *Sn, const int *map,
                 jl_real *scratch, int k, int n)
{
    int r, i;

    memset(S, 0, (size_t)(k * k) * sizeof *S);
    for (r = 0; r < n; r++) {
        for (i = 0; i < k; i++)
            scratch[i] = element(Sn, r, map[i], n);
        jli_ud_absorb(S, scratch, Sn[r * n + r], 0, k);
    }
}

/* Still a triangle, for the map ascends; D of what it leaves out is var. */
void jli_ud_whole(jl_real *Sn, const jl_real *S, const int *map,
                  const jl_real *var, int k, int n)
{
    int i, j;

    memset(Sn, 0, (size_t)(n * n) * sizeof *Sn);
    for (i = 0; i < n; i++)
        Sn[i * (n + 1)] = var[i];
    for (i = 0; i < k; i++)
        for (j = i; j < k; j++)
            Sn[map[i] * n + map[j]] = S[i * k + j];
}

const jl_cov jl_cov_ud = {
    1, jli_ud_take, jl_mat_ud_product, pool, blend, jli_ud_part, jli_ud_whole
};
