/* The folded MEKF's messages as octets. */
#include "par/fold_parts.h"

#include "mat/mat_k.h"

static int header(const jl_fold *fold, int type, int octet, int status)
{
    return jli_msg_plain(JLI_OUT(fold), type, octet, -status, fold->seq);
}

/* The header of what came: JL_OK, JL_ELENGTH, JL_EMSG. */
static int check(const jl_fold *fold, int type, int len)
{
    const unsigned char *in = JLI_IN(fold);

    if (len < JLI_MSG_HEADER)
        return JL_ELENGTH;
    return in[0] != type || jl_get_u32(in + 4) != fold->seq
        ? JL_EMSG : JL_OK;
}

/* --- products ------------------------------------------------------------- */

/* Reals of the products of states first .. N-1. */
static int products_of(const jl_mekf *f, int first)
{
    int n = f->model->n, N = n + f->model->m;

    return (N - first) * (N + (f->spread ? n : 0))
        + (first < n ? (n - first) * n : 0);
}

/* What each state k has in the message, by turns. */
struct product {
    const jl_real *L, *M;
    int row, n, inner;          /* row of the pre-array                     */
    int filter;                 /* 0: A, 1: B                               */
};

/* Product i (0, 1, 2) of state k; 0 if there is none. */
static int product_of(struct product *t, int i, int k, const jl_fold *fold,
                      const struct jli_folded *w)
{
    const jl_mekf *f = fold->filter;
    int n = f->model->n, N = n + f->model->m;

    t->filter = i > 0;
    t->n = i > 0 ? n : N;
    t->M = w->l.F + (i == 2 ? n : 0);
    t->L = i == 1 ? f->U1 + k * n : f->U + k * N + (i == 2 ? n : 0);
    t->inner = i == 0 ? N : i == 1 ? n : N - n;
    t->row = w->array[t->filter].r + k + (i == 2 ? n + f->model->p1 : 0);
    return i == 0 || (i == 1 ? k < n : f->spread);
}

static void multiply(jl_real *out, const struct product *t, int N)
{
    jli_array_products(out, t->n, t->L, t->inner, t->M, N, 1, t->n, t->inner);
}

int jli_fold_products(const jl_fold *fold, const struct jli_folded *w)
{
    unsigned char *p = JLI_OUT(fold);
    int N = fold->filter->model->n + fold->filter->model->m, k, end, i;
    struct product t;

    p += header(fold, JLI_PRODUCTS, fold->config.pe, JL_OK);
    for (jli_fold_states(fold, fold->config.pe, &k, &end); k < end; k++)
        for (i = 0; i < 3; i++)
            if (product_of(&t, i, k, fold, w)) {
                multiply(w->mem[0], &t, N);
                p = jl_put_reals(p, w->mem[0], t.n);
            }
    return (int)(p - JLI_OUT(fold));
}

int jli_fold_products_join(const jl_fold *fold, int own, int status, int len)
{
    if (status != JL_OK)
        return header(fold, JLI_PRODUCTS, fold->config.pe, status);
    if (len == 0)
        return own;
    len -= JLI_MSG_HEADER;
    memcpy(JLI_OUT(fold) + own, JLI_IN(fold) + JLI_MSG_HEADER, (size_t)len);
    return own + len;
}

int jli_fold_products_read(int *status, const jl_fold *fold, int len)
{
    int first, end, reals = 0, bad = check(fold, JLI_PRODUCTS, len);

    if (bad != JL_OK)
        return bad;
    if (JLI_IN(fold)[1] != fold->config.pe + 1)
        return JL_EMSG;
    *status = -(int)jl_get_u16(JLI_IN(fold) + 2);
    jli_fold_states(fold, fold->config.pe, &first, &end);
    if (*status == JL_OK)
        reals = products_of(fold->filter, end);
    return len == JLI_MSG_HEADER + reals * JL_REAL_OCTETS
        ? JL_OK : JL_ELENGTH;
}

void jli_fold_products_take(const jl_fold *fold, struct jli_folded *w,
                            int len)
{
    const unsigned char *p = JLI_IN(fold) + JLI_MSG_HEADER;
    int N = fold->filter->model->n + fold->filter->model->m, k, end, i;
    struct product t;

    jli_fold_states(fold, fold->config.pe, &k, &end);
    for (; k < (len > 0 ? N : end); k++)
        for (i = 0; i < 3; i++)
            if (product_of(&t, i, k, fold, w)) {
                jl_real *row = jli_array_row(&w->array[t.filter], t.row);

                if (k < end)
                    multiply(row, &t, N);
                else
                    p = jl_get_reals(p, row, t.n);
            }
}

/* --- arrays --------------------------------------------------------------- */

void jli_fold_shape(struct jli_folded *w, const jl_fold *fold, int r)
{
    const jl_mekf *f = fold->filter;
    const jl_mekf_model *model = f->model;
    int i, N = model->n + model->m;

    for (i = 0; i < 2; i++) {
        struct jli_array *a = &w->array[i];

        a->A = w->mem[i];
        a->n = i == 0 ? N : model->n;
        a->r = r;
        a->rows = r + a->n + model->p1
            + (i == 0 ? model->p2 : f->spread ? N : 0);
        a->done = jli_fold_border(fold, a, i, fold->config.pe);
    }
}

/* What S and nu have left at row b. */
static int later(int b, int r)
{
    return b < r ? r - b : 0;
}

/* The rows from b on, and the feed. */
static int reals_of(const struct jli_array *a, int b)
{
    return (a->rows - b) * (a->r + a->n - b)
        + 2 * later(b, a->r) + a->n;
}

int jli_fold_arrays(const jl_fold *fold, const struct jli_folded *w)
{
    unsigned char *p = JLI_OUT(fold);
    int i, j, status = JL_OK;

    p += header(fold, JLI_ARRAYS, w->which, JL_OK);
    for (i = 0; i < 2; i++) {
        const struct jli_array *a = &w->array[i];
        const struct jli_feed *feed = &w->feed[i];
        int b = jli_fold_border(fold, a, i, fold->config.pe + 1);
        int cols = a->r + a->n - a->done;

        if (!(w->which & (JLI_A << i)))
            continue;
        jl_put_u16(p, (unsigned)-w->status[i]);
        p += 2;
        if (status == JL_OK)
            status = w->status[i];
        if (status != JL_OK)
            continue;
        p = jl_put_reals(p, feed->S + b, later(b, a->r));
        p = jl_put_reals(p, feed->nu + b, later(b, a->r));
        p = jl_put_reals(p, feed->x, a->n);
        for (j = b - a->done; j < a->rows - a->done; j++)
            p = jl_put_reals(p, a->A + j * cols + b - a->done,
                             a->r + a->n - b);
    }
    return (int)(p - JLI_OUT(fold));
}

static int which_is_known(int which)
{
    which &= ~JLI_MEASURED;
    return which == (JLI_A | JLI_B) || which == (JLI_A | JLI_MORE)
        || which == JLI_B;
}

int jli_fold_arrays_read(struct jli_folded *w, const jl_fold *fold, int len)
{
    const unsigned char *p = JLI_IN(fold), *end = p + len;
    int i, status = check(fold, JLI_ARRAYS, len);

    if (status != JL_OK)
        return status;
    w->which = p[1];
    if (!which_is_known(w->which))
        return JL_EMSG;
    jli_fold_shape(w, fold, w->which & JLI_MEASURED
                   ? fold->filter->model->r : 0);
    p += JLI_MSG_HEADER;
    for (i = 0; i < 2; i++) {
        const struct jli_array *a = &w->array[i];
        const struct jli_feed *feed = &w->feed[i];
        int b = a->done;

        w->status[i] = JL_OK;
        if (!(w->which & (JLI_A << i)))
            continue;
        if (end - p < 2)
            return JL_ELENGTH;
        w->status[i] = -(int)jl_get_u16(p);
        p += 2;
        if (status == JL_OK)
            status = w->status[i];
        if (status != JL_OK)
            continue;
        if (end - p < reals_of(a, b) * JL_REAL_OCTETS)
            return JL_ELENGTH;
        p = jl_get_reals(p, feed->S + b, later(b, a->r));
        p = jl_get_reals(p, feed->nu + b, later(b, a->r));
        p = jl_get_reals(p, feed->x, a->n);
        p = jl_get_reals(p, a->A, (a->rows - b) * (a->r + a->n - b));
    }
    return p == end ? JL_OK : JL_ELENGTH;
}

/* --- verdict -------------------------------------------------------------- */

int jli_fold_verdict(const jl_fold *fold, const struct jli_folded *w,
                     int status)
{
    unsigned char *p = JLI_OUT(fold);
    int i;

    p += header(fold, JLI_VERDICT, w->which, status);
    for (i = 0; i < 2 && status == JL_OK; i++)
        if (w->which & (JLI_A << i))
            p = jl_put_reals(p, w->feed[i].x, w->array[i].n);
    return (int)(p - JLI_OUT(fold));
}

int jli_fold_verdict_read(int *status, struct jli_folded *w,
                          const jl_fold *fold, int len)
{
    const unsigned char *p = JLI_IN(fold);
    int i, want = JLI_MSG_HEADER, bad = check(fold, JLI_VERDICT, len);

    if (bad != JL_OK)
        return bad;
    if (p[1] != w->which)
        return JL_EMSG;
    *status = -(int)jl_get_u16(p + 2);
    for (i = 0; i < 2 && *status == JL_OK; i++)
        if (w->which & (JLI_A << i))
            want += w->array[i].n * JL_REAL_OCTETS;
    if (len != want)
        return JL_ELENGTH;
    p += JLI_MSG_HEADER;
    for (i = 0; i < 2 && *status == JL_OK; i++)
        if (w->which & (JLI_A << i)) {
            p = jl_get_reals(p, w->feed[i].x, w->array[i].n);
            if (!jl_vec_within(w->feed[i].x, w->array[i].n, JL_LARGE))
                return JL_EMSG;
        }
    return JL_OK;
}
