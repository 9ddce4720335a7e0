/* The host: it takes what leaves the array, and evaluates the model's functions
 * as soon as it has what they are of. */
#include "systolic/systolic_parts.h"

#include <limits.h>
#include <string.h>

#include "mat/differences.h"
#include "mat/mat_k.h"
#include "mekf/mekf_parts.h"

/* --- what leaves the array ------------------------------------------------ */

static const jl_systolic_packet *south_of(const jl_systolic *array, int cell)
{
    return &array->cell[cell].south[array->phase];
}

static const jl_systolic_packet *east_of(const jl_systolic *array, int cell)
{
    return &array->cell[cell].east[array->phase];
}

/* Is V singular?  As jl_mekf_step asks: by what rounding leaves of its
 * diagonal.  By the time estimates come out of row r - 1, V is complete. */
static int judge(const jl_systolic *array, const jl_systolic_triangle *t)
{
    int r = array->r, i, j;
    jl_real least = 4 * (jl_real)(t->N + t->noises) * JL_EPSILON;

    for (j = 0; j < r; j++) {
        jl_real S = 0, v = 0;

        for (i = 0; i <= j; i++) {
            v = array->cell[JLI_CELL(t, i, j)].end;
            S += v * v;
        }
        if (!(S <= JL_LARGE * JL_LARGE))
            return JL_ENONFINITE;
        if (v <= least * jli_sqrt(S))
            return JL_ESINGULAR;
    }
    return JL_OK;
}

/* The estimate of the step before the one that is fed comes out in order. */
static void take_estimate(jl_systolic *array, jl_systolic_triangle *t)
{
    const jl_systolic_packet *p;
    int n = array->n, m = array->m, k = t->out, state, status;

    if (k == t->N - array->r)
        return;
    p = south_of(array, JLI_CELL(t, array->r - 1, array->r + k));
    if (p->mode != JL_SYSTOLIC_FADDEEV)
        return;
    status = k == 0 ? judge(array, t) : JL_OK;
    if (status == JL_OK && !jl_vec_within(&p->a, 1, JL_LARGE))
        status = JL_ENONFINITE;
    if (status != JL_OK && array->status == JL_OK)
        array->status = status;
    t->out++;
    if (t->delay) {
        array->xhat[k] = p->a;
        if (k == n - 1)
            array->has_xhat = t->step - 1;
        return;
    }
    state = JLI_STATE_OF(array, k);
    array->x[state] = p->a;
    if (state == n + m - 1)
        array->has_y = t->step - 1;
    if (k == n + m - 1)
        array->has_x = t->step - 1;
}

static void take_products(const jl_systolic *array, jl_systolic_triangle *t)
{
    int i;

    for (i = array->r; i < t->N; i++) {
        const jl_systolic_packet *p = east_of(array, JLI_CELL(t, i, t->N - 1));

        if (p->mode == JL_SYSTOLIC_MULTIPLY && p->tag < t->N)
            t->product[(i - array->r) * t->N + p->tag] = p->a;
    }
}

/* A row of f makes a prediction, one of c f waits for its z. */
static void take_sum(jl_systolic *array)
{
    int n = array->n, r = array->r, N = n + r;
    const jl_systolic_packet *p = east_of(array, JLI_DIAMOND(array, N - 1));

    if (p->mode != JL_SYSTOLIC_MULTIPLY)
        return;
    if (p->tag >= r && p->tag < N) {
        array->xp[p->tag - r] = p->a;
        if (p->tag == N - 1)
            array->has_xp = array->sums_of;
        return;
    }
    if (array->sums++ == 0)
        array->sum_first = p->tag < r;
    array->sum[p->tag < r ? r + p->tag : p->tag - N] = p->a;
}

void jli_systolic_collect(jl_systolic *array)
{
    const jl_systolic_packet *p = east_of(array, JLI_SUBTRACTOR(array));

    take_estimate(array, &array->left);
    take_estimate(array, &array->right);
    take_products(array, &array->left);
    take_products(array, &array->right);
    take_sum(array);
    if (p->mode == JL_SYSTOLIC_SUBTRACT) {
        array->sum[p->tag] = p->a;
        array->differences++;
    }
}

/* --- the model's functions ------------------------------------------------ */

static void linear(struct jli_linear *l, const jl_systolic *array)
{
    l->F = array->F;
    l->G = array->G;
    l->H = array->H;
    l->c = array->c_A;
    l->xp = array->xp_host;
    l->nu = NULL;
}

static int make_f(jl_systolic *array)
{
    int nn = array->n * array->n;

    memset(array->f, 0, (size_t)nn * sizeof *array->f);
    return jli_checked(array->model->f(array->f, array->x + array->n,
                                       array->model->context), array->f, nn);
}

static int make_c(jl_systolic *array)
{
    struct jli_linear l;

    linear(&l, array);
    jli_copy(array->xp_host, array->xp, array->n + array->m);
    return jli_mekf_sense(&l, array->model, array->work);
}

static int make_F(jl_systolic *array)
{
    struct jli_linear l;

    linear(&l, array);
    return jli_mekf_move(&l, array->model, array->xhat, array->x + array->n,
                         array->work);
}

static int make_G(jl_systolic *array)
{
    struct jli_linear l;

    linear(&l, array);
    return jli_mekf_drive(&l, array->model, array->x, array->x + array->n,
                          array->work);
}

/* --- rows for the array --------------------------------------------------- */

/* Rows tag.. of t->map = A [rows,inner] B [inner,N-r] in the array's order. */
static void multiply_rows(jl_systolic *array, jl_systolic_triangle *t, int tag,
                          const jl_real *A, const jl_real *B, int rows)
{
    int inner = t->N - array->r, i, j, k;

    for (i = 0; i < rows; i++)
        for (j = 0; j < inner; j++) {
            int column = t->delay ? j : JLI_STATE_OF(array, j);
            jl_real s = 0;

            for (k = 0; k < inner; k++)
                s += A[i * inner + k] * B[k * inner + column];
            t->map[(tag + i) * inner + j] = s;
        }
}

/* Rows of t->map = F [N-r,N-r] in the array's order. */
static void move_rows(jl_systolic *array, jl_systolic_triangle *t,
                      const jl_real *F)
{
    int inner = t->N - array->r, i, j;

    for (i = 0; i < inner; i++)
        for (j = 0; j < inner; j++) {
            int row = t->delay ? i : JLI_STATE_OF(array, i);
            int column = t->delay ? j : JLI_STATE_OF(array, j);

            t->map[(array->r + i) * inner + j] = F[row * inner + column];
        }
    t->known[JLI_MOVE] = t->step;
}

/* [U_Q G'H', U_Q G'] in the array's order; H [r,N-r] */
static void noise_rows(jl_systolic *array, jl_systolic_triangle *t,
                       const jl_real *H)
{
    int r = array->r, inner = t->N - r, p = array->p1 + array->p2, i, j, k;

    for (i = 0; i < t->noises; i++) {
        jl_real *row = t->noise + i * t->N, *own = array->work;

        for (j = 0; j < inner; j++) {
            own[j] = 0;
            for (k = 0; k < t->noises; k++)
                own[j] += array->UQ[i * p + k] * array->G[j * p + k];
        }
        jli_apply(row, H, own, NULL, r, inner);
        for (j = 0; j < inner; j++)
            row[r + j] = own[t->delay ? j : JLI_STATE_OF(array, j)];
    }
    t->noise_known = t->step;
}

/* --- in which order ------------------------------------------------------- */

/* A function of the next step's that fails does not fail this one: it is asked
 * again. */
static int later(const jl_systolic *array, int step, int status)
{
    return step > array->step + 1 ? JL_OK : status;
}

static int evaluate_left(jl_systolic *array)
{
    jl_systolic_triangle *t = &array->left;
    int s = t->step, status;

    if (array->has_yp < s && array->has_y >= s - 1
        && array->has_xhat >= s - 1) {
        status = make_F(array);
        if (status != JL_OK)
            return later(array, s, status);
        jli_copy(array->xp + array->n, array->xp_host + array->n, array->m);
        array->has_yp = s;
        if (array->has_F < s)
            array->has_F = s;
    }
    if (t->known[JLI_MOVE] < s && array->has_F >= s)
        move_rows(array, t, array->F);
    if (array->has_c < s && array->has_xp >= s && array->has_yp >= s) {
        status = make_c(array);
        if (status != JL_OK)
            return later(array, s, status);
        array->has_c = s;
    }
    if (t->known[JLI_SENSE] < s && t->known[JLI_MOVE] == s
        && array->has_c >= s) {
        multiply_rows(array, t, 0, array->H, array->F, array->r);
        t->known[JLI_SENSE] = s;
    }
    if (t->noise_known < s && array->has_c >= s && array->has_G >= s
        && array->tick >= t->busy + t->N)
        noise_rows(array, t, array->H);
    return JL_OK;
}

/* c for B. */
static int make_cc(jl_systolic *array, int s)
{
    int n = array->n, status;

    if (array->c == JL_MEKF_PRED) {
        if (array->has_c < s)
            return JL_OK;
        jli_copy(array->c_B, array->c_A, array->r * n);
    } else {
        if (array->has_x < (array->c == JL_MEKF_PREV ? s - 1 : s))
            return JL_OK;
        status = jli_mekf_c(array->c_B, array->model, array->x, array->x + n);
        if (status != JL_OK)
            return later(array, s, status);
    }
    array->has_cc = s;
    return JL_OK;
}

static int evaluate_right(jl_systolic *array)
{
    jl_systolic_triangle *t = &array->right;
    int s = t->step, status;

    if (array->has_f < s && array->has_y >= s - 1) {
        status = make_f(array);
        if (status != JL_OK)
            return later(array, s, status);
        array->has_f = s;
    }
    if (t->known[JLI_MOVE] < s && array->has_f >= s)
        move_rows(array, t, array->f);
    if (array->has_G < s && array->has_x >= s - 1) {
        status = make_G(array);
        if (status != JL_OK)
            return later(array, s, status);
        array->has_G = s;
    }
    if (array->has_cc < s) {
        status = make_cc(array, s);
        if (status != JL_OK)
            return status;
    }
    if (t->known[JLI_SENSE] < s && t->known[JLI_MOVE] == s
        && array->has_cc >= s) {
        multiply_rows(array, t, 0, array->c_B, array->f, array->r);
        t->known[JLI_SENSE] = s;
    }
    if (t->known[JLI_PREDICT] < s && t->known[JLI_MOVE] == s
        && array->has_c >= s) {
        multiply_rows(array, t, t->N, array->c_A, array->f, array->r);
        t->known[JLI_PREDICT] = s;
    }
    if (t->noise_known < s && array->has_cc >= s && array->has_G >= s
        && array->tick >= t->busy + t->N)
        noise_rows(array, t, array->c_B);
    return JL_OK;
}

int jli_systolic_evaluate(jl_systolic *array)
{
    int status = evaluate_left(array);

    return status != JL_OK ? status : evaluate_right(array);
}

int jli_systolic_prepare(jl_systolic *array)
{
    int known = array->schedule.known, status = JL_OK;

    if (known & (JL_SYSTOLIC_KNOW_F | JL_SYSTOLIC_KNOW_C)) {
        status = make_F(array);
        if (status == JL_OK && (known & JL_SYSTOLIC_KNOW_F)) {
            status = make_f(array);
            array->has_f = array->has_F = INT_MAX;
        }
    }
    if (status == JL_OK && (known & JL_SYSTOLIC_KNOW_C)) {
        jli_copy(array->xp, array->xp_host, array->n + array->m);
        status = make_c(array);
        jli_copy(array->c_B, array->c_A, array->r * array->n);
        array->has_c = array->has_cc = INT_MAX;
    }
    if (status == JL_OK && (known & JL_SYSTOLIC_KNOW_G)) {
        status = make_G(array);
        array->has_G = INT_MAX;
    }
    return status;
}
