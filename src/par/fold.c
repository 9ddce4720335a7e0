/* The folded MEKF: set up, and a step. */
#include "par/fold_parts.h"

#include "mat/mat_k.h"

/* --- borders --------------------------------------------------------------- */

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

/* --- setting up ------------------------------------------------------------ */

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

/* --- up: the products ------------------------------------------------------ */

static int is_last(const jl_fold *fold)
{
    return fold->config.pe == fold->config.npe - 1;
}

/* The products of the PEs behind into the buffer [*len, none: 0]; *status: what
 * they report. */
static int receive_products(jl_fold *fold, int *status, int *len)
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

/* PE0: c of B, and what it makes. */
static int choose(const jl_fold *fold, struct jli_folded *w, const jl_real *z)
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

/* PE0 receives the products, and all goes into the arrays. */
static int begin(jl_fold *fold, struct jli_folded *w, const jl_real *z,
                 int status)
{
    int r = z != NULL ? fold->filter->model->r : 0, len, theirs;
    int failed = receive_products(fold, &theirs, &len);

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
        w->status[1] = choose(fold, w, z);
    return JL_OK;
}

/* The others add theirs, and wait for PE0 as long as it takes. */
static int pass_products(jl_fold *fold, const struct jli_folded *w,
                         int status)
{
    int len, theirs, failed = receive_products(fold, &theirs, &len);

    if (failed != JL_OK)
        return failed;
    len = jli_fold_products(fold, w, status != JL_OK ? status : theirs, len);
    return jli_fold_send(fold, fold->config.pe - 1, len, JL_FOREVER);
}

/* --- down: QR and Faddeev -------------------------------------------------- */

static int pass_stop(jl_fold *fold)
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
        status = pass_stop(fold);
        return status == JL_OK ? JL_FOLD_OVER : status;
    }
    status = jli_fold_arrays_read(w, fold, len);
    if (status == JL_OK && !first != (w->which == (JLI_B | JLI_MEASURED)))
        status = JL_EMSG;
    return status == JL_OK ? JL_OK : jli_fold_fault(fold, prev, status);
}

/* Rows of the triangle of filter i that this PE owns. */
static int own_rows(const jl_fold *fold, const struct jli_folded *w, int i)
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
            w->status[i] = jli_array_triangle(a, own_rows(fold, w, i),
                                              &w->feed[i]);
        if (w->status[i] == JL_OK && is_last(fold)
            && !jl_vec_within(w->feed[i].x, a->n, JL_LARGE))
            w->status[i] = JL_ENONFINITE;
        status = w->status[i];
    }
    return status;
}

/* Down and up once.  Returns JL_OK, with the *verdict, JL_FOLD_OVER, or the
 * error of a channel. */
static int round_trip(jl_fold *fold, struct jli_folded *w, int first,
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

/* --- a step ---------------------------------------------------------------- */

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
    jli_array_take(f->U, &w->array[0], own_rows(fold, w, 0));
    jli_array_take(f->U1, &w->array[1], own_rows(fold, w, 1));
}

static int step(jl_fold *fold, const jl_real *z, jl_real *scratch)
{
    struct jli_folded w;
    int pe = fold->config.pe, status, verdict = JL_OK;

    fold->seq++;
    memset(&w, 0, sizeof w);
    status = linearise(fold, &w, pe == 0 ? z : NULL, scratch);
    jli_fold_shape(&w, fold, fold->filter->model->r);
    status = pe == 0 ? begin(fold, &w, z, status)
        : pass_products(fold, &w, status);
    if (status == JL_OK)
        status = round_trip(fold, &w, 1, &verdict);
    if (status == JL_OK && verdict == JL_OK && (w.which & JLI_MORE)) {
        w.which = JLI_B | JLI_MEASURED;
        if (pe == 0)
            w.status[1] = choose(fold, &w, z);
        status = round_trip(fold, &w, 0, &verdict);
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
    status = receive_products(fold, &theirs, &len);
    if (status == JL_OK)
        status = pass_stop(fold);
    if (fold->failed != JL_OK)
        jli_fold_tell_fault(fold);
    return status;
}
