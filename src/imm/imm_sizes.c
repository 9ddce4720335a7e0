/* Modes of different states. */
#include "imm/imm_stage.h"

#include "mat/mat_k.h"

/* --- what init is given -------------------------------------------------- */

/* A map has the components of its mode in order; NULL: all of them. */
static int map_fits(const int *map, int k, int n)
{
    int i;

    if (map == NULL)
        return k == n;
    for (i = 0; i < k; i++)
        if (map[i] <= (i > 0 ? map[i - 1] : -1) || map[i] >= n)
            return 0;
    return 1;
}

static int has(const jl_mode *mode, const int *map, int n, int component)
{
    int i;

    for (i = 0; mode->n < n && i < mode->n; i++)
        if (map[i] == component)
            return 1;
    return mode->n == n;
}

static int check_prior(jl_real x, jl_real var)
{
    if (!jl_vec_within(&x, 1, JL_LARGE)
        || !jl_vec_within(&var, 1, JL_LARGE * JL_LARGE))
        return JL_ENONFINITE;
    return var > 0 ? JL_OK : JL_ERANGE;
}

int jli_check_sizes(int M, int n, const jl_mode *modes,
                    const int *const *map, const jl_real *prior_x,
                    const jl_real *prior_var, const jl_kf_form *form)
{
    int i, j, status = JL_OK;

    if (form->n != 0 && (form->n != n || form->m != modes[0].m))
        return JL_EDIM;
    for (j = 0; j < M; j++)
        if (modes[j].m != modes[0].m
            || (modes[j].n < n && form->n != 0)
            || !map_fits(map != NULL ? map[j] : NULL, modes[j].n, n))
            return JL_EDIM;
    for (i = 0; i < n && status == JL_OK; i++) {
        int count = 0;

        for (j = 0; j < M; j++)
            count += has(&modes[j], map != NULL ? map[j] : NULL, n, i);
        if (count == 0)
            return JL_EDIM;
        if (count < M)
            status = check_prior(prior_x[i], prior_var[i]);
    }
    return status;
}

/* --- there and back ------------------------------------------------------ */

void jli_own_states(jl_real *own_x, jl_real *own_P, const jl_imm *imm, int j,
                    const jl_real *x, const jl_real *P, jl_real *scratch)
{
    const int *map = imm->map[j];
    int k = imm->modes[j].n, i;

    for (i = 0; i < k; i++)
        own_x[i] = x[map[i]];
    imm->form->cov->part(own_P, P, map, scratch, k, imm->n);
}

void jli_all_states(jl_real *x, jl_real *P, const jl_imm *imm, int j,
                    const jl_real *own_x, const jl_real *own_P)
{
    const int *map = imm->map[j];
    int k = imm->modes[j].n, i;

    jli_copy(x, imm->prior_x, imm->n);
    for (i = 0; i < k; i++)
        x[map[i]] = own_x[i];
    imm->form->cov->whole(P, own_P, map, imm->prior_var, k, imm->n);
}
