/* The all-reduce: one estimate a PE, for sticky chains. */
#include "par/par_parts.h"

#include "imm/imm_stage.h"
#include "mat/mat_k.h"

/* Into (x, P) of weight *sum, another (xj, Pj) of weight w.  Centred: no
 * difference of second moments is ever formed.  imm->d is work. */
static void merge(const jl_imm *imm, jl_real *x, jl_real *P, jl_real *sum,
                  const jl_real *xj, const jl_real *Pj, jl_real w)
{
    jl_real all = *sum + w;

    if (!(w > 0))
        return;
    imm->form->cov->blend(x, P, *sum / all, x, P, w / all, xj, Pj, imm->d,
                          imm->n);
    *sum = all;
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
    jl_real *x = par->pool, *P = x + n, sum = 0, best, all;

    (void)jli_weights(imm, par->config.owner, par->config.pe, &best, &all);
    memset(x, 0, (size_t)(n + n * n) * sizeof *x);
    for (j = 0; j < imm->M; j++)
        if (is_own(par, j))
            merge(imm, x, P, &sum, imm->xw + j * n, imm->Pw + j * n * n,
                  imm->e[j]);
}

void jli_pool_merge(jl_par *par)
{
    jl_imm *imm = par->imm;
    int pe, j, n = imm->n;
    jl_real sum = 0;

    memset(imm->xhat, 0, (size_t)n * sizeof *imm->xhat);
    memset(imm->Shat, 0, (size_t)(n * n) * sizeof *imm->Shat);
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
        merge(imm, imm->xhat, imm->Shat, &sum, x, P, w);
    }
    if (imm->form->cov->factored)
        imm->form->cov->give(imm->Phat, imm->Shat, n);
    imm->combined = 1;
}
