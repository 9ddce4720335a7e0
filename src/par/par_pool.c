/* The all-reduce: one estimate a PE, for sticky chains. */
#include "par/par_parts.h"

#include "imm/imm_stage.h"
#include "mat/mat_k.h"

/* Into (x, P) of weight *sum, another (xj, Pj) of weight w: with a = sum / (sum
 * + w), b = w / (sum + w), d = xj - x
 *     x += b d,  P = a P + b Pj + a b d d'
 * Centred: no difference of second moments is ever formed. */
static void merge(jl_real *x, jl_real *P, jl_real *sum, const jl_real *xj,
                  const jl_real *Pj, jl_real w, int n)
{
    jl_real a, b;
    int r, s;

    if (!(w > 0))
        return;
    a = *sum / (*sum + w);
    b = w / (*sum + w);
    for (r = 0; r < n; r++)
        for (s = r; s < n; s++) {
            P[r * n + s] = a * P[r * n + s] + b * Pj[r * n + s]
                + a * b * ((xj[r] - x[r]) * (xj[s] - x[s]));
            P[s * n + r] = P[r * n + s];
        }
    for (r = 0; r < n; r++)
        x[r] += b * (xj[r] - x[r]);
    *sum += w;
}

static int first_mode(const jl_par *par, int pe)
{
    int j = 0;

    while (par->config.owner[j] != pe)
        j++;
    return j;
}

static int is_own(const jl_par *par, int j)
{
    return par->config.owner[j] == par->config.pe;
}

void jli_pool_own(jl_par *par)
{
    jl_imm *imm = par->imm;
    int j, n = imm->n;
    jl_real *x = par->pool, *P = x + n, best = -JL_REAL_MAX, sum = 0, unused;

    for (j = 0; j < imm->M; j++)
        if (is_own(par, j) && imm->l[j] > best)
            best = imm->l[j];
    for (j = 0; j < imm->M; j++)        /* log 0 of the others */
        imm->e[j] = is_own(par, j) ? imm->logc[j] + (imm->l[j] - best)
            : jl_log(0);
    (void)jli_log_sum_exp(imm->e, imm->M, &unused);
    memset(x, 0, (size_t)(n + n * n) * sizeof *x);
    for (j = 0; j < imm->M; j++)
        if (is_own(par, j))
            merge(x, P, &sum, imm->xw + j * n, imm->Pw + j * n * n, imm->e[j],
                  n);
}

void jli_pool_merge(jl_par *par)
{
    jl_imm *imm = par->imm;
    int pe, j, n = imm->n;
    jl_real sum = 0;

    memset(imm->xhat, 0, (size_t)n * sizeof *imm->xhat);
    memset(imm->Phat, 0, (size_t)(n * n) * sizeof *imm->Phat);
    for (pe = 0; pe < par->active; pe++) {
        const jl_real *x = par->pool, *P = x + n;
        jl_real w = 0;

        if (pe != par->config.pe) {
            x = imm->x + first_mode(par, pe) * n;
            P = imm->P + first_mode(par, pe) * n * n;
        }
        for (j = 0; j < imm->M; j++)
            if (par->config.owner[j] == pe)
                w += imm->mu[j];
        merge(imm->xhat, imm->Phat, &sum, x, P, w, n);
    }
    imm->combined = 1;
}
