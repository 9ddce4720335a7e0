/* Modes of different states. */
#include "imm/imm_stage.h"

#include "mat/mat_k.h"

/* Mode j's map, or the identity's. */
static int place_of(const jl_imm *imm, int j, int i)
{
    return imm->map[j] != NULL ? imm->map[j][i] : i;
}

void jli_own_states(jl_real *own_x, jl_real *own_P, const jl_imm *imm, int j,
                    const jl_real *x, const jl_real *P, jl_real *scratch)
{
    int n = imm->n, k = imm->modes[j].n, i;

    for (i = 0; i < k; i++)
        own_x[i] = x[place_of(imm, j, i)];
    if (imm->map[j] != NULL)
        imm->form->cov->part(own_P, P, imm->map[j], scratch, k, n);
    else
        jli_copy(own_P, P, n * n);
}

void jli_all_states(jl_real *x, jl_real *P, const jl_imm *imm, int j,
                    const jl_real *own_x, const jl_real *own_P)
{
    int n = imm->n, k = imm->modes[j].n, i;

    jli_copy(x, imm->prior_x, n);
    for (i = 0; i < k; i++)
        x[place_of(imm, j, i)] = own_x[i];
    if (imm->map[j] != NULL)
        imm->form->cov->whole(P, own_P, imm->map[j], imm->prior_var, k, n);
    else
        jli_copy(P, own_P, n * n);
}
