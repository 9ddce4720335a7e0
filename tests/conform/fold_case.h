/* The folded MEKF, as one PE sees it: beside its part runs the serial filter,
 * and what the PE owns must have the same bits after every step. */
#ifndef TESTS_FOLD_CASE_H
#define TESTS_FOLD_CASE_H

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "conform.h"
#include "jumplink/fold.h"
#include "mekf_zoo.h"

enum {
    FOLD_N = 8, FOLD_M = 4, FOLD_R = 4, FOLD_P1 = 8, FOLD_P2 = 4,
    FOLD_STEPS = 6, FOLD_MODELS = 9, FOLD_MISSING = 3
};

#define FOLD_MAX_MSG JL_FOLD_MSG(FOLD_N, FOLD_M, FOLD_R, FOLD_P1, FOLD_P2)

enum { FAIL_NEVER, FAIL_F, FAIL_G, FAIL_C, FAIL_SINGULAR, FAIL_LARGE };
enum { FOLD_FAILS_AT = 2 };

struct fold_shape {
    int npe, model;             /* of fold_sizes                            */
    jl_mekf_c c;
    int spread;
    const int *rows;            /* NULL: jl_fold_deal                       */
    int fail, fail_pe;          /* which function; -1: on every PE          */
    int leaves;                 /* a PE that leaves at FOLD_FAILS_AT, or -1 */
    int hangs;                  /* ... not at once, but long after the rest */
};

/* Models: those of the zoo, then random ones, f and c linear in y. */
static const struct fold_size {
    const char *name;
    int n, m, r, p1, p2;
} fold_sizes[FOLD_MODELS] = {
    { "ar1", 1, 1, 1, 1, 1 }, { "spring2", 2, 1, 4, 1, 1 },
    { "ct4pos", 4, 1, 2, 2, 1 }, { "ct4rdc", 4, 1, 3, 2, 1 },
    { "gen32", 3, 2, 2, 2, 1 }, { NULL, 8, 4, 4, 8, 4 },
    { NULL, 1, 4, 3, 2, 0 }, { NULL, 5, 1, 1, 3, 2 }, { NULL, 2, 2, 4, 1, 3 }
};

struct fold_model {
    jl_mekf_model model, asked;
    struct mekf_zoo zoo;
    jl_real A[(1 + FOLD_M) * FOLD_N * FOLD_N];
    jl_real C[(1 + FOLD_M) * FOLD_R * FOLD_N];
    jl_real G[FOLD_N * FOLD_P1 + FOLD_M * (FOLD_P1 + FOLD_P2)];
    int fails;                  /* FAIL_... now                             */
};

static jl_real fold_uniform(unsigned *state)
{
    return (jl_real)(int)(conform_random(state) % 2001 - 1000) / 1000;
}

static void fold_random(jl_real *a, int n, unsigned *state)
{
    while (n-- > 0)
        *a++ = fold_uniform(state);
}

static int linear_f(jl_real *f, const jl_real *y, void *context)
{
    const struct fold_model *t = context;
    int n = t->model.n, i, k;

    for (i = 0; i < n * n; i++) {
        f[i] = t->A[i] / 2;
        for (k = 0; k < t->model.m; k++)
            f[i] += t->A[(1 + k) * n * n + i] * y[k] / 4;
    }
    return JL_OK;
}

static int linear_c(jl_real *c, const jl_real *x, const jl_real *y,
                    void *context)
{
    const struct fold_model *t = context;
    int rn = t->model.r * t->model.n, i, k;

    (void)x;
    for (i = 0; i < rn; i++) {
        c[i] = t->C[i];
        for (k = 0; k < t->model.m; k++)
            c[i] += t->C[(1 + k) * rn + i] * y[k] / 4;
    }
    return JL_OK;
}

static int linear_G(jl_real *G1, jl_real *G2, jl_real *G3, const jl_real *x,
                    const jl_real *y, void *context)
{
    const struct fold_model *t = context;
    const jl_mekf_model *m = &t->model;
    size_t one = (size_t)(m->n * m->p1), two = (size_t)(m->m * m->p1);

    (void)x, (void)y;
    memcpy(G1, t->G, one * sizeof *G1);
    memcpy(G2, t->G + one, two * sizeof *G2);
    memcpy(G3, t->G + one + two, (size_t)(m->m * m->p2) * sizeof *G3);
    return JL_OK;
}

/* --- functions that may fail ---------------------------------------------- */

static int may_fail_f(jl_real *f, const jl_real *y, void *context)
{
    struct fold_model *t = context;

    if (t->fails == FAIL_F)
        return JL_ERANGE;
    return t->asked.f(f, y, t->asked.context);
}

static int pass_h(jl_real *y_next, const jl_real *x, const jl_real *y,
                  void *context)
{
    struct fold_model *t = context;

    return t->asked.h(y_next, x, y, t->asked.context);
}

static int may_fail_G(jl_real *G1, jl_real *G2, jl_real *G3,
                      const jl_real *x, const jl_real *y, void *context)
{
    struct fold_model *t = context;

    if (t->fails == FAIL_G)
        return JL_EORDER;
    return t->asked.G(G1, G2, G3, x, y, t->asked.context);
}

static int may_fail_c(jl_real *c, const jl_real *x, const jl_real *y,
                      void *context)
{
    struct fold_model *t = context;
    int status = t->asked.c(c, x, y, t->asked.context), i;

    if (t->fails == FAIL_C)
        return JL_EPROB;
    for (i = 0; i < t->model.r * t->model.n; i++)
        if (t->fails == FAIL_SINGULAR)
            c[i] = 0;           /* R, too, is 0 then */
        else if (t->fails == FAIL_LARGE)
            c[i] = JL_LARGE;
    return status;
}

static void fold_model(struct fold_model *t, const struct fold_shape *shape)
{
    const struct fold_size *size = &fold_sizes[shape->model];
    unsigned state = 77 + (unsigned)shape->model;

    memset(t, 0, sizeof *t);
    fold_random(t->A, sizeof t->A / sizeof *t->A, &state);
    fold_random(t->C, sizeof t->C / sizeof *t->C, &state);
    fold_random(t->G, sizeof t->G / sizeof *t->G, &state);
    if (size->name != NULL) {
        t->zoo.r = size->r;
        t->zoo.T = JL_C(0.5);
        t->zoo.d = JL_C(0.1);
        fold_random(t->zoo.C, sizeof t->zoo.C / sizeof *t->zoo.C, &state);
        memcpy(t->zoo.A0, t->A, sizeof t->zoo.A0);
        memcpy(t->zoo.A1, t->A + 9, sizeof t->zoo.A1);
        memcpy(t->zoo.A2, t->A + 18, sizeof t->zoo.A2);
        memcpy(t->zoo.C0, t->C, sizeof t->zoo.C0);
        memcpy(t->zoo.C1, t->C + 6, sizeof t->zoo.C1);
        memcpy(t->zoo.C2, t->C + 12, sizeof t->zoo.C2);
        memcpy(t->zoo.B1, t->G, sizeof t->zoo.B1);
        memcpy(t->zoo.B2, t->G + 6, sizeof t->zoo.B2);
        memcpy(t->zoo.B3, t->G + 10, sizeof t->zoo.B3);
        t->zoo.a1 = t->zoo.a2 = JL_C(0.75);
        t->zoo.b1 = t->zoo.b2 = t->zoo.g = JL_C(0.125);
        assert_int_equal(mekf_zoo_model(&t->asked, size->name, &t->zoo), 0);
    } else {
        t->asked.n = size->n;
        t->asked.m = size->m;
        t->asked.r = size->r;
        t->asked.p1 = size->p1;
        t->asked.p2 = size->p2;
        t->asked.f = linear_f;
        t->asked.c = linear_c;
        t->asked.G = linear_G;
        t->asked.context = t;
    }
    t->model = t->asked;
    t->model.h = t->asked.h != NULL ? pass_h : NULL;
    t->model.df = NULL;
    t->model.dh = NULL;
    t->model.dc = NULL;
    t->model.f = may_fail_f;
    t->model.c = may_fail_c;
    t->model.G = may_fail_G;
    t->model.context = t;
}

/* --- one PE --------------------------------------------------------------- */

struct fold_filter {
    jl_mekf f;
    jl_real mem[JL_MEKF_STATE(FOLD_N, FOLD_M, FOLD_R, FOLD_P1, FOLD_P2)];
    jl_real scratch[JL_FOLD_SCRATCH(FOLD_N, FOLD_M, FOLD_R, FOLD_P1,
                                    FOLD_P2)];
};

static void fold_filter_start(struct fold_filter *t, const jl_mekf_model *model,
                              const struct fold_shape *shape)
{
    jl_real Q[(FOLD_P1 + FOLD_P2) * (FOLD_P1 + FOLD_P2)] = { 0 };
    jl_real R[FOLD_R * FOLD_R] = { 0 }, x[FOLD_N + FOLD_M];
    jl_real P[(FOLD_N + FOLD_M) * (FOLD_N + FOLD_M)] = { 0 };
    int p = model->p1 + model->p2, N = model->n + model->m, i, j;

    for (i = 0; i < p; i++)
        for (j = 0; j < p; j++)
            Q[i * p + j] = i == j ? JL_C(0.25) : JL_C(0.015625);
    for (i = 0; i < model->r && shape->fail != FAIL_SINGULAR; i++)
        R[i * (model->r + 1)] = JL_C(0.5);
    for (i = 0; i < N; i++) {
        x[i] = JL_C(0.5) - (jl_real)i / 8;
        for (j = 0; j < N; j++)
            P[i * N + j] = i == j ? 1 : JL_C(0.03125);
    }
    assert_int_equal(jl_mekf_init(&t->f, model, Q, R, t->mem,
                                  sizeof t->mem / sizeof *t->mem, t->scratch),
                     JL_OK);
    assert_int_equal(jl_mekf_set(&t->f, x, P, NULL, t->scratch), JL_OK);
    t->f.c = shape->c;
    t->f.spread = shape->spread;
}

static int same_rows(const jl_real *A, const jl_real *B, int from, int to,
                     int n)
{
    return from >= to || memcmp(A + from * n, B + from * n,
                                (size_t)((to - from) * n) * sizeof *A) == 0;
}

static int clip(int i, int top)
{
    return i < 0 ? 0 : i > top ? top : i;
}

/* x, xhat and the own rows. */
static int fold_is_same(const jl_mekf *a, const jl_mekf *b, const int *own)
{
    int n = a->model->n, N = n + a->model->m, r = a->model->r;
    int from = clip(own[0] - r, N), to = clip(own[1] - r, N);

    return same_rows(a->x, b->x, 0, 1, N)
        && same_rows(a->xhat, b->xhat, 0, 1, n)
        && same_rows(a->U, b->U, from, to, N)
        && same_rows(a->U1, b->U1, clip(from, n), clip(to, n), n);
}

/* The octets of the messages of a step at left border b, as fold.h has them. */
static int fold_up(const jl_mekf_model *t, int spread, int b)
{
    int k, N = t->n + t->m, reals = 0;

    for (k = b > t->r ? b - t->r : 0; k < N; k++)
        reals += N + t->n * (k < t->n) + t->n * spread;
    return 8 + reals * JL_REAL_OCTETS;
}

static int fold_down(const jl_mekf_model *t, int spread, int b, int measured)
{
    int r = measured ? t->r : 0, n = t->n, N = n + t->m, b1, reals;

    b = clip(b - (t->r - r), r + N);
    b1 = clip(b, r + n);
    reals = (r + N + t->p1 + t->p2 - b) * (r + N - b) + 2 * clip(r - b, r) + N
        + (r + n + t->p1 + spread * N - b1) * (r + n - b1)
        + 2 * clip(r - b1, r) + n;
    return 8 + 4 + reals * JL_REAL_OCTETS;
}

static unsigned long fold_octets_down(const struct fold_shape *s,
                                      const jl_mekf_model *t, int b)
{
    unsigned long sum = 8;              /* the stop */
    int k;

    for (k = 0; k < FOLD_STEPS; k++)
        sum += (unsigned long)fold_down(t, s->spread, b, k != FOLD_MISSING)
            + (s->c == JL_MEKF_FILT && k != FOLD_MISSING ? 8 : 0);
    return sum;
}

static unsigned long fold_octets_up(const struct fold_shape *s,
                                    const jl_mekf_model *t, int b)
{
    int n = t->n, k;
    unsigned long sum = (unsigned long)fold_up(t, s->spread, b);

    for (k = 0; k < FOLD_STEPS; k++)
        sum += (unsigned long)(fold_up(t, s->spread, b) + 8
                               + (2 * n + t->m) * JL_REAL_OCTETS)
            + (s->c == JL_MEKF_FILT && k != FOLD_MISSING ? 8 : 0);
    return sum;
}

/* What is wrong is told on stderr; returns how much. */
struct fold_pe {
    struct fold_model model;
    struct fold_filter serial, folded;
    jl_fold fold;
    unsigned char buf[2 * FOLD_MAX_MSG];
    int rows[JL_MAX_PES + 1];
};

static int fold_wrong(const char *what, int pe, int k, int status)
{
    fprintf(stderr, "PE %d, step %d: %s (%d)\n", pe, k, what, status);
    return 1;
}

/* A step of the serial filter, and of the PE's part. */
static int fold_both(struct fold_pe *t, const struct fold_shape *s, int k,
                     const jl_real *z)
{
    int fails = s->fail != FAIL_NEVER && k == FOLD_FAILS_AT, want, got;
    int pe = t->fold.config.pe;

    t->model.fails = fails ? s->fail : FAIL_NEVER;
    want = jl_mekf_step(&t->serial.f, z, t->serial.scratch);
    if (fails && s->fail_pe >= 0 && pe != s->fail_pe)
        t->model.fails = FAIL_NEVER;
    got = jl_fold_step(&t->fold, pe == 0 ? z : NULL, t->folded.scratch);
    if (s->leaves >= 0 && t->fold.failed != JL_OK)
        return 1;
    if (got != want || (fails && got == JL_OK))
        return fold_wrong("not the serial status", pe, k, got);
    if (!fold_is_same(&t->serial.f, &t->folded.f, t->fold.config.rows + pe))
        return fold_wrong("not the serial bits", pe, k, got);
    return 0;
}

static int fold_counted(const struct fold_shape *s, const struct fold_pe *t)
{
    const jl_fold_config *c = &t->fold.config;
    int pe = c->pe, bad = 0;

    if (s->fail != FAIL_NEVER)
        return 0;
    if (pe < c->npe - 1
        && c->to_next->octets != fold_octets_down(s, &t->model.model,
                                                  c->rows[pe + 1]))
        bad += fold_wrong("octets down", pe, -1, (int)c->to_next->octets);
    if (pe > 0
        && c->to_prev->octets != fold_octets_up(s, &t->model.model,
                                                c->rows[pe]))
        bad += fold_wrong("octets up", pe, -1, (int)c->to_prev->octets);
    return bad;
}

/* The life of a PE; to, from [npe].  0 if all was well. */
static inline int fold_pe(struct fold_pe *t, int pe,
                          const struct fold_shape *s, jl_chan **to,
                          jl_chan **from)
{
    jl_fold_config config = { 0 };
    jl_real z[FOLD_R];
    unsigned state = 3;
    int k, bad = 0;

    fold_model(&t->model, s);
    fold_filter_start(&t->serial, &t->model.model, s);
    fold_filter_start(&t->folded, &t->model.model, s);
    jl_fold_deal(t->rows, s->npe, &t->model.model);
    config.pe = pe;
    config.npe = s->npe;
    config.rows = s->rows != NULL ? s->rows : t->rows;
    if (pe > 0) {
        config.to_prev = to[pe - 1];
        config.from_prev = from[pe - 1];
    }
    if (pe < s->npe - 1) {
        config.to_next = to[pe + 1];
        config.from_next = from[pe + 1];
    }
    config.timeout_us = LONG_US;
    if (jl_fold_init(&t->fold, &t->folded.f, &config, t->buf, sizeof t->buf)
        != JL_OK)
        return fold_wrong("init", pe, -1, 0);
    for (k = 0; k < FOLD_STEPS && bad == 0; k++) {
        fold_random(z, FOLD_R, &state);
        if (pe == s->leaves && k == FOLD_FAILS_AT) {
            if (s->hangs)       /* nothing ever comes from there */
                (void)jl_chan_recv(from[(pe + 2) % s->npe], NULL, 0,
                                   20 * LONG_US);
            return 0;
        }
        bad += fold_both(t, s, k, k == FOLD_MISSING ? NULL : z);
    }
    if (bad > 0)
        return bad;
    k = pe == 0 ? jl_fold_stop(&t->fold)
        : jl_fold_step(&t->fold, NULL, t->folded.scratch);
    if (k != (pe == 0 ? JL_OK : JL_FOLD_OVER))
        return fold_wrong("stop", pe, FOLD_STEPS, k);
    return fold_counted(s, t);
}

#endif
