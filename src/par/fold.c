/* The folded MEKF: set up, and a step. */
#include "par/fold_parts.h"

#include "mat/mat_k.h"

/* --- borders -------------------------------------------------------------- */

void jl_fold_deal(int *rows, int npe, const jl_mekf_model *model)
{
    int n = model->n, r = model->r, N = r + n + model->m, j, pe = 0;
    int R = N + model->p1 + model->p2, R1 = r + n + model->p1;
    long sum = 0, total = 0;

    for (j = 0; j < N; j++)
        total += (long)(R - j) * (N - j)
            + (j < r + n ? (long)(R1 - j) * (r + n - j) : 0);
    for (j = 0; j < N; j++) {
        while (pe < npe && sum >= total / npe * pe)
            rows[pe++] = j;
        sum += (long)(R - j) * (N - j)
            + (j < r + n ? (long)(R1 - j) * (r + n - j) : 0);
    }
    while (pe <= npe)
        rows[pe++] = N;
}

int jli_fold_border(const jl_fold *fold, const struct jli_array *a, int i,
                    int pe)
{
    int b = fold->config.rows[pe] - (fold->filter->model->r - a->r);

    if (b < 0)
        return 0;
    return i == 1 && b > a->r + a->n ? a->r + a->n : b;
}

void jli_fold_states(const jl_fold *fold, int pe, int *first, int *end)
{
    int r = fold->filter->model->r;

    *first = fold->config.rows[pe] - r;
    *end = fold->config.rows[pe + 1] - r;
    if (*first < 0)
        *first = 0;
    if (*end < 0)
        *end = 0;
}

/* --- setting up ----------------------------------------------------------- */

static int borders_fit(const jl_fold_config *c, int rows)
{
    int pe;

    for (pe = 0; pe < c->npe; pe++)
        if (c->rows[pe] > c->rows[pe + 1])
            return 0;
    return c->rows[0] == 0 && c->rows[c->npe] == rows;
}

static int channels_hold(const jl_fold_config *c, int need)
{
    return (c->pe == 0 || (c->to_prev->max_len >= need
                           && c->from_prev->max_len >= need))
        && (c->pe == c->npe - 1 || (c->to_next->max_len >= need
                                    && c->from_next->max_len >= need));
}

int jl_fold_init(jl_fold *fold, jl_mekf *filter, const jl_fold_config *config,
                 unsigned char *buf, int cap)
{
    const jl_mekf_model *model = filter->model;
    int need = JL_FOLD_MSG(model->n, model->m, model->r, model->p1,
                           model->p2);

    if (config->npe < 1 || config->npe > JL_MAX_PES || config->pe < 0
        || config->pe >= config->npe
        || !borders_fit(config, model->r + model->n + model->m))
        return JL_EDIM;
    if (cap < 2 * need)
        return JL_ENOMEM;
    if (!channels_hold(config, need))
        return JL_ETOOLONG;
    memset(fold, 0, sizeof *fold);
    fold->config = *config;
    fold->filter = filter;
    fold->buf = buf;
    fold->cap = cap;
    return JL_OK;
}

/* --- a step --------------------------------------------------------------- */

/* As jl_mekf_step lays its scratch out, and S, nu of B behind. */
static int linearise(const jl_fold *fold, struct jli_folded *w,
                     const jl_real *z, jl_real *scratch)
{
    const jl_mekf *f = fold->filter;
    const jl_mekf_model *model = f->model;
    int n = model->n, m = model->m, r = model->r, status;
    jl_real *xh, *S;

    w->mem[0] = scratch;
    w->mem[1] = scratch + JL_MEKF_ARRAY(n, m, r, model->p1, model->p2);
    xh = w->mem[1] + JL_MEKF_ARRAY_B(n, m, r, model->p1);
    w->cc = xh + n;
    S = w->cc + r * n;
    status = jli_mekf_linearise(&w->l, S + 3 * r, model, f->xhat, f->x, z,
                                scratch);
    w->feed[0].S = S;
    w->feed[0].nu = w->l.nu;
    w->feed[0].x = w->l.xp;
    w->feed[1].S = S + r;
    w->feed[1].nu = S + 2 * r;
    w->feed[1].x = xh;
    return status;
}

static void commit(jl_fold *fold, struct jli_folded *w)
{
    jl_mekf *f = fold->filter;

    jli_copy(f->x, w->feed[0].x, w->array[0].n);
    jli_copy(f->xhat, w->feed[1].x, w->array[1].n);
    jli_array_take(f->U, &w->array[0], jli_fold_own_rows(fold, w, 0));
    jli_array_take(f->U1, &w->array[1], jli_fold_own_rows(fold, w, 1));
}

static int step(jl_fold *fold, const jl_real *z, jl_real *scratch)
{
    struct jli_folded w;
    int pe = fold->config.pe, status, verdict = JL_OK;

    fold->seq++;
    memset(&w, 0, sizeof w);
    status = linearise(fold, &w, pe == 0 ? z : NULL, scratch);
    jli_fold_shape(&w, fold, fold->filter->model->r);
    status = pe == 0 ? jli_fold_begin(fold, &w, z, status)
        : jli_fold_pass_products(fold, &w, status);
    if (status == JL_OK)
        status = jli_fold_round(fold, &w, 1, &verdict);
    if (status == JL_OK && verdict == JL_OK && (w.which & JLI_MORE)) {
        w.which = JLI_B | JLI_MEASURED;
        if (pe == 0)
            w.status[1] = jli_fold_choose(fold, &w, z);
        status = jli_fold_round(fold, &w, 0, &verdict);
    }
    if (status != JL_OK || verdict != JL_OK)
        return status != JL_OK ? status : verdict;
    commit(fold, &w);
    return JL_OK;
}

int jl_fold_step(jl_fold *fold, const jl_real *z, jl_real *scratch)
{
    int status;

    if (fold->failed != JL_OK)
        return fold->failed;
    status = step(fold, z, scratch);
    if (fold->failed != JL_OK)
        jli_fold_tell_fault(fold);
    return status;
}

int jl_fold_stop(jl_fold *fold)
{
    int status, len, theirs;

    if (fold->failed != JL_OK)
        return fold->failed;
    fold->seq++;
    status = jli_fold_receive(fold, &theirs, &len);
    if (status == JL_OK)
        status = jli_fold_pass_stop(fold);
    if (fold->failed != JL_OK)
        jli_fold_tell_fault(fold);
    return status;
}
