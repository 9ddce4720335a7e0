/* Modes of different states: as modes padded by hand, as a long double IMM that
 * knows what each mode lacks, and better than padding without a variance. */
#include "close.h"

#include <stdint.h>

#include "jumplink/imm.h"

#define EPS ((double)JL_EPSILON)
#define NAN_ ((jl_real)NAN)
#define INF_ ((jl_real)INFINITY)
#define EDGE 4

/* Components, modes, measurements; noises of a mode, and with those of what it
 * lacks. */
enum { N = 6, M = 4, Z = 2, P_OWN = 2, P_MAX = P_OWN + N };

typedef long double wide;

static const jl_kf_form *const forms[] = { &jl_kf_joseph, &jl_kf_standard,
                                           &jl_kf_sqrt, &jl_kf_unscented };
#define FORMS 4
static uint32_t seed;

/* Uniform in [-1, 1). */
static jl_real rnd(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (jl_real)(seed >> 8) / 8388608 - 1;
}

/* --- modes that lack something -------------------------------------------- */

/* Of x vx ax y vy ay: no acceleration, nothing lacking, no velocity either, and
 * no acceleration in y. */
static const int plane[] = { 0, 1, 3, 4 }, still[] = { 0, 3 };
static const int most[] = { 0, 1, 2, 3, 4 };
static const int *const map[M] = { plane, NULL, still, most };
static const int size[M] = { 4, N, 2, 5 };

static jl_real prior_x[N], prior_var[N];

static int place(int j, int i)
{
    return map[j] != NULL ? map[j][i] : i;
}

static int lacks(int j, int component)
{
    int i;

    for (i = 0; i < size[j]; i++)
        if (place(j, i) == component)
            return 0;
    return 1;
}

/* The filter's input. */
static struct {
    jl_real F[M][N * N], G[M][N * P_OWN], Q[M][P_OWN * P_OWN];
    jl_real w_bar[M][P_OWN], H[M][Z * N], R[M][Z * Z];
    jl_real x[M * N], P[M * N * N], mu[M], Pi[M * M];
} in;

/* A = B B' + c I */
static void make_cov(jl_real *A, int n, jl_real c)
{
    jl_real B[N * N];
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

static void make_probabilities(jl_real *p, int n, jl_real sum)
{
    jl_real total = 0;
    int i;

    for (i = 0; i < n; i++)
        total += p[i] = JL_C(1.1) + rnd();
    for (i = 0; i < n; i++)
        p[i] *= sum / total;
}

static void make_chain(int sticky)
{
    jl_real v[M];
    int i, j;

    make_probabilities(v, M, JL_C(0.25));
    for (i = 0; i < M; i++) {
        if (!sticky)
            make_probabilities(v, M, JL_C(0.25));
        for (j = 0; j < M; j++)
            in.Pi[i * M + j] = v[j] + (i == j ? JL_C(0.75) : 0);
    }
}

/* Random modes, which are stable, and estimates; the sensors' noises are
 * independent. */
static void make(int sticky)
{
    int i, j, k;

    for (i = 0; i < N; i++) {
        prior_x[i] = rnd();
        prior_var[i] = JL_C(1.5) + rnd();
    }
    for (j = 0; j < M; j++) {
        k = size[j];
        for (i = 0; i < k * k; i++)
            in.F[j][i] = rnd() / (jl_real)(2 * k)
                + (i % (k + 1) == 0 ? JL_C(0.5) : 0);
        for (i = 0; i < k * P_OWN; i++)
            in.G[j][i] = rnd();
        for (i = 0; i < P_OWN; i++)
            in.w_bar[j][i] = rnd();
        for (i = 0; i < Z * k; i++)
            in.H[j][i] = rnd();
        for (i = 0; i < Z * Z; i++)
            in.R[j][i] = i % (Z + 1) == 0 ? 1 + rnd() / 2 : 0;
        make_cov(in.Q[j], P_OWN, JL_C(0.1));
        for (i = 0; i < N; i++)
            in.x[j * N + i] = rnd();
        make_cov(in.P + j * N * N, N, JL_C(0.1));
    }
    make_probabilities(in.mu, M, 1);
    make_chain(sticky);
}

/* Constant velocity, acceleration, position, and one of them an axis; what
 * drives an axis has the noise of standard deviation std[j]. */
static void make_motions(int sticky)
{
    static const jl_real std[M] = { JL_C(0.2), JL_C(0.5), 8, JL_C(0.5) };
    static const jl_real rise[3] = { JL_C(0.5), 1, 1 };
    static const jl_real start[3] = { 4, 25, 9 };
    int i, j, k, a;

    make(sticky);                       /* for mu and the chain */
    memset(in.x, 0, sizeof in.x);
    memset(in.P, 0, sizeof in.P);
    for (i = 0; i < N; i++) {
        prior_x[i] = 0;
        prior_var[i] = start[i % 3];
    }
    for (j = 0; j < M; j++) {
        k = size[j];
        memset(in.F[j], 0, sizeof in.F[j]);
        memset(in.G[j], 0, sizeof in.G[j]);
        memset(in.H[j], 0, sizeof in.H[j]);
        memset(in.w_bar[j], 0, sizeof in.w_bar[j]);
        for (i = 0; i < k; i++) {
            int axis = place(j, i) / 3, order = place(j, i) % 3;

            for (a = i; a < k && place(j, a) / 3 == axis; a++)
                in.F[j][i * k + a] = a == i + 2 ? JL_C(0.5) : 1;
            in.G[j][i * P_OWN + axis] = k == 2 ? 1 : rise[order];
            in.H[j][axis * k + i] = order == 0;
        }
        for (i = 0; i < Z * Z; i++) {
            in.Q[j][i] = i % 3 == 0 ? std[j] * std[j] : 0;
            in.R[j][i] = i % 3 == 0 ? 4 : 0;
        }
        for (i = 0; i < N; i++)
            in.P[(j * N + i) * N + i] = start[i % 3];
    }
}

/* --- filters ---------------------------------------------------------------- */

struct rig {
    jl_mode modes[M];
    jl_imm imm;
    jl_real mode_mem[M][JL_MODE_MEM(N, Z, P_MAX)];
    jl_real mem[JL_IMM_STATE(M, N, Z) + 2 * EDGE];
};

static struct rig rig, twin, before;
static jl_real scratch[JL_IMM_SCRATCH(M, N, Z) + JL_MODE_SCRATCH(N, Z, P_MAX)
                       + 2 * EDGE];

/* NaN in the scratch of the filter and around it. */
static jl_real *spoilt(void)
{
    int i;

    for (i = 0; i < JL_IMM_SCRATCH(M, N, Z) + 2 * EDGE; i++)
        scratch[i] = NAN_;
    return scratch + EDGE;
}

static void check_edges(const struct rig *r)
{
    int i;

    for (i = 0; i < EDGE; i++) {
        assert_true(isnan(r->mem[i]));
        assert_true(isnan(r->mem[EDGE + JL_IMM_STATE(M, N, Z) + i]));
        assert_true(isnan(scratch[i]));
        assert_true(isnan(scratch[EDGE + JL_IMM_SCRATCH(M, N, Z) + i]));
    }
}

static void start(struct rig *r)
{
    assert_int_equal(jl_imm_chain(&r->imm, in.Pi), JL_OK);
    assert_int_equal(jl_imm_set(&r->imm, in.x, in.P, in.mu, spoilt()), JL_OK);
    check_edges(r);
}

static void clear(struct rig *r)
{
    int i;

    memset(r, 0, sizeof *r);
    for (i = 0; i < JL_IMM_STATE(M, N, Z) + 2 * EDGE; i++)
        r->mem[i] = NAN_;
}

static void set_small(struct rig *r, int j)
{
    int k = size[j];

    assert_int_equal(jl_mode_init(&r->modes[j], k, Z, P_OWN, r->mode_mem[j],
                                  JL_MODE_MEM(k, Z, P_OWN)), JL_OK);
    assert_int_equal(jl_mode_set(&r->modes[j], in.F[j], in.G[j], in.Q[j],
                                 in.w_bar[j], in.H[j], in.R[j], scratch),
                     JL_OK);
}

static int init_sizes(struct rig *r, const jl_kf_form *form, int mixing)
{
    return jl_imm_init_sizes(&r->imm, M, N, r->modes, map, prior_x, prior_var,
                             form, mixing, r->mem + EDGE,
                             JL_IMM_STATE(M, N, Z));
}

/* Modes of their own sizes. */
static void bind(struct rig *r, const jl_kf_form *form, int mixing)
{
    int j;

    clear(r);
    for (j = 0; j < M; j++)
        set_small(r, j);
    assert_int_equal(init_sizes(r, form, mixing), JL_OK);
    start(r);
}

/* What a mode lacks has no past and no future, and the prior as its noise. */
static void set_padded(struct rig *r, int j)
{
    jl_real F[N * N] = { 0 }, G[N * P_MAX] = { 0 }, H[Z * N] = { 0 };
    jl_real Q[P_MAX * P_MAX] = { 0 }, w_bar[P_MAX] = { 0 };
    int k = size[j], i, a;

    for (i = 0; i < k; i++) {
        for (a = 0; a < k; a++)
            F[place(j, i) * N + place(j, a)] = in.F[j][i * k + a];
        for (a = 0; a < P_OWN; a++)
            G[place(j, i) * P_MAX + a] = in.G[j][i * P_OWN + a];
        for (a = 0; a < Z; a++)
            H[a * N + place(j, i)] = in.H[j][a * k + i];
    }
    for (i = 0; i < P_OWN; i++) {
        w_bar[i] = in.w_bar[j][i];
        for (a = 0; a < P_OWN; a++)
            Q[i * P_MAX + a] = in.Q[j][i * P_OWN + a];
    }
    for (i = 0; i < N; i++)
        if (lacks(j, i)) {
            a = P_OWN + i;
            G[i * P_MAX + a] = 1;
            Q[a * (P_MAX + 1)] = prior_var[i];
            w_bar[a] = prior_x[i];
        }
    assert_int_equal(jl_mode_init(&r->modes[j], N, Z, P_MAX, r->mode_mem[j],
                                  JL_MODE_MEM(N, Z, P_MAX)), JL_OK);
    assert_int_equal(jl_mode_set(&r->modes[j], F, G, Q, w_bar, H, in.R[j],
                                 scratch), JL_OK);
}

/* The same filter of modes padded to all components, from the same start. */
static void bind_padded(struct rig *r, const jl_kf_form *form, int mixing)
{
    jl_real x[M * N], P[M * N * N];
    int j, i, a;

    clear(r);
    for (j = 0; j < M; j++)
        set_padded(r, j);
    assert_int_equal(jl_imm_init(&r->imm, M, r->modes, form, mixing,
                                 r->mem + EDGE, JL_IMM_STATE(M, N, Z)), JL_OK);
    memcpy(x, in.x, sizeof x);
    memcpy(P, in.P, sizeof P);
    for (j = 0; j < M; j++)
        for (i = 0; i < N; i++)
            if (lacks(j, i)) {
                x[j * N + i] = prior_x[i];
                for (a = 0; a < N; a++)
                    P[(j * N + i) * N + a] = P[(j * N + a) * N + i] = 0;
                P[(j * N + i) * N + i] = prior_var[i];
            }
    assert_int_equal(jl_imm_chain(&r->imm, in.Pi), JL_OK);
    assert_int_equal(jl_imm_set(&r->imm, x, P, in.mu, spoilt()), JL_OK);
}

static int step(struct rig *r, const jl_real *z)
{
    int status = jl_imm_step(&r->imm, z, spoilt());

    check_edges(r);
    return status;
}

/* Measurement k; some are missing. */
static const jl_real *make_z(jl_real *z, int k)
{
    z[0] = 2 * rnd();
    z[1] = 2 * rnd();
    return k % 7 == 5 ? NULL : z;
}

/* The same of a target that stands, flies straight, turns off, every 80 steps;
 * with outliers for a gate. */
static const jl_real *make_path(jl_real *z, int k, jl_real outlier)
{
    static jl_real x, y, vx, vy;
    const jl_real *given = make_z(z, k);
    jl_real ay = k % 80 >= 60 ? (k / 80 % 2 ? 2 : -2) : 0;

    if (k == 0)
        x = y = vx = vy = 0;
    if (k % 80 == 20)
        vx = k / 80 % 2 ? -5 : 5;
    if (k % 80 == 0)
        vx = vy = 0;
    x += vx;
    y += vy + ay / 2;
    vy += ay;
    z[0] += x + (k % 50 == 33 ? outlier : 0);
    z[1] += y;
    return given;
}

/* --- against padding --------------------------------------------------------- */

/* Estimates equal up to rounding: x in sigmas, P by sigmas. */
static void check_estimate(const jl_real *x, const jl_real *P,
                           const jl_real *want_x, const jl_real *want_P,
                           double within)
{
    double s[N];
    int i, k;

    for (i = 0; i < N; i++)
        s[i] = sqrt((double)want_P[i * (N + 1)]);
    for (i = 0; i < N; i++) {
        assert_close(x[i], want_x[i], within * s[i]);
        for (k = 0; k < N; k++)
            assert_close(P[i * N + k], want_P[i * N + k],
                         within * s[i] * s[k]);
    }
}

static void check_alike(const jl_imm *a, const jl_imm *b, double within)
{
    jl_real P[N * N], Q[N * N];
    int j;

    for (j = 0; j < M; j++) {
        jl_imm_cov(a, j, P);
        jl_imm_cov(b, j, Q);
        check_estimate(a->x + j * N, P, b->x + j * N, Q, within);
        assert_close(a->mu[j], b->mu[j], within);
        assert_close(jl_imm_logmu(a, j), jl_imm_logmu(b, j),
                     within * (1 + fabs((double)jl_imm_logmu(b, j))));
        assert_close(a->nis[j], b->nis[j],
                     within * (1 + fabs((double)b->nis[j])));
        assert_close(a->nis_mean[j], b->nis_mean[j],
                     within * (1 + fabs((double)b->nis_mean[j])));
    }
    check_estimate(a->xhat, a->Phat, b->xhat, b->Phat, within);
    assert_close(a->loglik, b->loglik,
                 within * (1 + fabs((double)b->loglik)));
}

/* What every mode lacks is as stated. */
static void check_prior(const jl_imm *imm)
{
    jl_real P[N * N];
    int j, i, a;

    for (j = 0; j < M; j++) {
        jl_imm_cov(imm, j, P);
        for (i = 0; i < N; i++)
            for (a = 0; a < N && lacks(j, i); a++) {
                assert_true(imm->x[j * N + i] == prior_x[i]);
                assert_true(P[i * N + a] == (i == a ? prior_var[i] : 0));
                assert_true(P[a * N + i] == (i == a ? prior_var[i] : 0));
            }
    }
}

static void check_padding(const jl_kf_form *form, int mixing, int sticky,
                          int moves, jl_real gate)
{
    jl_real z[Z];
    int k;

    if (moves)
        make_motions(sticky);
    else
        make(sticky);
    bind(&rig, form, mixing);
    bind_padded(&twin, form, mixing);
    assert_int_equal(rig.imm.sticky, sticky && mixing == JL_MIX_AUTO);
    jl_imm_gate(&rig.imm, gate, 2);
    jl_imm_gate(&twin.imm, gate, 2);
    for (k = 0; k < 400; k++) {
        const jl_real *given = moves ? make_path(z, k, gate > 0 ? 1000 : 0)
            : make_z(z, k);

        assert_int_equal(step(&rig, given), JL_OK);
        assert_int_equal(step(&twin, given), JL_OK);
        check_alike(&rig.imm, &twin.imm, 5000 * EPS);
        check_prior(&rig.imm);
    }
    assert_true(rig.imm.rejected == twin.imm.rejected);
    assert_int_equal(rig.imm.rejected > 0, gate > 0);
}

static void test_sizes_equal_padding_with_the_prior(void **state)
{
    int f, moves;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        for (moves = 0; moves <= 1; moves++) {
            check_padding(forms[f], JL_MIX_AUTO, 0, moves, 0);
            check_padding(forms[f], JL_MIX_AUTO, 1, moves, 0);
            check_padding(forms[f], JL_MIX_GENERAL, 1, moves, 0);
        }
        check_padding(forms[f], JL_MIX_AUTO, 0, 1, 100);
        check_padding(forms[f], JL_MIX_AUTO, 1, 1, 100);
    }
}

/* --- against a long double IMM ----------------------------------------------- */

static struct {
    wide x[M][N], P[M][N][N], logmu[M], xhat[N], Phat[N][N], loglik;
} book;

/* Mean and covariance of the estimates with weights w. */
static void book_pool(wide *mean, wide (*cov)[N], const wide *w)
{
    int i, a, b;

    for (a = 0; a < N; a++)
        for (mean[a] = 0, i = 0; i < M; i++)
            mean[a] += w[i] * book.x[i][a];
    for (a = 0; a < N; a++)
        for (b = 0; b < N; b++)
            for (cov[a][b] = 0, i = 0; i < M; i++)
                cov[a][b] += w[i] * (book.P[i][a][b]
                                     + (book.x[i][a] - mean[a])
                                     * (book.x[i][b] - mean[b]));
}

/* w = exp(e) / sum; returns log sum. */
static wide book_weights(wide *w, const wide *e)
{
    wide max = e[0], sum = 0;
    int i;

    for (i = 1; i < M; i++)
        max = fmaxl(max, e[i]);
    for (i = 0; i < M; i++)
        sum += w[i] = expl(e[i] - max);
    for (i = 0; i < M; i++)
        w[i] /= sum;
    return max + logl(sum);
}

/* What mode j lacks of (x, P). */
static void book_prior(int j, wide *x, wide (*P)[N])
{
    int i, a;

    for (i = 0; i < N; i++)
        if (lacks(j, i)) {
            x[i] = prior_x[i];
            for (a = 0; a < N; a++)
                P[i][a] = P[a][i] = 0;
            P[i][i] = prior_var[i];
        }
}

static void book_start(void)
{
    wide w[M];
    int i, j, k;

    for (j = 0; j < M; j++) {
        book.logmu[j] = logl(in.mu[j]);
        for (i = 0; i < N; i++) {
            book.x[j][i] = in.x[j * N + i];
            for (k = 0; k < N; k++)
                book.P[j][i][k] = in.P[(j * N + i) * N + k];
        }
        book_prior(j, book.x[j], book.P[j]);
    }
    book_weights(w, book.logmu);
    book_pool(book.xhat, book.Phat, w);
    book.loglik = 0;
}

/* x, P of the components that mode j has, predicted in their places. */
static void book_predict(int j, wide *x, wide (*P)[N])
{
    wide y[N] = { 0 }, S[N][N] = { { 0 } };
    int k = size[j], a, b, c, d;

    for (a = 0; a < k; a++) {
        const jl_real *Fa = in.F[j] + a * k, *Ga = in.G[j] + a * P_OWN;

        for (c = 0; c < P_OWN; c++)
            y[place(j, a)] += (wide)Ga[c] * in.w_bar[j][c];
        for (c = 0; c < k; c++)
            y[place(j, a)] += Fa[c] * x[place(j, c)];
        for (b = 0; b < k; b++) {
            const jl_real *Fb = in.F[j] + b * k, *Gb = in.G[j] + b * P_OWN;
            wide s = 0;

            for (c = 0; c < k; c++)
                for (d = 0; d < k; d++)
                    s += Fa[c] * P[place(j, c)][place(j, d)] * Fb[d];
            for (c = 0; c < P_OWN; c++)
                for (d = 0; d < P_OWN; d++)
                    s += (wide)Ga[c] * in.Q[j][c * P_OWN + d] * Gb[d];
            S[place(j, a)][place(j, b)] = s;
        }
    }
    memcpy(x, y, sizeof y);
    memcpy(P, S, sizeof S);
    book_prior(j, x, P);
}

/* One measurement after the other, for their noises are independent. */
static wide book_update(int j, wide *x, wide (*P)[N], const jl_real *z)
{
    wide loglik = 0;
    int k = size[j], i, a, b;

    for (i = 0; i < Z; i++) {
        wide nu = z[i], S = in.R[j][i * (Z + 1)], PH[N] = { 0 };

        for (b = 0; b < k; b++) {
            nu -= in.H[j][i * k + b] * x[place(j, b)];
            for (a = 0; a < N; a++)
                PH[a] += P[a][place(j, b)] * in.H[j][i * k + b];
        }
        for (b = 0; b < k; b++)
            S += in.H[j][i * k + b] * PH[place(j, b)];
        loglik -= (logl(2 * acosl(-1) * S) + nu * nu / S) / 2;
        for (a = 0; a < N; a++)
            x[a] += PH[a] / S * nu;
        for (a = 0; a < N; a++)
            for (b = 0; b < N; b++)
                P[a][b] -= PH[a] * PH[b] / S;
    }
    return loglik;
}

static void book_step(const jl_real *z)
{
    static wide x[M][N], P[M][N][N];
    wide e[M], w[M], logc[M];
    int i, j;

    for (j = 0; j < M; j++) {
        for (i = 0; i < M; i++)
            e[i] = logl(in.Pi[i * M + j]) + book.logmu[i];
        logc[j] = book_weights(w, e);
        book_pool(x[j], P[j], w);
    }
    for (j = 0; j < M; j++) {
        book_predict(j, x[j], P[j]);
        book.logmu[j] = logc[j];
        if (z != NULL)
            book.logmu[j] += book_update(j, x[j], P[j], z);
    }
    memcpy(book.x, x, sizeof x);
    memcpy(book.P, P, sizeof P);
    book.loglik = book_weights(w, book.logmu);
    for (j = 0; j < M; j++)
        book.logmu[j] -= book.loglik;
    if (z == NULL)
        book.loglik = 0;
    book_pool(book.xhat, book.Phat, w);
}

static void check_book(const jl_imm *imm, double within)
{
    jl_real P[N * N];
    int j, i, k;

    for (j = 0; j < M; j++) {
        jl_imm_cov(imm, j, P);
        assert_close(imm->mu[j], expl(book.logmu[j]), within);
        assert_close(jl_imm_logmu(imm, j), book.logmu[j],
                     within * (1 + fabs((double)book.logmu[j])));
        for (i = 0; i < N; i++) {
            assert_close(imm->x[j * N + i], book.x[j][i],
                         within * (1 + fabs((double)book.x[j][i])));
            for (k = 0; k < N; k++)
                assert_close(P[i * N + k], book.P[j][i][k],
                             within * (1 + fabs((double)P[i * N + k])));
        }
    }
    for (i = 0; i < N; i++) {
        assert_close(imm->xhat[i], book.xhat[i],
                     within * (1 + fabs((double)book.xhat[i])));
        for (k = 0; k < N; k++)
            assert_close(imm->Phat[i * N + k], book.Phat[i][k],
                         within * (1 + fabs((double)book.Phat[i][k])));
    }
    assert_close(imm->loglik, book.loglik,
                 within * (1 + fabs((double)book.loglik)));
}

static void check_with_book(const jl_kf_form *form, int mixing, int sticky,
                            int moves)
{
    jl_real z[Z];
    int k;

    if (moves)
        make_motions(sticky);
    else
        make(sticky);
    bind(&rig, form, mixing);
    book_start();
    check_book(&rig.imm, 1000 * EPS);
    for (k = 0; k < 200; k++) {
        const jl_real *given = moves ? make_path(z, k, 0) : make_z(z, k);

        assert_int_equal(step(&rig, given), JL_OK);
        book_step(given);
        check_book(&rig.imm, 5000 * EPS);
    }
}

static void test_sizes_equal_a_long_double_imm(void **state)
{
    int f, moves;

    (void)state;
    for (f = 0; f < FORMS; f++)
        for (moves = 0; moves <= 1; moves++) {
            check_with_book(forms[f], JL_MIX_AUTO, 0, moves);
            check_with_book(forms[f], JL_MIX_AUTO, 1, moves);
            check_with_book(forms[f], JL_MIX_GENERAL, 1, moves);
        }
}

/* --- what the prior means ---------------------------------------------------- */

/* A mode that takes over from one that lacks components is a Kalman filter
 * started from that one's estimate and the prior. */
static void test_sizes_prior_is_where_a_mode_starts(void **state)
{
    static jl_real kf_mem[JL_KF_STATE(N, Z)];
    jl_real x[N], P[N * N], z[Z];
    jl_kf kf;
    int j, i;

    (void)state;
    make(1);
    for (j = 0; j < M; j++)
        in.mu[j] = j == 0;
    bind(&rig, &jl_kf_joseph, JL_MIX_GENERAL);
    jl_kf_init(&kf, &rig.modes[1], &jl_kf_joseph, kf_mem, JL_KF_STATE(N, Z));
    memcpy(x, in.x, sizeof x);
    memcpy(P, in.P, sizeof P);
    x[2] = prior_x[2];
    x[5] = prior_x[5];
    for (i = 0; i < N; i++) {
        P[2 * N + i] = P[i * N + 2] = i == 2 ? prior_var[2] : 0;
        P[5 * N + i] = P[i * N + 5] = i == 5 ? prior_var[5] : 0;
    }
    assert_int_equal(jl_kf_set(&kf, x, P, spoilt()), JL_OK);
    make_z(z, 0);
    assert_int_equal(jl_kf_step(&kf, NULL, z, spoilt()), JL_OK);
    assert_int_equal(step(&rig, z), JL_OK);
    check_estimate(rig.imm.x + N, rig.imm.P + N * N, kf.x, kf.P, 100 * EPS);
}

/* --- what leaks -------------------------------------------------------------- */

enum { RUNS = 20, QUIET = 60, STEPS = 90, ONSET = 12 };

struct tracker {
    jl_mode modes[2];
    jl_real mode_mem[2][JL_MODE_MEM(3, 1, 1)], mem[JL_IMM_STATE(2, 3, 1)];
    jl_imm imm;
    double velocity, certainty; /* sums of squared errors at the onset; the
                                   CA mode's of its acceleration by variance */
};

/* CV beside CA on one axis; CV padded with an acceleration of 0, or without
 * one and a prior of 10 m/s^2. */
static void open_tracker(struct tracker *t, int padded)
{
    static const int cv[] = { 0, 1 };
    static const int *const maps[] = { cv, NULL };
    static const jl_real mean[3] = { 0, 0, 0 }, var[3] = { 0, 0, 100 };
    static const jl_real Pi[] = { JL_C(0.98), JL_C(0.02), JL_C(0.05),
                                  JL_C(0.95) };
    static const jl_real half[] = { JL_C(0.5), JL_C(0.5) };
    jl_motion motion = { JL_MOTION_CV, 1, 3, JL_C(0.3), 0, 20, 0 };
    jl_real x[6] = { 0 }, P[18] = { 0 }, z = 0;
    int j;

    for (j = 0; j < 2; j++) {
        assert_int_equal(jl_motion_start(x + 3 * j, P + 9 * j, &motion, &z,
                                         200, 10), JL_OK);
        motion.kind = j == 0 ? JL_MOTION_CV : JL_MOTION_CA;
        motion.order = j == 0 && !padded ? 2 : 3;
        jl_mode_init(&t->modes[j], motion.order, 1, 1, t->mode_mem[j],
                     JL_MODE_MEM(motion.order, 1, 1));
        assert_int_equal(jl_mode_motion(&t->modes[j], &motion, 1), JL_OK);
        motion.order = 3;
    }
    if (padded)
        P[8] = 0;
    assert_int_equal(jl_imm_init_sizes(&t->imm, 2, 3, t->modes,
                                       padded ? NULL : maps, mean, var,
                                       &jl_kf_joseph, JL_MIX_AUTO, t->mem,
                                       JL_IMM_STATE(2, 3, 1)), JL_OK);
    assert_int_equal(jl_imm_chain(&t->imm, Pi), JL_OK);
    assert_int_equal(jl_imm_set(&t->imm, x, P, half, scratch), JL_OK);
}

static void track(struct tracker *t, jl_real z, int k, double v, double a)
{
    double dv, da;

    assert_int_equal(jl_imm_step(&t->imm, &z, scratch), JL_OK);
    if (k < QUIET || k >= QUIET + ONSET)
        return;
    dv = (double)t->imm.xhat[1] - v;
    da = (double)t->imm.x[3 + 2] - a;
    t->velocity += dv * dv;
    t->certainty += da * da / (double)t->imm.P[9 + 8];
}

/* A target that flies straight, then turns off with 8 m/s^2.  Where CV is
 * certain that there is no acceleration, CA believes it: its error is many of
 * its sigmas, and the estimate lags.  In the mean over many runs, the square of
 * an error by its variance should be 1. */
static void test_sizes_certainty_does_not_leak(void **state)
{
    static struct tracker padded, sized;
    double p, v, a, n = RUNS * ONSET;
    int run, k;

    (void)state;
    memset(&padded, 0, sizeof padded);
    memset(&sized, 0, sizeof sized);
    for (run = 0; run < RUNS; run++) {
        open_tracker(&padded, 1);
        open_tracker(&sized, 0);
        for (p = 0, v = 150, k = 0; k < STEPS; k++) {
            jl_real z;

            a = k < QUIET ? 0 : 8;
            p += v + a / 2;
            v += a;
            z = (jl_real)p + 20 * (rnd() + rnd() + rnd());
            track(&padded, z, k, v, a);
            track(&sized, z, k, v, a);
        }
    }
    assert_true(padded.certainty / n > 20);
    assert_true(sized.certainty / n < 2);
    assert_true(sqrt(padded.velocity / n) > 1.5 * sqrt(sized.velocity / n));
}

/* --- init and set ------------------------------------------------------------ */

static int init_status(int n, const int *const *maps, const jl_kf_form *form,
                       int cap)
{
    int status;

    memcpy(&before, &rig, sizeof rig);
    status = jl_imm_init_sizes(&rig.imm, M, n, rig.modes, maps, prior_x,
                               prior_var, form, JL_MIX_AUTO, rig.mem + EDGE,
                               cap);
    assert_same_bits(&rig, &before, sizeof rig);
    return status;
}

/* A map for mode 0 in place of its own. */
static int map_status(int a, int b, int c, int d)
{
    const int *maps[M];
    int entries[4];

    entries[0] = a;
    entries[1] = b;
    entries[2] = c;
    entries[3] = d;
    memcpy(maps, map, sizeof maps);
    maps[0] = entries;
    return init_status(N, maps, &jl_kf_joseph, JL_IMM_STATE(M, N, Z));
}

static void test_sizes_init_refuses_maps(void **state)
{
    const int cap = JL_IMM_STATE(M, N, Z);
    const int *none[M] = { NULL }, *maps[M];
    int all[N] = { 1, 0, 2, 3, 4, 5 };
    jl_kf_form fixed = jl_kf_joseph;

    (void)state;
    make(1);
    bind(&rig, &jl_kf_standard, JL_MIX_AUTO);
    assert_int_equal(map_status(0, 1, 4, 3), JL_EDIM);  /* out of order */
    assert_int_equal(map_status(0, 1, 1, 3), JL_EDIM);  /* twice */
    assert_int_equal(map_status(-1, 1, 2, 3), JL_EDIM);
    assert_int_equal(map_status(0, 1, 2, N), JL_EDIM);
    assert_int_equal(init_status(N, NULL, &jl_kf_joseph, cap), JL_EDIM);
    assert_int_equal(init_status(N, none, &jl_kf_joseph, cap), JL_EDIM);
    assert_int_equal(init_status(N - 1, map, &jl_kf_joseph, cap), JL_EDIM);
    assert_int_equal(init_status(0, map, &jl_kf_joseph, cap), JL_EDIM);
    assert_int_equal(jl_imm_init_sizes(&rig.imm, 2, 4, rig.modes, map, prior_x,
                                       prior_var, &jl_kf_joseph, JL_MIX_AUTO,
                                       rig.mem + EDGE, cap), JL_EDIM);
    assert_same_bits(&rig, &before, sizeof rig);        /* n below mode 1's */
    assert_int_equal(init_status(JL_MAX_STATES + 1, map, &jl_kf_joseph,
                                 INT_MAX), JL_EDIM);
    assert_int_equal(init_status(N, map, &jl_kf_joseph, cap - 1), JL_ENOMEM);
    memcpy(maps, map, sizeof maps);
    maps[1] = all;
    assert_int_equal(init_status(N, maps, &jl_kf_joseph, cap), JL_EDIM);
    all[0] = 0;
    all[1] = 1;
    assert_int_equal(jl_imm_init_sizes(&rig.imm, M, N, rig.modes, maps, prior_x,
                                       prior_var, &jl_kf_joseph, JL_MIX_AUTO,
                                       rig.mem + EDGE, cap), JL_OK);
    fixed.n = N;                        /* it cannot do the smaller modes */
    fixed.m = Z;
    assert_int_equal(init_status(N, map, &fixed, cap), JL_EDIM);
    rig.modes[2].m = 1;
    assert_int_equal(init_status(N, map, &jl_kf_joseph, cap), JL_EDIM);
    rig.modes[2].m = Z;
    assert_int_equal(init_sizes(&rig, &jl_kf_joseph, 2), JL_EDIM);
    assert_int_equal(init_sizes(&rig, &jl_kf_joseph, JL_MIX_AUTO), JL_OK);
}

/* A component that nobody has is none of the filter's. */
static void test_sizes_init_refuses_a_component_of_no_mode(void **state)
{
    static const int first[] = { 0, 1, 2, 3 }, pair[] = { 1, 3 };
    static const int five[] = { 0, 1, 2, 3, 5 };
    const int *maps[M];

    (void)state;
    make(1);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    set_small(&rig, 1);
    rig.modes[1].n = 4;
    maps[0] = maps[1] = first;
    maps[2] = pair;
    maps[3] = five;                     /* nobody has component 4 */
    assert_int_equal(init_status(N, maps, &jl_kf_joseph,
                                 JL_IMM_STATE(M, N, Z)), JL_EDIM);
    maps[1] = plane;
    assert_int_equal(jl_imm_init_sizes(&rig.imm, M, N, rig.modes, maps,
                                       prior_x, prior_var, &jl_kf_joseph,
                                       JL_MIX_AUTO, rig.mem + EDGE,
                                       JL_IMM_STATE(M, N, Z)), JL_OK);
}

static void test_sizes_init_refuses_priors(void **state)
{
    const jl_real bad[] = { NAN_, INF_, -INF_, 2 * JL_LARGE };
    const int cap = JL_IMM_STATE(M, N, Z);
    jl_real keep;
    int i, k;

    (void)state;
    make(1);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    for (i = 0; i < N; i++) {
        if (i % 3 == 0)
            continue;                   /* no mode lacks it */
        for (k = 0; k < 4; k++) {
            keep = prior_x[i];
            prior_x[i] = bad[k];
            assert_int_equal(init_status(N, map, &jl_kf_joseph, cap),
                             JL_ENONFINITE);
            prior_x[i] = keep;
            keep = prior_var[i];
            prior_var[i] = k < 3 ? bad[k] : 2 * JL_LARGE * JL_LARGE;
            assert_int_equal(init_status(N, map, &jl_kf_joseph, cap),
                             JL_ENONFINITE);
            prior_var[i] = keep;
        }
        keep = prior_var[i];
        prior_var[i] = 0;               /* a certainty that would leak */
        assert_int_equal(init_status(N, map, &jl_kf_joseph, cap), JL_ERANGE);
        prior_var[i] = -keep;
        assert_int_equal(init_status(N, map, &jl_kf_joseph, cap), JL_ERANGE);
        prior_var[i] = keep;
    }
    prior_x[3] = prior_var[3] = NAN_;   /* so nobody asks */
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    assert_int_equal(step(&rig, in.x), JL_OK);
    assert_true(jl_vec_within(rig.imm.Phat, N * N, JL_LARGE));
}

static void test_sizes_init_state(void **state)
{
    int j, i, a;

    (void)state;
    make(1);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    assert_int_equal(init_sizes(&rig, &jl_kf_joseph, JL_MIX_AUTO), JL_OK);
    check_edges(&rig);
    check_prior(&rig.imm);
    for (j = 0; j < M; j++)
        for (i = 0; i < N; i++)
            for (a = 0; a < N && !lacks(j, i); a++) {
                assert_true(rig.imm.x[j * N + i] == 0);
                assert_true(rig.imm.P[(j * N + i) * N + a]
                            == (jl_real)(i == a));
            }
}

/* Whatever is given for what a mode lacks. */
static void test_sizes_set_sets_the_prior(void **state)
{
    jl_real x[M * N];
    int j, i;

    (void)state;
    make(1);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    bind(&twin, &jl_kf_joseph, JL_MIX_AUTO);
    check_prior(&rig.imm);
    memcpy(x, in.x, sizeof x);
    for (j = 0; j < M; j++)
        for (i = 0; i < N; i++)
            if (lacks(j, i))
                x[j * N + i] = 1000 * rnd();
    assert_int_equal(jl_imm_set(&rig.imm, x, in.P, in.mu, spoilt()), JL_OK);
    assert_same_bits(rig.imm.x, twin.imm.x, sizeof x);
    assert_same_bits(rig.imm.P, twin.imm.P, sizeof in.P);
    assert_same_bits(rig.imm.xhat, twin.imm.xhat, N * sizeof *x);
    x[2] = NAN_;                        /* it is looked at all the same */
    memcpy(&before, &rig, sizeof rig);
    assert_int_equal(jl_imm_set(&rig.imm, x, in.P, in.mu, spoilt()),
                     JL_ENONFINITE);
    assert_same_bits(&rig, &before, sizeof rig);
}

/* --- modes that lack nothing -------------------------------------------------- */

/* Then it is jl_imm_init, and nobody reads a map or a prior. */
static void test_sizes_of_equal_modes_are_the_imm(void **state)
{
    const int *none[M] = { NULL };
    jl_real z[Z];
    int mixing, maps, k;

    (void)state;
    for (mixing = 0; mixing <= 1; mixing++)
        for (maps = 0; maps <= 1; maps++) {
            make(1);
            bind_padded(&twin, &jl_kf_joseph, mixing);
            bind_padded(&rig, &jl_kf_joseph, mixing);
            assert_int_equal(jl_imm_init_sizes(&rig.imm, M, N, rig.modes,
                                               maps ? none : NULL, NULL, NULL,
                                               &jl_kf_joseph, mixing,
                                               rig.mem + EDGE,
                                               JL_IMM_STATE(M, N, Z)), JL_OK);
            start(&rig);
            start(&twin);
            for (k = 0; k < 50; k++) {
                const jl_real *given = make_z(z, k);

                assert_int_equal(step(&rig, given), JL_OK);
                assert_int_equal(step(&twin, given), JL_OK);
                assert_same_bits(rig.mem, twin.mem, sizeof rig.mem);
            }
        }
}

static void test_sizes_of_one_mode(void **state)
{
    static const int *const maps[] = { plane };
    static jl_real kf_mem[JL_KF_STATE(4, Z)];
    const jl_real one = 1;
    jl_real x[4] = { 1, 2, 3, 4 }, P[16], z[Z], loglik;
    jl_kf kf;
    int k;

    (void)state;
    make(1);
    make_cov(P, 4, 1);
    bind(&rig, &jl_kf_joseph, JL_MIX_AUTO);
    memcpy(&before, &rig, sizeof rig);
    assert_int_equal(jl_imm_init_sizes(&rig.imm, 1, N, rig.modes, maps,
                                       prior_x, prior_var, &jl_kf_joseph,
                                       JL_MIX_AUTO, rig.mem + EDGE,
                                       JL_IMM_STATE(1, N, Z)), JL_EDIM);
    assert_int_equal(jl_imm_init_sizes(&rig.imm, 0, N, rig.modes, maps,
                                       prior_x, prior_var, &jl_kf_joseph,
                                       JL_MIX_AUTO, rig.mem + EDGE,
                                       JL_IMM_STATE(1, N, Z)), JL_EDIM);
    assert_same_bits(&rig, &before, sizeof rig);
    assert_int_equal(jl_imm_init_sizes(&rig.imm, 1, 4, rig.modes, NULL,
                                       prior_x, prior_var, &jl_kf_joseph,
                                       JL_MIX_AUTO, rig.mem + EDGE,
                                       JL_IMM_STATE(1, 4, Z)), JL_OK);
    assert_int_equal(jl_imm_set(&rig.imm, x, P, &one, spoilt()), JL_OK);
    jl_kf_init(&kf, &rig.modes[0], &jl_kf_joseph, kf_mem, JL_KF_STATE(4, Z));
    jl_kf_set(&kf, x, P, spoilt());
    for (k = 0; k < 20; k++) {
        const jl_real *given = make_z(z, k);

        assert_int_equal(jl_imm_step(&rig.imm, given, spoilt()), JL_OK);
        assert_int_equal(jl_kf_step(&kf, &loglik, given, spoilt()), JL_OK);
        assert_same_bits(rig.imm.x, kf.x, sizeof x);
        assert_same_bits(rig.imm.P, kf.P, sizeof P);
        assert_same_bits(&rig.imm.loglik, &loglik, sizeof loglik);
    }
}

/* --- steps that fail ----------------------------------------------------------- */

static void check_unchanged(void)
{
    size_t real = sizeof(jl_real);

    assert_same_bits(rig.imm.x, twin.imm.x, M * N * real);
    assert_same_bits(rig.imm.P, twin.imm.P, M * N * N * real);
    assert_same_bits(rig.imm.mu, twin.imm.mu, M * real);
    assert_same_bits(rig.imm.logmu, twin.imm.logmu, M * real);
    assert_same_bits(rig.imm.xhat, twin.imm.xhat, N * real);
    assert_same_bits(rig.imm.Phat, twin.imm.Phat, N * N * real);
}

static void test_sizes_failed_step_leaves_no_trace(void **state)
{
    jl_real z[Z];
    int f, j, k;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make(f);
        bind(&rig, forms[f], JL_MIX_AUTO);
        bind(&twin, forms[f], JL_MIX_AUTO);
        for (k = 0; k < 8; k++) {
            make_z(z, 0);
            j = k % M;
            rig.modes[j].F[0] = JL_REAL_MAX;
            assert_int_equal(step(&rig, z), JL_ENONFINITE);
            check_unchanged();
            set_small(&rig, j);
            rig.modes[j].R[0] = rig.modes[j].V[0] = -1.0e6f;
            assert_int_equal(step(&rig, z), JL_ESINGULAR);
            check_unchanged();
            set_small(&rig, j);
            z[0] = NAN_;
            assert_int_equal(step(&rig, z), JL_ENONFINITE);
            check_unchanged();
            z[0] = 1;
            assert_int_equal(step(&rig, z), JL_OK);
            assert_int_equal(step(&twin, z), JL_OK);
            check_unchanged();
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sizes_equal_padding_with_the_prior),
        cmocka_unit_test(test_sizes_equal_a_long_double_imm),
        cmocka_unit_test(test_sizes_prior_is_where_a_mode_starts),
        cmocka_unit_test(test_sizes_certainty_does_not_leak),
        cmocka_unit_test(test_sizes_init_refuses_maps),
        cmocka_unit_test(test_sizes_init_refuses_a_component_of_no_mode),
        cmocka_unit_test(test_sizes_init_refuses_priors),
        cmocka_unit_test(test_sizes_init_state),
        cmocka_unit_test(test_sizes_set_sets_the_prior),
        cmocka_unit_test(test_sizes_of_equal_modes_are_the_imm),
        cmocka_unit_test(test_sizes_of_one_mode),
        cmocka_unit_test(test_sizes_failed_step_leaves_no_trace),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
