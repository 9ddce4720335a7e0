/* The IMM: against a long double one that thinks in logarithms, by several
 * routes to the same bits, and unchanged by every step that fails. */
#include "close.h"

#include <stdint.h>
#include <stdlib.h>

#include "jumplink/imm.h"

#define EPS ((double)JL_EPSILON)
#define NAN_ ((jl_real)NAN)
#define INF_ ((jl_real)INFINITY)
#define EDGE 4

enum { M_MAX = 6, N_MAX = 4, Z_MAX = 2 };

typedef long double wide;

static const jl_kf_form *const forms[] = { &jl_kf_joseph, &jl_kf_standard,
                                           &jl_kf_sqrt };
#define FORMS 3
static uint32_t seed;

/* Uniform in [-1, 1). */
static jl_real rnd(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (jl_real)(seed >> 8) / 8388608 - 1;
}

/* --- a filter with its modes, memory and scratch ------------------------ */

#define MODE_MEM JL_MODE_MEM(N_MAX, Z_MAX, 1)
#define MEM (JL_IMM_STATE(M_MAX, N_MAX, N_MAX) + 2 * EDGE)

struct rig {
    jl_mode modes[M_MAX];
    jl_imm imm;
    jl_real mode_mem[M_MAX][MODE_MEM];
    jl_real mem[MEM];
};

/* The filter's input: what make draws and bind gives to a rig. */
static struct {
    int M, n, m;
    jl_real F[M_MAX][N_MAX * N_MAX], G[M_MAX][N_MAX], w_bar[M_MAX];
    jl_real H[M_MAX][Z_MAX * N_MAX], R[M_MAX][Z_MAX * Z_MAX];
    jl_real x[M_MAX * N_MAX], P[M_MAX * N_MAX * N_MAX], mu[M_MAX];
    jl_real Pi[M_MAX * M_MAX];
} in;

static struct rig rig, twin, before;
static jl_real scratch[JL_IMM_SCRATCH(M_MAX, N_MAX, Z_MAX)
                       + JL_MODE_SCRATCH(N_MAX, Z_MAX, 1) + 2 * EDGE];

/* NaN in the scratch of the filter and around it. */
static jl_real *spoilt(void)
{
    int i;

    for (i = 0; i < JL_IMM_SCRATCH(in.M, in.n, in.m) + 2 * EDGE; i++)
        scratch[i] = NAN_;
    return scratch + EDGE;
}

/* Numbers in the scratch. */
static jl_real *littered(void)
{
    int i;

    for (i = 0; i < JL_IMM_SCRATCH(in.M, in.n, in.m); i++)
        scratch[EDGE + i] = 1000 * rnd();
    return scratch + EDGE;
}

static void check_edges(const struct rig *r)
{
    int i;

    for (i = 0; i < EDGE; i++) {
        assert_true(isnan(r->mem[i]));
        assert_true(isnan(r->mem[EDGE + JL_IMM_STATE(in.M, in.n, in.m) + i]));
        assert_true(isnan(scratch[i]));
        assert_true(isnan(scratch[EDGE + JL_IMM_SCRATCH(in.M, in.n, in.m)
                                  + i]));
    }
}

/* A = B B' + c I */
static void make_cov(jl_real *A, int n, jl_real c)
{
    jl_real B[N_MAX * N_MAX];
    int i, j, k;

    for (i = 0; i < n * n; i++)
        B[i] = rnd();
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            A[i * n + j] = i == j ? c : 0;
            for (k = 0; k < n; k++)
                A[i * n + j] += B[i * n + k] * B[j * n + k];
        }
}

/* Probabilities of a sum of 1 but for rounding. */
static void make_probabilities(jl_real *p, int M, jl_real sum)
{
    jl_real total = 0;
    int i;

    for (i = 0; i < M; i++)
        total += p[i] = JL_C(1.1) + rnd();
    for (i = 0; i < M; i++)
        p[i] *= sum / total;
}

/* Pi = lambda I + 1 v', the sum of v being 1 - lambda. */
static void make_sticky(jl_real lambda)
{
    jl_real v[M_MAX];
    int i, j, M = in.M;

    make_probabilities(v, M, 1 - lambda);
    for (i = 0; i < M; i++)
        for (j = 0; j < M; j++)
            in.Pi[i * M + j] = i == j ? lambda + v[j] : v[j];
}

static void make_chain(void)
{
    int i;

    for (i = 0; i < in.M; i++)
        make_probabilities(in.Pi + i * in.M, in.M, 1);
}

/* Random modes, estimates and a general chain. */
static void make(int M, int n, int m)
{
    int i, j;

    in.M = M;
    in.n = n;
    in.m = m;
    for (j = 0; j < M; j++) {
        for (i = 0; i < n * n; i++)
            in.F[j][i] = rnd() / (jl_real)n
                + (i % (n + 1) == 0 ? JL_C(0.6) : 0);
        for (i = 0; i < n; i++)
            in.G[j][i] = rnd();
        for (i = 0; i < n * m; i++)
            in.H[j][i] = rnd();
        in.w_bar[j] = rnd();
        make_cov(in.R[j], m, JL_C(0.5));
        for (i = 0; i < n; i++)
            in.x[j * n + i] = rnd();
        make_cov(in.P + j * n * n, n, JL_C(0.1));
    }
    make_probabilities(in.mu, M, 1);
    make_chain();
}

/* All modes and their estimates are those of mode 0. */
static void make_alike(void)
{
    size_t n = (size_t)in.n;
    int j;

    for (j = 1; j < in.M; j++) {
        memcpy(in.F[j], in.F[0], sizeof in.F[0]);
        memcpy(in.G[j], in.G[0], sizeof in.G[0]);
        memcpy(in.H[j], in.H[0], sizeof in.H[0]);
        memcpy(in.R[j], in.R[0], sizeof in.R[0]);
        in.w_bar[j] = in.w_bar[0];
        memcpy(in.x + (size_t)j * n, in.x, n * sizeof *in.x);
        memcpy(in.P + (size_t)j * n * n, in.P, n * n * sizeof *in.P);
    }
}

static void set_mode(struct rig *r, int j)
{
    jl_real q = 1;

    assert_int_equal(jl_mode_set(&r->modes[j], in.F[j], in.G[j], &q,
                                 &in.w_bar[j], in.H[j], in.R[j], scratch),
                     JL_OK);
}

static void bind(struct rig *r, const jl_kf_form *form, int mixing)
{
    int i, j;

    memset(r, 0, sizeof *r);
    for (i = 0; i < MEM; i++)
        r->mem[i] = NAN_;
    for (j = 0; j < in.M; j++) {
        assert_int_equal(jl_mode_init(&r->modes[j], in.n, in.m, 1,
                                      r->mode_mem[j], MODE_MEM), JL_OK);
        set_mode(r, j);
    }
    assert_int_equal(jl_imm_init(&r->imm, in.M, r->modes, form, mixing,
                                 r->mem + EDGE, JL_IMM_STATE(in.M, in.n, in.m)),
                     JL_OK);
    assert_int_equal(jl_imm_chain(&r->imm, in.Pi), JL_OK);
    assert_int_equal(jl_imm_set(&r->imm, in.x, in.P, in.mu, spoilt()), JL_OK);
    jl_imm_combine(&r->imm);
    check_edges(r);
}

static void make_z(jl_real *z)
{
    int i;

    for (i = 0; i < Z_MAX; i++)
        z[i] = 3 * rnd();
}

static int step(struct rig *r, const jl_real *z)
{
    int status = jl_imm_step(&r->imm, z, spoilt());

    check_edges(r);
    return status;
}

/* Everything the header calls state or result. */
static void check_same(const jl_imm *a, const jl_imm *b)
{
    size_t real = sizeof(jl_real), M = (size_t)a->M, n = (size_t)a->n;

    assert_same_bits(a->x, b->x, M * n * real);
    assert_same_bits(a->P, b->P, M * n * n * real);
    assert_same_bits(a->logmu, b->logmu, M * real);
    assert_same_bits(a->mu, b->mu, M * real);
    assert_same_bits(a->xhat, b->xhat, n * real);
    assert_same_bits(a->Phat, b->Phat, n * n * real);
    assert_same_bits(&a->loglik, &b->loglik, real);
}

static void check_symmetric(const jl_real *P, int n)
{
    int i, j;

    for (i = 0; i < n; i++)
        for (j = 0; j < i; j++)
            assert_same_bits(&P[i * n + j], &P[j * n + i], sizeof *P);
}

/* --- the same in long double -------------------------------------------- */

static struct {
    wide x[M_MAX][N_MAX], P[M_MAX][N_MAX][N_MAX], logmu[M_MAX];
    wide xhat[N_MAX], Phat[N_MAX][N_MAX], loglik, nis[M_MAX], nu[M_MAX][2];
} book;

/* Mean and covariance of the estimates pooled with weights w. */
static void book_pool(wide *mean, wide (*cov)[N_MAX], const wide *w)
{
    int i, a, b;

    for (a = 0; a < in.n; a++)
        for (mean[a] = 0, i = 0; i < in.M; i++)
            mean[a] += w[i] * book.x[i][a];
    for (a = 0; a < in.n; a++)
        for (b = 0; b < in.n; b++)
            for (cov[a][b] = 0, i = 0; i < in.M; i++)
                cov[a][b] += w[i] * (book.P[i][a][b] + (book.x[i][a] - mean[a])
                                     * (book.x[i][b] - mean[b]));
}

/* w = exp(e) / sum; returns log sum. */
static wide book_weights(wide *w, const wide *e)
{
    wide max = e[0], sum = 0;
    int i;

    for (i = 1; i < in.M; i++)
        max = fmaxl(max, e[i]);
    if (max == -(wide)INFINITY)
        return max;
    for (i = 0; i < in.M; i++)
        sum += w[i] = expl(e[i] - max);
    for (i = 0; i < in.M; i++)
        w[i] /= sum;
    return max + logl(sum);
}

static void book_start(void)
{
    int i, j, k, n = in.n;

    for (j = 0; j < in.M; j++) {
        book.logmu[j] = logl(in.mu[j]);
        for (i = 0; i < n; i++) {
            book.x[j][i] = in.x[j * n + i];
            for (k = 0; k < n; k++)
                book.P[j][i][k] = in.P[(j * n + i) * n + k];
        }
    }
}

/* Predict and update of mode j in place; S as 2 x 2, bordered if m is 1. */
static wide book_filter(int j, wide *x, wide (*P)[N_MAX], const jl_real *z)
{
    wide y[N_MAX], Q[N_MAX][N_MAX], HP[2][N_MAX] = { { 0 } };
    wide S[2][2] = { { 1, 0 }, { 0, 1 } }, nu[2] = { 0, 0 }, det, K, I[2][2];
    int n = in.n, m = in.m, a, b, c, d;
    const jl_real *F = in.F[j], *H = in.H[j];

    for (a = 0; a < n; a++) {
        y[a] = (wide)in.G[j][a] * in.w_bar[j];
        for (b = 0; b < n; b++) {
            y[a] += F[a * n + b] * x[b];
            Q[a][b] = (wide)in.G[j][a] * in.G[j][b];
            for (c = 0; c < n; c++)
                for (d = 0; d < n; d++)
                    Q[a][b] += F[a * n + c] * P[c][d] * F[b * n + d];
        }
    }
    memcpy(x, y, sizeof y);
    memcpy(P, Q, sizeof Q);
    if (z == NULL)
        return 0;
    for (a = 0; a < m; a++) {
        nu[a] = z[a];
        for (b = 0; b < n; b++) {
            nu[a] -= H[a * n + b] * y[b];
            for (c = 0; c < n; c++)
                HP[a][b] += H[a * n + c] * Q[c][b];
        }
    }
    for (a = 0; a < m; a++)
        for (b = 0; b < m; b++)
            for (S[a][b] = in.R[j][a * m + b], c = 0; c < n; c++)
                S[a][b] += HP[a][c] * H[b * n + c];
    det = S[0][0] * S[1][1] - S[0][1] * S[1][0];
    I[0][0] = S[1][1] / det;
    I[1][1] = S[0][0] / det;
    I[0][1] = I[1][0] = -S[0][1] / det;
    for (a = 0; a < n; a++)
        for (b = 0; b < 2; b++) {
            K = HP[0][a] * I[0][b] + HP[1][a] * I[1][b];
            x[a] += K * nu[b];
            for (c = 0; c < n; c++)
                P[a][c] -= K * HP[b][c];
        }
    memcpy(book.nu[j], nu, sizeof nu);
    book.nis[j] = nu[0] * nu[0] * I[0][0] + 2 * nu[0] * nu[1] * I[0][1]
        + nu[1] * nu[1] * I[1][1];
    return -(m * logl(2 * acosl(-1)) + logl(det) + book.nis[j]) / 2;
}

static void book_step(const jl_real *z)
{
    static wide x[M_MAX][N_MAX], P[M_MAX][N_MAX][N_MAX];
    wide e[M_MAX], w[M_MAX], logc[M_MAX];
    int i, j, M = in.M;

    for (j = 0; j < M; j++) {
        for (i = 0; i < M; i++)
            e[i] = logl(in.Pi[i * M + j]) + book.logmu[i];
        logc[j] = book_weights(w, e);
        if (logc[j] == -(wide)INFINITY) {
            memcpy(x[j], book.x[j], sizeof x[j]);
            memcpy(P[j], book.P[j], sizeof P[j]);
        } else {
            book_pool(x[j], P[j], w);
        }
    }
    for (j = 0; j < M; j++)
        book.logmu[j] = logc[j] + book_filter(j, x[j], P[j], z);
    memcpy(book.x, x, sizeof x);
    memcpy(book.P, P, sizeof P);
    book.loglik = book_weights(w, book.logmu);
    for (j = 0; j < M; j++)
        book.logmu[j] -= book.loglik;
    if (z == NULL)
        book.loglik = 0;
    book_pool(book.xhat, book.Phat, w);
}

/* All of it within tolerance, log probabilities within tolerance_log. */
static void check_book(const jl_imm *imm, double tolerance,
                       double tolerance_log)
{
    jl_real P[N_MAX * N_MAX];
    int n = in.n, i, j, k;

    for (j = 0; j < in.M; j++) {
        if (book.logmu[j] == -(wide)INFINITY) {
            assert_true(jl_imm_logmu(imm, j) == -INF_ && imm->mu[j] == 0);
        } else {
            assert_close(jl_imm_logmu(imm, j), book.logmu[j], tolerance_log);
            assert_close(imm->mu[j], expl(book.logmu[j]), tolerance_log);
        }
        jl_imm_cov(imm, j, P);
        for (i = 0; i < n; i++) {
            assert_close(imm->x[j * n + i], book.x[j][i], tolerance);
            for (k = 0; k < n; k++)
                assert_close(P[i * n + k], book.P[j][i][k], tolerance);
        }
        check_symmetric(P, n);
    }
    for (i = 0; i < n; i++) {
        assert_close(imm->xhat[i], book.xhat[i], tolerance);
        for (k = 0; k < n; k++)
            assert_close(imm->Phat[i * n + k], book.Phat[i][k], tolerance);
    }
    check_symmetric(imm->Phat, n);
    assert_close(imm->loglik, book.loglik, tolerance_log);
}

/* --- init, chain, set --------------------------------------------------- */

static int init_status(int M, int mixing, int cap)
{
    int status;

    memcpy(&before, &rig, sizeof rig);
    status = jl_imm_init(&rig.imm, M, rig.modes, &jl_kf_standard, mixing,
                         rig.mem + EDGE, cap);
    assert_same_bits(&rig, &before, sizeof rig);
    return status;
}

static void test_imm_init_refuses(void **state)
{
    jl_mode keep;

    (void)state;
    make(3, 2, 1);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    assert_int_equal(init_status(0, 0, MEM), JL_EDIM);
    assert_int_equal(init_status(-1, 0, MEM), JL_EDIM);
    assert_int_equal(init_status(JL_MAX_MODES + 1, 0, INT_MAX), JL_EDIM);
    assert_int_equal(init_status(3, 2, MEM), JL_EDIM);
    assert_int_equal(init_status(3, -1, MEM), JL_EDIM);
    assert_int_equal(init_status(3, 0, JL_IMM_STATE(3, 2, 1) - 1), JL_ENOMEM);
    assert_int_equal(init_status(1, 0, JL_IMM_STATE(1, 2, 1) - 1), JL_ENOMEM);
    assert_int_equal(init_status(3, 0, 0), JL_ENOMEM);
    assert_int_equal(init_status(3, 0, -1), JL_ENOMEM);
    keep = rig.modes[2];
    rig.modes[2].n = 1;
    assert_int_equal(init_status(3, 0, MEM), JL_EDIM);
    rig.modes[2] = keep;
    rig.modes[2].m = 2;
    assert_int_equal(init_status(3, 0, MEM), JL_EDIM);
    rig.modes[2] = keep;
    rig.modes[2].p = 2;                 /* noises may differ */
    assert_int_equal(jl_imm_init(&rig.imm, 3, rig.modes, &jl_kf_joseph, 0,
                                 rig.mem + EDGE, JL_IMM_STATE(3, 2, 1)), JL_OK);
}

static void test_imm_init_state(void **state)
{
    jl_imm *a = &rig.imm;
    int i, j, k;

    (void)state;
    make(3, 2, 1);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    assert_int_equal(jl_imm_init(a, 3, rig.modes, &jl_kf_standard,
                                 JL_MIX_GENERAL, rig.mem + EDGE,
                                 JL_IMM_STATE(3, 2, 1)), JL_OK);
    check_edges(&rig);
    assert_true(a->M == 3 && a->n == 2 && a->m == 1);
    assert_ptr_equal(a->modes, rig.modes);
    assert_ptr_equal(a->form, &jl_kf_standard);
    for (j = 0; j < 3; j++) {
        assert_close(a->mu[j], 1 / 3.0, EPS);
        assert_close(jl_imm_logmu(a, j), -log(3), 2 * EPS);
        for (i = 0; i < 3; i++)
            assert_true(a->Pi[i * 3 + j] == (jl_real)(i == j));
        for (i = 0; i < 2; i++) {
            assert_true(a->x[j * 2 + i] == 0);
            for (k = 0; k < 2; k++)
                assert_true(a->P[j * 4 + i * 2 + k] == (jl_real)(i == k));
        }
    }
    jl_imm_combine(a);
    for (i = 0; i < 2; i++) {
        assert_true(a->xhat[i] == 0);
        for (k = 0; k < 2; k++)
            assert_close(a->Phat[i * 2 + k], i == k, 2 * EPS);
    }
}

/* The identity that init leaves is the one that chain sets. */
static void test_imm_init_chain(void **state)
{
    jl_real z[Z_MAX];
    int mixing;

    (void)state;
    for (mixing = 0; mixing <= 1; mixing++) {
        make(3, 2, 1);
        make_sticky(1);
        make_z(z);
        bind(&twin, &jl_kf_joseph, mixing);
        bind(&rig, &jl_kf_joseph, mixing);
        jl_imm_init(&rig.imm, 3, rig.modes, &jl_kf_joseph, mixing,
                    rig.mem + EDGE, JL_IMM_STATE(3, 2, 1));
        jl_imm_set(&rig.imm, in.x, in.P, in.mu, spoilt());
        assert_int_equal(rig.imm.sticky, twin.imm.sticky);
        assert_int_equal(step(&rig, z), JL_OK);
        assert_int_equal(step(&twin, z), JL_OK);
        check_same(&rig.imm, &twin.imm);
    }
}

/* As many modes as there may be. */
static void test_imm_most_modes(void **state)
{
    enum { MOST = JL_MAX_MODES };
    static jl_mode modes[MOST];
    static jl_real mode_mem[MOST][JL_MODE_MEM(1, 1, 1)];
    static jl_real mem[2][JL_IMM_STATE(MOST, 1, 1)], mu[MOST], Pi[MOST * MOST];
    static jl_real work[JL_IMM_SCRATCH(MOST, 1, 1)], ones[MOST], zeros[MOST];
    const jl_real one = 1, half = JL_C(0.5), z = JL_C(0.25);
    jl_real rate, sum = 0;
    jl_imm imm[2];
    int i, j;

    (void)state;
    for (j = 0; j < MOST; j++) {
        rate = (jl_real)j / MOST;
        jl_mode_init(&modes[j], 1, 1, 1, mode_mem[j], JL_MODE_MEM(1, 1, 1));
        jl_mode_set(&modes[j], &rate, &one, &half, &rate, &one, &one, work);
        mu[j] = 1 / (jl_real)MOST;
        ones[j] = 1;
        for (i = 0; i < MOST; i++)
            Pi[i * MOST + j] = 1 / (jl_real)MOST;
    }
    for (i = 0; i < 2; i++) {
        assert_int_equal(jl_imm_init(&imm[i], MOST, modes, &jl_kf_joseph,
                                     i == 0 ? JL_MIX_AUTO : JL_MIX_GENERAL,
                                     mem[i], JL_IMM_STATE(MOST, 1, 1)), JL_OK);
        assert_int_equal(jl_imm_chain(&imm[i], Pi), JL_OK);
        assert_int_equal(jl_imm_set(&imm[i], zeros, ones, mu, work), JL_OK);
        for (j = 0; j < 3; j++)
            assert_int_equal(jl_imm_step(&imm[i], &z, work), JL_OK);
    }
    assert_close(imm[0].xhat[0], imm[1].xhat[0], 1000 * EPS);
    assert_close(imm[0].Phat[0], imm[1].Phat[0], 1000 * EPS);
    for (j = 0; j < MOST; j++)
        sum += imm[1].mu[j];
    assert_close(sum, 1, 256 * EPS);
}

static int chain_status(void)
{
    int status;

    memcpy(&before, &rig, sizeof rig);
    status = jl_imm_chain(&rig.imm, in.Pi);
    if (status != JL_OK)
        assert_same_bits(&rig, &before, sizeof rig);
    return status;
}

static void test_imm_chain_refuses(void **state)
{
    const jl_real bad[] = { NAN_, INF_, -INF_ };
    jl_real keep;
    int i, k;

    (void)state;
    make(3, 2, 1);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    for (i = 0; i < 9; i++) {
        keep = in.Pi[i];
        for (k = 0; k < 3; k++) {
            in.Pi[i] = bad[k];
            assert_int_equal(chain_status(), JL_ENONFINITE);
        }
        in.Pi[i] = keep + 2 * JL_PROB_TOLERANCE;
        assert_int_equal(chain_status(), JL_EPROB);
        in.Pi[i] = -keep;
        assert_int_equal(chain_status(), JL_EPROB);
        in.Pi[i] = keep;
    }
    assert_int_equal(chain_status(), JL_OK);
    assert_same_bits(rig.imm.Pi, in.Pi, 9 * sizeof *in.Pi);
}

static int set_status(void)
{
    int status;

    memcpy(&before, &rig, sizeof rig);
    status = jl_imm_set(&rig.imm, in.x, in.P, in.mu, spoilt());
    check_edges(&rig);
    if (status != JL_OK)
        assert_same_bits(&rig, &before, sizeof rig);
    return status;
}

static void check_poison(jl_real *a, int count, jl_real value, int expected)
{
    jl_real keep;
    int i;

    for (i = 0; i < count; i++) {
        keep = a[i];
        a[i] = value;
        assert_int_equal(set_status(), expected);
        a[i] = keep;
    }
}

static void test_imm_set_refuses(void **state)
{
    const jl_real bad[] = { NAN_, INF_, -INF_, JL_LARGE * 2 };
    int j, k;

    (void)state;
    make(3, 2, 1);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    step(&rig, NULL);
    for (k = 0; k < 4; k++) {
        check_poison(in.x, 6, bad[k], JL_ENONFINITE);
        if (k < 3) {
            check_poison(in.P, 12, bad[k], JL_ENONFINITE);
            check_poison(in.mu, 3, bad[k], JL_ENONFINITE);
        }
    }
    check_poison(in.mu, 3, JL_C(-0.1), JL_EPROB);
    check_poison(in.mu, 3, 1, JL_EPROB);
    for (j = 0; j < 3; j++) {
        in.P[j * 4 + 1] += JL_C(0.01);
        assert_int_equal(set_status(), JL_EASYM);
        in.P[j * 4 + 1] = in.P[j * 4 + 2] = 5;
        assert_int_equal(set_status(), JL_EDEF);
        make_cov(in.P + j * 4, 2, 1);
    }
    in.mu[0] = in.mu[2] = 0;            /* impossible and certain modes */
    in.mu[1] = 1;
    assert_int_equal(set_status(), JL_OK);
    assert_same_bits(rig.imm.x, in.x, 6 * sizeof *in.x);
    assert_same_bits(rig.imm.P, in.P, 12 * sizeof *in.P);
    assert_same_bits(rig.imm.mu, in.mu, 3 * sizeof *in.mu);
    assert_true(jl_imm_logmu(&rig.imm, 0) == -INF_);
    assert_true(jl_imm_logmu(&rig.imm, 1) == 0);
    in.P[9] *= 1 + 2 * JL_EPSILON;      /* P is symmetric all the same */
    assert_int_equal(set_status(), JL_OK);
    check_symmetric(rig.imm.P + 8, 2);
}

/* --- the chain's kind --------------------------------------------------- */

static int is_sticky(void)
{
    assert_int_equal(jl_imm_chain(&rig.imm, in.Pi), JL_OK);
    return rig.imm.sticky;
}

static void test_imm_sticky_is_found_out(void **state)
{
    const jl_real apart = JL_REAL_FLOAT ? JL_C(1.0e-5) : JL_C(1.0e-6);
    jl_real p, sojourn[M_MAX] = { 20, 20, 20, 20, 20, 20 };
    int M, k, i, j;

    (void)state;
    for (M = 1; M <= M_MAX; M++) {
        make(M, 2, 1);
        bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
        bind(&twin, &jl_kf_joseph, JL_MIX_GENERAL);
        for (k = 0; k <= 4; k++) {      /* from i.i.d. to the identity */
            make_sticky((jl_real)k / 4);
            assert_int_equal(is_sticky(), 1);
            jl_imm_chain(&twin.imm, in.Pi);
            assert_int_equal(twin.imm.sticky, 0);
        }
        jl_chain_sojourn(in.Pi, sojourn, M, 1);
        assert_int_equal(is_sticky(), 1);
        for (i = 0; i < M * M && M > 2; i++) {
            make_sticky(JL_C(0.5));     /* an entry unlike its column */
            j = i % M == i / M ? i / M * M + (i + 1) % M : i;
            p = in.Pi[j] * apart;
            in.Pi[j] += p;
            in.Pi[j / M * (M + 1)] -= p;
            assert_int_equal(is_sticky(), 0);
        }
    }
    sojourn[1] = 10;
    jl_chain_sojourn(in.Pi, sojourn, M_MAX, 1);
    assert_int_equal(is_sticky(), 0);
    make(2, 2, 1);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    for (k = 0; k < 100; k++) {
        make_chain();
        p = in.Pi[0] + in.Pi[3] - 1;
        if (fabs((double)p) > 8 * EPS)
            assert_int_equal(is_sticky(), p > 0);
    }
    in.Pi[0] = in.Pi[3] = 0;            /* jumps every time: lambda = -1 */
    in.Pi[1] = in.Pi[2] = 1;
    assert_int_equal(is_sticky(), 0);
    make(3, 2, 1);                      /* lambda < 0 */
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    for (i = 0; i < 9; i++)
        in.Pi[i] = i % 4 == 0 ? JL_C(0.25) : JL_C(0.375);
    assert_int_equal(is_sticky(), 0);
}

/* --- against the book --------------------------------------------------- */

/* steps steps of both mixings, the chain being changed before each. */
static void check_both_mixings(int f, int M, int kind, int steps)
{
    jl_real z[Z_MAX];
    int k;

    make(M, 1 + M % N_MAX, 1 + M % Z_MAX);
    if (kind != 0)
        make_sticky(1);
    bind(&rig, forms[f], JL_MIX_AUTO);
    bind(&twin, forms[f], JL_MIX_GENERAL);
    book_start();
    for (k = 0; k < steps; k++) {
        const jl_real *given = k % 9 == 4 ? NULL : z;

        make_z(z);
        if (kind == 0)
            make_chain();
        else
            make_sticky(kind == 1 ? 0 : (1 + rnd()) / 2);
        jl_imm_chain(&rig.imm, in.Pi);
        jl_imm_chain(&twin.imm, in.Pi);
        if (kind != 0)
            assert_int_equal(rig.imm.sticky, 1);
        assert_int_equal(twin.imm.sticky, 0);
        assert_int_equal(step(&rig, given), JL_OK);
        assert_int_equal(step(&twin, given), JL_OK);
        book_step(given);
        check_book(&rig.imm, 5000 * EPS, 5000 * EPS);
        check_book(&twin.imm, 5000 * EPS, 5000 * EPS);
    }
}

static void test_imm_general_chains(void **state)
{
    int f, M;

    (void)state;
    for (f = 0; f < FORMS; f++)
        for (M = 1; M <= M_MAX; M++)
            check_both_mixings(f, M, 0, 30);
}

static void test_imm_sticky_equals_general(void **state)
{
    int f, M;

    (void)state;
    for (f = 0; f < FORMS; f++)
        for (M = 1; M <= M_MAX; M++)
            check_both_mixings(f, M, 1 + f % 2, 30);
}

/* Of every mode, what its update tells and its mean since set, and its
 * covariance. */
static void test_imm_innovations(void **state)
{
    jl_real z[Z_MAX], P[N_MAX * N_MAX];
    double sum[M_MAX];
    int run, i, j, k, count;

    (void)state;
    for (run = 0; run < 2 * FORMS; run++) {
        make(4, 3, 1 + run % 2);
        bind(&rig, forms[run / 2], JL_MIX_AUTO);
        book_start();
        memset(sum, 0, sizeof sum);
        for (count = k = 0; k < 30; k++) {
            const jl_real *given = k % 9 == 4 ? NULL : z;

            make_z(z);
            assert_int_equal(step(&rig, given), JL_OK);
            book_step(given);
            count += given != NULL;
            assert_int_equal(rig.imm.accepted, count);
            for (j = 0; j < 4; j++) {
                double nis = (double)book.nis[j];

                sum[j] += given != NULL ? nis : 0;
                assert_close(rig.imm.nis[j], given != NULL ? nis : 0,
                             2000 * EPS * (1 + nis));
                assert_close(rig.imm.nis_mean[j], sum[j] / count,
                             2000 * EPS * (1 + sum[j] / count));
                for (i = 0; i < in.m; i++)
                    assert_close(rig.imm.nu[j * in.m + i], book.nu[j][i],
                                 5000 * EPS);
                jl_imm_cov(&rig.imm, j, P);
                for (i = 0; i < 9; i++)
                    assert_close(P[i], book.P[j][i / 3][i % 3], 5000 * EPS);
            }
        }
    }
}

/* After weeks at a kilohertz where a long has 32 bits. */
static void test_imm_counts_do_not_wrap(void **state)
{
    const jl_real z = 1, absurd = JL_REAL_MAX;
    int j, k;

    (void)state;
    make(3, 2, 1);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    rig.imm.accepted = ULONG_MAX - 1;
    for (j = 0; j < 3; j++)
        rig.imm.nis_mean[j] = 1;
    for (k = 0; k < 3; k++) {
        assert_int_equal(step(&rig, &z), JL_OK);
        assert_true(rig.imm.accepted == ULONG_MAX);
        for (j = 0; j < 3; j++)
            assert_close(rig.imm.nis_mean[j], 1, 0.1);
    }
    jl_imm_gate(&rig.imm, JL_C(1.0e-9), 2);
    rig.imm.run = INT_MAX;              /* what is absurd is never given in to */
    for (k = 0; k < 3; k++) {
        assert_int_equal(step(&rig, &absurd), JL_OK);
        assert_int_equal(rig.imm.run, INT_MAX);
    }
}

/* k sigma away from every mode. */
static void check_outlier(const jl_kf_form *form, int mixing,
                          jl_real distance)
{
    jl_real z[Z_MAX];
    double size;

    make(4, 3, 2);
    make_sticky(JL_C(0.9));
    bind(&rig, form, mixing);
    book_start();
    z[0] = distance;
    z[1] = -distance;
    assert_int_equal(step(&rig, z), JL_OK);
    book_step(z);
    size = fabs((double)book.loglik);
    check_book(&rig.imm, 1000 * EPS * (double)(distance * distance),
               1000 * EPS * size);
    make_z(z);                          /* and it comes back */
    assert_int_equal(step(&rig, z), JL_OK);
    assert_int_equal(step(&rig, NULL), JL_OK);
    assert_true(jl_vec_within(rig.imm.xhat, 3, JL_LARGE));
    assert_true(jl_vec_within(rig.imm.mu, 4, 1));
}

static void test_imm_outliers(void **state)
{
    int run;

    (void)state;
    for (run = 0; run < 2 * FORMS; run++) {
        check_outlier(forms[run / 2], run % 2, 60);
        check_outlier(forms[run / 2], run % 2, 1500);
        check_outlier(forms[run / 2], run % 2, 1000000);
    }
}

/* Modes that a measurement does not tell apart keep their probabilities, also
 * when the likelihoods' logarithms are so large that log mu is below their
 * last digit. */
static void test_imm_outlier_keeps_the_prior(void **state)
{
    jl_real distance, z[Z_MAX];
    int j;

    (void)state;
    for (distance = 10; distance < JL_C(1.0e7); distance *= 10) {
        make(2, 3, 1);
        make_alike();
        for (j = 0; j < 4; j++)
            in.Pi[j] = j % 3 == 0;
        in.mu[0] = JL_C(0.9);
        in.mu[1] = JL_C(0.1);
        bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
        z[0] = distance;
        assert_int_equal(step(&rig, z), JL_OK);
        assert_close(rig.imm.mu[0], 0.9, 8 * EPS);
        assert_close(jl_imm_logmu(&rig.imm, 0), log(0.9), 8 * EPS);
    }
}

/* mu = Pi' mu, and only that. */
static void test_imm_missing_measurement(void **state)
{
    jl_real mu[M_MAX];
    int i, j, k;

    (void)state;
    make(4, 2, 1);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    for (k = 0; k < 5; k++) {
        for (j = 0; j < 4; j++)
            for (mu[j] = 0, i = 0; i < 4; i++)
                mu[j] += in.Pi[i * 4 + j] * rig.imm.mu[i];
        rig.imm.loglik = 5;
        assert_int_equal(step(&rig, NULL), JL_OK);
        assert_true(rig.imm.loglik == 0);
        for (j = 0; j < 4; j++) {
            assert_close(rig.imm.mu[j], mu[j], 8 * EPS);
            assert_close(jl_imm_logmu(&rig.imm, j), log((double)mu[j]), 32 * EPS);
        }
    }
}

/* What a permutation of the modes permutes. */
static void test_imm_modes_in_another_order(void **state)
{
    static const int to[5] = { 3, 0, 4, 1, 2 };
    jl_real z[Z_MAX], Pi[25], x[15], P[45], mu[5];
    int i, j, k;

    (void)state;
    make(5, 3, 2);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    bind(&twin, &jl_kf_joseph, JL_MIX_AUTO);
    for (i = 0; i < 5; i++) {
        jl_real q = 1;

        jl_mode_set(&twin.modes[to[i]], in.F[i], in.G[i], &q, &in.w_bar[i],
                    in.H[i], in.R[i], scratch);
        for (j = 0; j < 5; j++)
            Pi[to[i] * 5 + to[j]] = in.Pi[i * 5 + j];
        memcpy(x + to[i] * 3, in.x + i * 3, 3 * sizeof *x);
        memcpy(P + to[i] * 9, in.P + i * 9, 9 * sizeof *P);
        mu[to[i]] = in.mu[i];
    }
    jl_imm_chain(&twin.imm, Pi);
    jl_imm_set(&twin.imm, x, P, mu, spoilt());
    for (k = 0; k < 20; k++) {
        make_z(z);
        step(&rig, z);
        step(&twin, z);
        assert_close(rig.imm.loglik, twin.imm.loglik, 2000 * EPS);
        for (i = 0; i < 3; i++)
            assert_close(rig.imm.xhat[i], twin.imm.xhat[i], 2000 * EPS);
        for (i = 0; i < 5; i++) {
            assert_close(rig.imm.mu[i], twin.imm.mu[to[i]], 2000 * EPS);
            for (j = 0; j < 9; j++)
                assert_close(rig.imm.P[i * 9 + j],
                             twin.imm.P[to[i] * 9 + j], 2000 * EPS);
        }
    }
}

/* --- against Kalman filters --------------------------------------------- */

static jl_real kf_mem[2][JL_KF_STATE(N_MAX, N_MAX)];

static void make_kf(jl_kf *kf, int j, int slot)
{
    jl_kf_init(kf, &rig.modes[j], rig.imm.form, kf_mem[slot],
               JL_KF_STATE(in.n, in.m));
    jl_kf_set(kf, in.x + j * in.n, in.P + j * in.n * in.n, scratch);
}

static void check_mode_is(const jl_kf *kf, int j)
{
    size_t n = (size_t)in.n;

    assert_same_bits(rig.imm.x + (size_t)j * n, kf->x, n * sizeof *kf->x);
    assert_same_bits(rig.imm.P + (size_t)j * n * n, kf->P,
                     n * n * sizeof *kf->P);
}

static void test_imm_of_one_mode_is_a_kf(void **state)
{
    jl_real z[Z_MAX], loglik, P[9];
    jl_kf kf;
    int run, k;

    (void)state;
    for (run = 0; run < 2 * FORMS; run++) {
        make(1, 3, 2);
        in.Pi[0] = 1;
        in.mu[0] = 1;
        bind(&rig, forms[run / 2], run % 2);
        make_kf(&kf, 0, 0);
        for (k = 0; k < 40; k++) {
            const jl_real *given = k % 7 == 3 ? NULL : z;

            make_z(z);
            if (k == 20)
                z[0] = 1.0e6f;
            assert_int_equal(step(&rig, given), JL_OK);
            assert_int_equal(jl_kf_step(&kf, &loglik, given, scratch), JL_OK);
            check_mode_is(&kf, 0);
            assert_same_bits(&rig.imm.loglik, &loglik, sizeof loglik);
            assert_same_bits(rig.imm.xhat, kf.x, 3 * sizeof *kf.x);
            jl_kf_cov(&kf, P);
            assert_same_bits(rig.imm.Phat, P, sizeof P);
            assert_true(rig.imm.mu[0] == 1 && jl_imm_logmu(&rig.imm, 0) == 0);
        }
    }
}

/* Modes that are the same, whatever the chain: there is nothing to tell. */
static void test_imm_of_equal_modes_is_a_kf(void **state)
{
    jl_real z[Z_MAX], loglik;
    jl_kf kf;
    int run, j, k, i;

    (void)state;
    for (run = 0; run < 4; run++) {
        make(3, 2, 2);
        make_alike();
        if (run >= 2)
            make_sticky(run == 2 ? 0 : JL_C(0.75));
        bind(&rig, &jl_kf_joseph, run % 2);
        make_kf(&kf, 0, 0);
        for (k = 0; k < 3; k++) {
            make_z(z);
            step(&rig, z);
            jl_kf_step(&kf, &loglik, z, scratch);
            assert_close(rig.imm.loglik, loglik, 100 * EPS);
            for (i = 0; i < 2; i++)
                assert_close(rig.imm.xhat[i], kf.x[i], 100 * EPS);
            for (i = 0; i < 4; i++)
                assert_close(rig.imm.Phat[i], kf.P[i], 100 * EPS);
        }
        for (j = 0; j < 3 && run == 2; j++)
            assert_close(rig.imm.mu[j], in.Pi[j], 100 * EPS);
    }
}

/* A mode that cannot be entered filters alone, and does no harm. */
static void check_unreachable(const jl_kf_form *form, int mixing,
                              const jl_real *Pi)
{
    jl_real z[Z_MAX];
    jl_kf kf;
    int k;

    make(3, 2, 1);
    memcpy(in.Pi, Pi, 9 * sizeof *Pi);
    in.mu[0] = JL_C(0.375);
    in.mu[1] = JL_C(0.625);
    in.mu[2] = 0;
    bind(&rig, form, mixing);
    make_kf(&kf, 2, 0);
    book_start();
    for (k = 0; k < 20; k++) {
        make_z(z);
        assert_int_equal(step(&rig, k == 5 ? NULL : z), JL_OK);
        jl_kf_step(&kf, NULL, k == 5 ? NULL : z, scratch);
        book_step(k == 5 ? NULL : z);
        check_mode_is(&kf, 2);
        check_book(&rig.imm, 5000 * EPS, 5000 * EPS);
    }
    make_sticky(JL_C(0.5));             /* now it can */
    jl_imm_chain(&rig.imm, in.Pi);
    assert_int_equal(step(&rig, z), JL_OK);
    book_step(z);
    check_book(&rig.imm, 5000 * EPS, 5000 * EPS);
    assert_true(rig.imm.mu[2] > 0);
}

static void test_imm_mode_that_cannot_be_entered(void **state)
{
    static const jl_real chains[3][9] = {
        { JL_C(0.9), JL_C(0.1), 0, JL_C(0.2), JL_C(0.8), 0,
          JL_C(0.3), JL_C(0.3), JL_C(0.4) },
        { JL_C(0.75), JL_C(0.25), 0, JL_C(0.25), JL_C(0.75), 0,
          JL_C(0.25), JL_C(0.25), JL_C(0.5) },
        { JL_C(0.4), JL_C(0.6), 0, JL_C(0.4), JL_C(0.6), 0,
          JL_C(0.4), JL_C(0.6), 0 }
    };
    int k, run;

    (void)state;
    for (k = 0; k < 3; k++)
        for (run = 0; run < 2 * FORMS; run++) {
            check_unreachable(forms[run / 2], run % 2, chains[k]);
            jl_imm_chain(&rig.imm, chains[k]);
            assert_int_equal(rig.imm.sticky, k > 0 && run % 2 == JL_MIX_AUTO);
        }
}

/* Two modes that say 3 and -3 under a chain that never jumps: log mu is the
 * evidence, far below the smallest number, and turns when that turns. */
static void test_imm_evidence(void **state)
{
    jl_real z, l[2];
    jl_kf kf[2];
    wide odds, least = 0;
    int mixing, j, k;

    (void)state;
    for (mixing = 0; mixing <= 1; mixing++) {
        make(2, 1, 1);
        for (j = 0; j < 2; j++) {
            in.F[j][0] = JL_C(0.5);
            in.G[j][0] = JL_C(0.5);
            in.w_bar[j] = j == 0 ? 3 : -3;
            in.H[j][0] = 1;
            in.R[j][0] = 1;
        }
        make_sticky(1);
        bind(&rig, &jl_kf_joseph, mixing);
        make_kf(&kf[0], 0, 0);
        make_kf(&kf[1], 1, 1);
        odds = logl(in.mu[1]) - logl(in.mu[0]);
        for (k = 0; k < 2000; k++) {
            z = (k < 980 ? 3 : -3) + rnd() / 8;
            assert_int_equal(step(&rig, &z), JL_OK);
            for (j = 0; j < 2; j++) {
                jl_kf_step(&kf[j], &l[j], &z, scratch);
                check_mode_is(&kf[j], j);
            }
            odds += (wide)l[1] - l[0];
            least = fminl(least, odds);
            assert_close(jl_imm_logmu(&rig.imm, 1)
                         - jl_imm_logmu(&rig.imm, 0), odds,
                         2000 * 1000 * EPS);
            assert_close(rig.imm.mu[1], 1 / (1 + expl(-odds)),
                         2000 * 1000 * EPS);
            if (odds < -1000 && !JL_REAL_FLOAT)
                assert_true(rig.imm.mu[1] == 0);
        }
        assert_true(least < -1000);
        assert_true(rig.imm.mu[1] > JL_C(0.9));
        assert_close(rig.imm.xhat[0], kf[1].x[0], 0.1);
    }
}

/* An improbable mode that is left but never entered, below every number. */
static void test_imm_underflow_under_jumps(void **state)
{
    jl_real z;
    int mixing, j, k;

    (void)state;
    for (mixing = 0; mixing <= 1; mixing++) {
        make(2, 1, 1);
        for (j = 0; j < 2; j++) {
            in.F[j][0] = in.G[j][0] = JL_C(0.5);
            in.w_bar[j] = j == 0 ? 3 : -3;
            in.H[j][0] = in.R[j][0] = 1;
        }
        in.Pi[0] = 1;
        in.Pi[1] = 0;
        in.Pi[2] = in.Pi[3] = JL_C(0.5);
        bind(&rig, &jl_kf_joseph, mixing);
        assert_int_equal(rig.imm.sticky, mixing == JL_MIX_AUTO);
        book_start();
        for (k = 0; k < 500; k++) {
            z = 3 + rnd() / 8;
            assert_int_equal(step(&rig, &z), JL_OK);
            book_step(&z);
            check_book(&rig.imm, 5000 * EPS, 500 * 1000 * EPS);
        }
        assert_true(book.logmu[1] < -1000);
        in.Pi[2] = in.Pi[3] = JL_C(0.5);    /* open again: back at once */
        in.Pi[0] = in.Pi[1] = JL_C(0.5);
        jl_imm_chain(&rig.imm, in.Pi);
        for (k = 0; k < 20; k++) {
            z = -3;
            assert_int_equal(step(&rig, &z), JL_OK);
        }
        assert_true(rig.imm.mu[1] > JL_C(0.7));
    }
}

/* Two improbable modes jump to each other, below every number. */
static void test_imm_underflowed_modes_mix(void **state)
{
    static const jl_real Pi[9] = { 1, 0, 0, 0, JL_C(0.7), JL_C(0.3),
                                   0, JL_C(0.2), JL_C(0.8) };
    jl_real z;
    int mixing, j, k;

    (void)state;
    for (mixing = 0; mixing <= 1; mixing++) {
        make(3, 1, 1);
        for (j = 0; j < 3; j++) {
            in.F[j][0] = in.G[j][0] = JL_C(0.5);
            in.w_bar[j] = j == 0 ? 3 : (jl_real)(-2 - j);
            in.H[j][0] = in.R[j][0] = 1;
        }
        memcpy(in.Pi, Pi, sizeof Pi);
        bind(&rig, &jl_kf_joseph, mixing);
        book_start();
        for (k = 0; k < 300; k++) {
            z = 3 + rnd() / 8;
            assert_int_equal(step(&rig, &z), JL_OK);
            book_step(&z);
            check_book(&rig.imm, 1.0e5 * EPS, 300 * 1000 * EPS);
        }
        assert_true(book.logmu[1] < -1000 && book.logmu[2] < -1000);
    }
}

/* Improbable modes that know they are at 1000 stay there exactly: they come
 * from each other, or only from themselves. */
static void test_imm_improbable_modes_keep_their_estimate(void **state)
{
    static const jl_real chains[2][9] = {
        { 1, 0, 0, 0, JL_C(0.7), JL_C(0.3), 0, JL_C(0.3), JL_C(0.7) },
        { 1, 0, 0, JL_C(0.3), JL_C(0.7), 0, JL_C(0.3), 0, JL_C(0.7) }
    };
    jl_real z = 0;
    int run, j, k;

    (void)state;
    for (run = 0; run < 4; run++) {
        make(3, 1, 1);
        for (j = 0; j < 3; j++) {
            in.F[j][0] = in.H[j][0] = 1;
            in.G[j][0] = 0;
            in.R[j][0] = 100;
            in.x[j] = j == 0 ? 0 : 1000;
            in.P[j] = j == 0;
        }
        memcpy(in.Pi, chains[run / 2], sizeof chains[0]);
        bind(&rig, &jl_kf_joseph, run % 2);
        for (k = 1; k <= 20; k++) {
            assert_int_equal(step(&rig, &z), JL_OK);
            for (j = 1; j < 3; j++)
                assert_close(rig.imm.x[j], 1000, 4000 * k * EPS);
        }
        assert_true(jl_imm_logmu(&rig.imm, 1) < -50000);
    }
}

/* Two modes under a chain that never jumps, which say 2 and -2, and a third that
 * says anything, but is impossible.  S is about 1: z moves log mu_0 / mu_1 by
 * about 4 z. */
static void make_rivals(void)
{
    int i, j;

    make(3, 1, 1);
    for (j = 0; j < 3; j++) {
        in.F[j][0] = JL_C(0.5);
        in.G[j][0] = JL_C(0.25);
        in.w_bar[j] = j == 2 ? 0 : j == 0 ? 4 : -4;
        in.H[j][0] = 1;
        in.R[j][0] = j == 2 ? 100 : 1;
        in.mu[j] = j == 2 ? 0 : JL_C(0.5);
        for (i = 0; i < 3; i++)
            in.Pi[i * 3 + j] = (jl_real)(i == j);
    }
}

/* The probability of a mode falls by 1e-30 (float: 1e-6) a step until it is no
 * number, and comes back: its logarithm goes from one of a number to one that is
 * kept, and back, and no digit is lost. */
static void test_imm_probability_leaves_the_numbers_and_returns(void **state)
{
    const double least = log((double)JL_REAL_MIN);
    const jl_real push = JL_REAL_FLOAT ? JL_C(4.4) : 25;
    int run, k;

    (void)state;
    for (run = 0; run < 2 * FORMS; run++) {
        wide lowest = 0;

        make_rivals();
        bind(&rig, forms[run / 2], run % 2);
        book_start();
        for (k = 0; k < 60; k++) {
            jl_real z = (k < 20 ? push : -push) + rnd() / 8, mu;

            assert_int_equal(step(&rig, &z), JL_OK);
            book_step(&z);
            check_book(&rig.imm, 1000 * EPS, 60 * 1000 * EPS);
            mu = rig.imm.mu[1];
            if (mu > JL_REAL_MIN / JL_EPSILON / JL_EPSILON)
                assert_close(mu / expl(book.logmu[1]), 1, 60 * 1000 * EPS);
            lowest = fminl(lowest, book.logmu[1]);
        }
        assert_true(lowest < 1.5 * least);
        assert_true(rig.imm.mu[1] > JL_C(0.99));
    }
}

/* Evidence that goes up and down by as much as the range of numbers in a step:
 * what is likely then had next to no probability, and sums of what it had and
 * likelihoods are anything between 1 and nothing.  Estimates are as without. */
static void test_imm_sums_of_next_to_nothing(void **state)
{
    const wide least = logl((wide)JL_REAL_MIN);
    int run, k;

    (void)state;
    for (run = 0; run < 2 * FORMS; run++) {
        int turns = 0, below = 0;

        make_rivals();
        bind(&rig, forms[run / 2], run % 2);
        book_start();
        for (k = 0; k < 100; k++) {
            wide odds = book.logmu[0] - book.logmu[1];
            wide size = -least * (2 + rnd()) / 6;
            jl_real z = (jl_real)(odds > 0 ? -size : size);

            assert_int_equal(step(&rig, &z), JL_OK);
            book_step(&z);
            check_book(&rig.imm, 1.0e6 * EPS, 1.0e6 * EPS);
            turns += odds * (book.logmu[0] - book.logmu[1]) < 0;
            below += fminl(book.logmu[0], book.logmu[1]) < least;
        }
        assert_true(turns > 50 && below > 5 && below < 95);
    }
}

/* What all modes agree in, neither combining nor mixing moves. */
static void check_agreed(const jl_kf_form *form, int mixing)
{
    int j;

    for (j = 0; j < in.M; j++) {
        in.x[j] = 1.0e6f;
        in.P[j] = 1;
    }
    bind(&rig, form, mixing);
    assert_close(rig.imm.xhat[0], 1.0e6, 8.0e6 * EPS);
    assert_close(rig.imm.Phat[0], 1, 0.1);
    assert_int_equal(jl_imm_mix(&rig.imm, spoilt()), JL_OK);
    for (j = 0; j < in.M; j++) {
        assert_close(rig.imm.xw[j], 1.0e6, 8.0e6 * EPS);
        assert_close(rig.imm.Pw[j], 1, 0.1);
    }
}

/* ... nor where the sum of mu is 1 only within the tolerance, */
static void test_imm_mu_within_tolerance(void **state)
{
    int run, j;

    (void)state;
    for (run = 0; run < 4 * FORMS; run++) {
        make(3, 1, 1);
        if (run / 2 % 2)
            make_sticky(JL_C(0.85));
        for (j = 0; j < 3; j++)
            in.mu[j] = (1 + JL_C(0.9) * JL_PROB_TOLERANCE) / 3;
        check_agreed(forms[run / 4], run % 2);
    }
}

/* nor where a mode, and jumps to it, are as improbable as can be. */
static void test_imm_mode_that_is_hardly_entered(void **state)
{
    int run;

    (void)state;
    for (run = 0; run < 200; run++) {
        make(2, 1, 1);
        in.Pi[0] = 1;
        in.Pi[1] = JL_REAL_MIN * (2 + rnd());
        in.Pi[2] = in.Pi[3] = JL_C(0.5);
        in.mu[0] = 1;
        in.mu[1] = JL_REAL_MIN * (4 + rnd());
        check_agreed(forms[run % FORMS], run % 2);
        assert_int_equal(rig.imm.sticky, run % 2 == JL_MIX_AUTO);
    }
}

/* Estimates and covariances as large as they may be. */
static void test_imm_mixing_cannot_overflow(void **state)
{
    int run, i, j;

    (void)state;
    for (run = 0; run < 2 * FORMS; run++) {
        make(M_MAX, 1, 1);
        make_sticky(JL_C(0.5));
        for (j = 0; j < M_MAX; j++) {
            in.x[j] = j % 2 ? JL_LARGE : -JL_LARGE;
            in.P[j] = JL_LARGE * JL_LARGE;
        }
        bind(&rig, forms[run / 2], run % 2);
        jl_imm_combine(&rig.imm);
        assert_true(jl_vec_within(rig.imm.xhat, 1, JL_LARGE));
        assert_true(jl_vec_within(rig.imm.Phat, 1, JL_REAL_MAX));
        assert_int_equal(jl_imm_mix(&rig.imm, spoilt()), JL_OK);
        for (i = 0; i < M_MAX; i++) {
            assert_true(jl_vec_within(&rig.imm.xw[i], 1, JL_LARGE));
            assert_true(jl_vec_within(&rig.imm.Pw[i], 1, JL_REAL_MAX));
        }
    }
}

/* --- routes to the same bits -------------------------------------------- */

static void check_routes(int f, int mixing, int sticky)
{
    static struct rig parts, left, right;
    struct rig *owner, *guest;
    jl_real z[Z_MAX];
    int k, j;

    make(5, 3, 2);
    if (sticky)
        make_sticky(JL_C(0.8));
    bind(&rig, forms[f], mixing);
    bind(&twin, forms[f], mixing);
    bind(&parts, forms[f], mixing);
    bind(&left, forms[f], mixing);
    bind(&right, forms[f], mixing);
    for (k = 0; k < 25; k++) {
        const jl_real *given = k % 6 == 3 ? NULL : z;

        make_z(z);
        assert_int_equal(step(&rig, given), JL_OK);
        /* stages, with starts and combines in between */
        jl_imm_mix(&twin.imm, littered());
        if (k % 2) {
            jl_imm_combine(&twin.imm);
            assert_int_equal(jl_imm_filter(&twin.imm, z, littered()), JL_OK);
            jl_imm_mix(&twin.imm, littered());
        }
        assert_int_equal(jl_imm_filter(&twin.imm, given, littered()), JL_OK);
        if (k % 3 == 0)
            jl_imm_combine(&twin.imm);
        assert_int_equal(jl_imm_weigh(&twin.imm), JL_OK);
        if (k % 5)                      /* mix does not need it */
            jl_imm_combine(&twin.imm);
        /* pieces, the last mode first */
        jl_imm_foresee(&parts.imm);
        for (j = 5; j-- > 0;)
            jl_imm_mix_mode(&parts.imm, j, littered());
        for (j = 5; j-- > 0;)
            assert_int_equal(jl_imm_predict_mode(&parts.imm, j, littered()),
                             JL_OK);
        for (j = 5; j-- > 0;)
            assert_int_equal(jl_imm_update_mode(&parts.imm, j, given,
                                                littered()), JL_OK);
        assert_int_equal(jl_imm_judge(&parts.imm, given, littered()), JL_OK);
        assert_int_equal(jl_imm_weigh(&parts.imm), JL_OK);
        jl_imm_combine(&parts.imm);
        /* pieces on two processors */
        jl_imm_foresee(&left.imm);
        jl_imm_foresee(&right.imm);
        for (j = 0; j < 5; j++) {
            owner = j % 2 ? &left : &right;
            guest = j % 2 ? &right : &left;
            jl_imm_mix_mode(&owner->imm, j, spoilt());
            jl_imm_predict_mode(&owner->imm, j, spoilt());
            jl_imm_update_mode(&owner->imm, j, given, spoilt());
            guest->imm.l[j] = owner->imm.l[j];
            memcpy(guest->imm.xw + j * 3, owner->imm.xw + j * 3,
                   3 * sizeof(jl_real));
            memcpy(guest->imm.Pw + j * 9, owner->imm.Pw + j * 9,
                   9 * sizeof(jl_real));
        }
        assert_int_equal(jl_imm_judge(&left.imm, given, spoilt()), JL_OK);
        assert_int_equal(jl_imm_judge(&right.imm, given, spoilt()), JL_OK);
        assert_int_equal(jl_imm_weigh(&left.imm), JL_OK);
        assert_int_equal(jl_imm_weigh(&right.imm), JL_OK);
        jl_imm_combine(&left.imm);
        jl_imm_combine(&right.imm);
        check_same(&parts.imm, &rig.imm);
        check_same(&left.imm, &rig.imm);
        check_same(&right.imm, &rig.imm);
        if (k % 5)
            check_same(&twin.imm, &rig.imm);
    }
    check_edges(&parts);
    check_edges(&twin);
}

static void test_imm_routes_to_the_same_bits(void **state)
{
    int f;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        check_routes(f, JL_MIX_AUTO, 1);
        check_routes(f, JL_MIX_AUTO, 0);
        check_routes(f, JL_MIX_GENERAL, 1);
    }
}

static int filter_again(const jl_real *z)
{
    return jl_imm_filter(&rig.imm, z, spoilt());
}

static void test_imm_stages_out_of_order(void **state)
{
    jl_real z[Z_MAX];

    (void)state;
    make(3, 2, 2);
    make_z(z);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    bind(&twin, &jl_kf_joseph, JL_MIX_AUTO);
    memcpy(&before, &rig, sizeof rig);
    assert_int_equal(jl_imm_weigh(&rig.imm), JL_EORDER);
    assert_int_equal(filter_again(z), JL_EORDER);
    assert_int_equal(filter_again(NULL), JL_EORDER);
    assert_same_bits(&rig, &before, sizeof rig);
    assert_int_equal(jl_imm_mix(&rig.imm, spoilt()), JL_OK);
    assert_int_equal(jl_imm_weigh(&rig.imm), JL_EORDER);
    assert_int_equal(filter_again(z), JL_OK);
    assert_int_equal(filter_again(z), JL_EORDER);
    assert_int_equal(jl_imm_weigh(&rig.imm), JL_OK);
    jl_imm_combine(&rig.imm);
    step(&twin, z);
    check_same(&rig.imm, &twin.imm);
    memcpy(&before, &rig, sizeof rig);
    assert_int_equal(jl_imm_weigh(&rig.imm), JL_EORDER);
    assert_int_equal(filter_again(z), JL_EORDER);
    assert_same_bits(&rig, &before, sizeof rig);
    step(&rig, z);                      /* also after a whole step */
    step(&twin, z);
    assert_int_equal(jl_imm_weigh(&rig.imm), JL_EORDER);
    assert_int_equal(filter_again(z), JL_EORDER);
    check_same(&rig.imm, &twin.imm);
}

/* judge comes once, between update_mode and weigh; whatever ends the step, bars
 * both. */
static void test_imm_judge_out_of_order(void **state)
{
    jl_real z[Z_MAX];
    int end, j;

    (void)state;
    make(3, 2, 2);
    make_z(z);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    bind(&twin, &jl_kf_joseph, JL_MIX_AUTO);
    for (end = 0; end < 5; end++) {
        memcpy(&before, &rig, sizeof rig);
        assert_int_equal(jl_imm_judge(&rig.imm, z, spoilt()), JL_EORDER);
        assert_same_bits(&rig, &before, sizeof rig);
        assert_int_equal(jl_imm_mix(&rig.imm, spoilt()), JL_OK);
        assert_int_equal(jl_imm_judge(&rig.imm, z, spoilt()), JL_EORDER);
        for (j = 0; j < 3; j++) {
            assert_int_equal(jl_imm_predict_mode(&rig.imm, j, spoilt()),
                             JL_OK);
            assert_int_equal(jl_imm_update_mode(&rig.imm, j, z, spoilt()),
                             JL_OK);
        }
        assert_int_equal(jl_imm_weigh(&rig.imm), JL_EORDER);
        assert_int_equal(jl_imm_judge(&rig.imm, z, spoilt()), JL_OK);
        assert_int_equal(jl_imm_judge(&rig.imm, z, spoilt()), JL_EORDER);
        if (end == 0)
            jl_imm_chain(&rig.imm, in.Pi);
        else if (end == 1)
            jl_imm_set(&rig.imm, in.x, in.P, in.mu, spoilt());
        else if (end == 2)
            jl_imm_gate(&rig.imm, 0, 0);
        else if (end == 3)
            jl_imm_mix(&rig.imm, spoilt());
        else
            break;
        assert_int_equal(jl_imm_weigh(&rig.imm), JL_EORDER);
        assert_int_equal(jl_imm_judge(&rig.imm, z, spoilt()), JL_EORDER);
        check_same(&rig.imm, &twin.imm);
    }
    assert_int_equal(jl_imm_weigh(&rig.imm), JL_OK);
    jl_imm_combine(&rig.imm);
    step(&twin, z);
    check_same(&rig.imm, &twin.imm);
}

/* --- steps that fail ---------------------------------------------------- */

/* What is wrong: nothing, mode j's prediction, or its S. */
static void break_mode(struct rig *r, int j, int code)
{
    int i;

    for (i = 0; code == JL_ENONFINITE && i < in.n * in.n; i++)
        r->modes[j].F[i] = JL_REAL_MAX;
    for (i = 0; code == JL_ESINGULAR && i < in.m * in.m; i += in.m + 1)
        r->modes[j].R[i] = r->modes[j].V[i] = -1.0e6f;
}

/* twin never saw z. */
static void check_failure(const jl_real *z, int expected)
{
    assert_int_equal(step(&rig, z), expected);
    check_same(&rig.imm, &twin.imm);
    assert_int_equal(jl_imm_weigh(&rig.imm), JL_EORDER);
    assert_int_equal(jl_imm_mix(&rig.imm, spoilt()), JL_OK);
    assert_int_equal(filter_again(z), expected);
    check_same(&rig.imm, &twin.imm);
    assert_int_equal(jl_imm_weigh(&rig.imm), JL_EORDER);
    assert_int_equal(filter_again(z), JL_EORDER);
    check_same(&rig.imm, &twin.imm);
}

static void check_failures(int f, int mixing, int sticky)
{
    const jl_real bad[] = { NAN_, INF_, -INF_, JL_REAL_MAX };
    jl_real z[Z_MAX], keep;
    int k, j;

    make(4, 3, 2);
    if (sticky)
        make_sticky(JL_C(0.8));
    bind(&rig, forms[f], mixing);
    bind(&twin, forms[f], mixing);
    for (k = 0; k < 8; k++) {
        make_z(z);
        keep = z[k % 2];
        z[k % 2] = bad[k % 4];
        check_failure(z, JL_ENONFINITE);
        z[k % 2] = keep;
        j = k % 4;                      /* one mode fails, the others not */
        break_mode(&rig, j, JL_ENONFINITE);
        check_failure(z, JL_ENONFINITE);
        check_failure(NULL, JL_ENONFINITE);
        set_mode(&rig, j);
        break_mode(&rig, j, JL_ESINGULAR);
        check_failure(z, JL_ESINGULAR);
        if (j > 0) {                    /* the first that failed */
            break_mode(&rig, j - 1, JL_ENONFINITE);
            check_failure(z, JL_ENONFINITE);
            set_mode(&rig, j - 1);
        }
        if (j < 3)
            break_mode(&rig, j + 1, JL_ENONFINITE);
        check_failure(z, JL_ESINGULAR);
        set_mode(&rig, j);
        set_mode(&rig, (j + 1) % 4);
        assert_int_equal(step(&rig, z), JL_OK);
        assert_int_equal(step(&twin, z), JL_OK);
        check_same(&rig.imm, &twin.imm);
    }
}

static void test_imm_failed_step_leaves_no_trace(void **state)
{
    int f;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        check_failures(f, JL_MIX_AUTO, 1);
        check_failures(f, JL_MIX_AUTO, 0);
        check_failures(f, JL_MIX_GENERAL, 1);
    }
}

/* The pieces of a step; mode `bad` does not get through, the others do. */
static void check_failed_piece(int bad, int code)
{
    const jl_real z[Z_MAX] = { 1, 2 };
    int j, status;

    break_mode(&rig, bad, code);
    jl_imm_foresee(&rig.imm);
    for (j = 0; j < 3; j++) {
        jl_imm_mix_mode(&rig.imm, j, spoilt());
        status = jl_imm_predict_mode(&rig.imm, j, spoilt());
        if (status == JL_OK)
            status = jl_imm_update_mode(&rig.imm, j, z, spoilt());
        assert_int_equal(status, j == bad ? code : JL_OK);
    }
    assert_int_equal(jl_imm_weigh(&rig.imm), JL_EORDER);
    check_same(&rig.imm, &twin.imm);
    set_mode(&rig, bad);
    assert_int_equal(step(&rig, z), JL_OK);
    assert_int_equal(step(&twin, z), JL_OK);
    check_same(&rig.imm, &twin.imm);
}

static void test_imm_failed_piece_bars_weigh(void **state)
{
    int j;

    (void)state;
    make(3, 2, 2);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    bind(&twin, &jl_kf_joseph, JL_MIX_AUTO);
    for (j = 0; j < 3; j++) {
        check_failed_piece(j, JL_ENONFINITE);   /* its prediction */
        check_failed_piece(j, JL_ESINGULAR);    /* its update */
    }
}

/* A new chain or state while a step is under way: that step is over. */
static void test_imm_change_ends_the_step(void **state)
{
    jl_real z[Z_MAX];

    (void)state;
    make(3, 2, 1);
    make_z(z);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    jl_imm_mix(&rig.imm, spoilt());
    jl_imm_chain(&rig.imm, in.Pi);
    assert_int_equal(filter_again(z), JL_EORDER);
    jl_imm_mix(&rig.imm, spoilt());
    jl_imm_set(&rig.imm, in.x, in.P, in.mu, spoilt());
    assert_int_equal(filter_again(z), JL_EORDER);
    jl_imm_mix(&rig.imm, spoilt());
    filter_again(z);
    jl_imm_set(&rig.imm, in.x, in.P, in.mu, spoilt());
    assert_int_equal(jl_imm_weigh(&rig.imm), JL_EORDER);
    bind(&twin, &jl_kf_joseph, JL_MIX_AUTO);
    step(&rig, z);
    step(&twin, z);
    check_same(&rig.imm, &twin.imm);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_imm_init_refuses),
        cmocka_unit_test(test_imm_init_state),
        cmocka_unit_test(test_imm_init_chain),
        cmocka_unit_test(test_imm_most_modes),
        cmocka_unit_test(test_imm_chain_refuses),
        cmocka_unit_test(test_imm_set_refuses),
        cmocka_unit_test(test_imm_sticky_is_found_out),
        cmocka_unit_test(test_imm_general_chains),
        cmocka_unit_test(test_imm_sticky_equals_general),
        cmocka_unit_test(test_imm_innovations),
        cmocka_unit_test(test_imm_counts_do_not_wrap),
        cmocka_unit_test(test_imm_outliers),
        cmocka_unit_test(test_imm_outlier_keeps_the_prior),
        cmocka_unit_test(test_imm_missing_measurement),
        cmocka_unit_test(test_imm_modes_in_another_order),
        cmocka_unit_test(test_imm_of_one_mode_is_a_kf),
        cmocka_unit_test(test_imm_of_equal_modes_is_a_kf),
        cmocka_unit_test(test_imm_mode_that_cannot_be_entered),
        cmocka_unit_test(test_imm_evidence),
        cmocka_unit_test(test_imm_underflow_under_jumps),
        cmocka_unit_test(test_imm_underflowed_modes_mix),
        cmocka_unit_test(
            test_imm_probability_leaves_the_numbers_and_returns),
        cmocka_unit_test(test_imm_sums_of_next_to_nothing),
        cmocka_unit_test(test_imm_improbable_modes_keep_their_estimate),
        cmocka_unit_test(test_imm_mu_within_tolerance),
        cmocka_unit_test(test_imm_mode_that_is_hardly_entered),
        cmocka_unit_test(test_imm_mixing_cannot_overflow),
        cmocka_unit_test(test_imm_routes_to_the_same_bits),
        cmocka_unit_test(test_imm_stages_out_of_order),
        cmocka_unit_test(test_imm_judge_out_of_order),
        cmocka_unit_test(test_imm_failed_step_leaves_no_trace),
        cmocka_unit_test(test_imm_failed_piece_bars_weigh),
        cmocka_unit_test(test_imm_change_ends_the_step),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
