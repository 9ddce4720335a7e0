/* The phases of a step of the folded MEKF: products up, QR and Faddeev down,
 * the verdict up. */
#include "par/fold_parts.h"

#include "mat/mat_k.h"

/* --- up: the products ----------------------------------------------------- */

static int is_last(const jl_fold *fold)
{
    return fold->config.pe == fold->config.npe - 1;
}

int jli_fold_receive(jl_fold *fold, int *status, int *len)
{
    const jl_fold_config *c = &fold->config;
    int bad;

    *len = 0;
    *status = JL_OK;
    if (is_last(fold))
        return JL_OK;
    *len = jli_fold_recv(fold, c->pe + 1, c->timeout_us, c->npe - 2 - c->pe);
    if (*len < 0)
        return *len;
    bad = jli_fold_products_read(status, fold, *len);
    return bad == JL_OK ? JL_OK : jli_fold_fault(fold, c->pe + 1, bad);
}

/* PE0: the whole arrays, but for what needs c of B. */
static void fill(const jl_fold *fold, struct jli_folded *w, int r, int len)
{
    const jl_mekf *f = fold->filter;
    const jl_mekf_model *model = f->model;
    int n = model->n, p1 = model->p1, p = p1 + model->p2, i;

    jli_fold_shape(w, fold, r);
    for (i = 0; i < 2; i++) {
        struct jli_array *a = &w->array[i];

        jli_array_start(a, w->mem[i], f->UR, a->n, r, a->rows);
        jli_array_products(jli_array_row(a, r + a->n), r + a->n, f->UQ, p,
                           w->l.G, p, i == 0 ? p : p1, a->n,
                           i == 0 ? p : p1);
        memset(w->feed[i].S, 0, (size_t)r * sizeof *w->feed[i].S);
    }
    jli_copy(w->feed[1].x, w->l.xp, n);
    jli_fold_products_take(fold, w, len);
}

int jli_fold_choose(const jl_fold *fold, struct jli_folded *w,
                    const jl_real *z)
{
    const jl_mekf_model *model = fold->filter->model;
    int status = JL_OK;

    if (z != NULL)
        status = jli_mekf_choose(w->cc, fold->filter, &w->l, w->feed[0].x);
    if (status != JL_OK)
        return status;
    if (z != NULL)
        jli_mekf_innovate(w->feed[1].nu, z, w->cc, w->feed[1].x, model->n,
                          model->r);
    return jli_array_sense(&w->array[1], w->cc);
}

int jli_fold_begin(jl_fold *fold, struct jli_folded *w, const jl_real *z,
                   int status)
{
    int r = z != NULL ? fold->filter->model->r : 0, len, theirs;
    int failed = jli_fold_receive(fold, &theirs, &len);

    if (failed != JL_OK)
        return failed;
    w->which = z == NULL ? JLI_A | JLI_B
        : fold->filter->c == JL_MEKF_FILT ? JLI_A | JLI_MEASURED | JLI_MORE
        : JLI_A | JLI_B | JLI_MEASURED;
    w->status[0] = status != JL_OK ? status : theirs;
    w->status[1] = JL_OK;
    jli_fold_shape(w, fold, r);
    if (w->status[0] != JL_OK)
        return JL_OK;
    fill(fold, w, r, len);
    w->status[0] = jli_array_sense(&w->array[0], w->l.H);
    if (w->which & JLI_B)
        w->status[1] = jli_fold_choose(fold, w, z);
    return JL_OK;
}

/* All multiply at once, and wait for each other then. */
int jli_fold_pass_products(jl_fold *fold, const struct jli_folded *w,
                           int status)
{
    int own = status == JL_OK ? jli_fold_products(fold, w) : 0, len, theirs;
    int failed = jli_fold_receive(fold, &theirs, &len);

    if (failed != JL_OK)
        return failed;
    len = jli_fold_products_join(fold, own, status != JL_OK ? status : theirs,
                                 len);
    return jli_fold_send(fold, fold->config.pe - 1, len, JL_FOREVER);
}

/* --- down: QR and Faddeev ------------------------------------------------- */

int jli_fold_pass_stop(jl_fold *fold)
{
    int len = jli_msg_plain(JLI_OUT(fold), JLI_STOP, 0, 0, 0);

    return is_last(fold) ? JL_OK
        : jli_fold_send(fold, fold->config.pe + 1, len,
                        fold->config.timeout_us);
}

static int receive_arrays(jl_fold *fold, struct jli_folded *w, int first)
{
    int prev = fold->config.pe - 1, status, len;

    len = jli_fold_recv(fold, prev,
                        first ? JL_FOREVER : fold->config.timeout_us,
                        2 * prev);
    if (len < 0)
        return len;
    if (first && len == JLI_MSG_HEADER && JLI_IN(fold)[0] == JLI_STOP) {
        status = jli_fold_pass_stop(fold);
        return status == JL_OK ? JL_FOLD_OVER : status;
    }
    status = jli_fold_arrays_read(w, fold, len);
    if (status == JL_OK && !first != (w->which == (JLI_B | JLI_MEASURED)))
        status = JL_EMSG;
    return status == JL_OK ? JL_OK : jli_fold_fault(fold, prev, status);
}

int jli_fold_own_rows(const jl_fold *fold, const struct jli_folded *w, int i)
{
    const struct jli_array *a = &w->array[i];

    return jli_fold_border(fold, a, i, fold->config.pe + 1) - a->done;
}

/* The own rows of both triangles; returns what is known of the verdict. */
static int triangles(const jl_fold *fold, struct jli_folded *w)
{
    int i, status = JL_OK;

    for (i = 0; i < 2; i++) {
        struct jli_array *a = &w->array[i];

        if (!(w->which & (JLI_A << i)) || status != JL_OK)
            continue;
        if (w->status[i] == JL_OK)
            w->status[i] = jli_array_triangle(
                a, jli_fold_own_rows(fold, w, i), &w->feed[i]);
        if (w->status[i] == JL_OK && is_last(fold)
            && !jl_vec_within(w->feed[i].x, a->n, JL_LARGE))
            w->status[i] = JL_ENONFINITE;
        status = w->status[i];
    }
    return status;
}

int jli_fold_round(jl_fold *fold, struct jli_folded *w, int first,
                   int *verdict)
{
    const jl_fold_config *c = &fold->config;
    int behind = c->npe - 2 - c->pe, len, status = JL_OK;

    if (c->pe > 0)
        status = receive_arrays(fold, w, first);
    if (status != JL_OK)
        return status;
    *verdict = triangles(fold, w);
    if (!is_last(fold)) {
        status = jli_fold_send(fold, c->pe + 1, jli_fold_arrays(fold, w),
                               c->timeout_us);
        if (status != JL_OK)
            return status;
        len = jli_fold_recv(fold, c->pe + 1, c->timeout_us, 2 * behind);
        if (len < 0)
            return len;
        status = jli_fold_verdict_read(verdict, w, fold, len);
        if (status != JL_OK)
            return jli_fold_fault(fold, c->pe + 1, status);
    }
    return c->pe == 0 ? JL_OK
        : jli_fold_send(fold, c->pe - 1, jli_fold_verdict(fold, w, *verdict),
                        c->timeout_us);
}
