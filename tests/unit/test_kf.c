/* The Kalman filter: every form against the textbook in long double, and a
 * filter that keeps its bits whenever a call fails. */
#include "close.h"

#include <stdint.h>
#include <stdlib.h>

#include "jumplink/kf.h"

#define MAX JL_MAX_STATES
#define EPS ((double)JL_EPSILON)
#define NAN_ ((jl_real)NAN)
#define INF_ ((jl_real)INFINITY)
#define EDGE 4

static const jl_kf_form *const forms[] = { &jl_kf_joseph, &jl_kf_standard,
                                           &jl_kf_sqrt };
#define FORMS 3
static uint32_t seed = 11;

/* Uniform in [-1, 1). */
static jl_real rnd(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (jl_real)(seed >> 8) / 8388608 - 1;
}

/* --- a filter with its mode, memory and scratch ------------------------- */

struct rig {
    jl_mode mode;
    jl_kf kf;
    jl_real loglik;
    jl_real mode_mem[JL_MODE_MEM(MAX, MAX, MAX)];
    jl_real mem[JL_KF_STATE(MAX, MAX) + 2 * EDGE];
};

static struct rig rig, twin, before;
static jl_real scratch[JL_MODE_SCRATCH(MAX, MAX, MAX)
                       + JL_KF_SCRATCH(MAX, MAX) + 2 * EDGE];

/* NaN in the scratch of a filter and around it. */
static jl_real *spoilt(const struct rig *r)
{
    int i;

    for (i = 0; i < JL_KF_SCRATCH(r->mode.n, r->mode.m) + 2 * EDGE; i++)
        scratch[i] = NAN_;
    return scratch + EDGE;
}

static void check_edges(const struct rig *r)
{
    int i;

    for (i = 0; i < EDGE; i++) {
        assert_true(isnan(r->mem[i]));
        assert_true(isnan(r->mem[EDGE + JL_KF_STATE(r->mode.n, r->mode.m) + i]));
        assert_true(isnan(scratch[i]));
        assert_true(isnan(scratch[EDGE + JL_KF_SCRATCH(r->mode.n, r->mode.m)
                                  + i]));
    }
}

/* A = B B' + c I */
static void make_cov(jl_real *A, int n, jl_real c)
{
    static jl_real B[MAX * MAX];
    int i, j, k;

    for (i = 0; i < n * n; i++)
        B[i] = rnd();
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            A[i * n + j] = i == j ? c : 0;
            for (k = 0; k < n; k++)
                A[i * n + j] += B[i * n + k] * B[j * n + k] / (jl_real)n;
        }
}

/* A filter over a random mode, from a random estimate. */
static void make(struct rig *r, const jl_kf_form *form, int n, int m)
{
    static jl_real F[MAX * MAX], G[MAX], H[MAX * MAX], R[MAX * MAX];
    jl_real q = 1, w_bar = rnd();
    int i;

    for (i = 0; i < n * n; i++)
        F[i] = rnd() / (jl_real)n + (i % (n + 1) == 0 ? JL_C(0.6) : 0);
    for (i = 0; i < m * n; i++)
        H[i] = rnd();
    for (i = 0; i < n; i++)
        G[i] = rnd();
    make_cov(R, m, JL_C(0.5));
    jl_mode_init(&r->mode, n, m, 1, r->mode_mem, JL_MODE_MEM(n, m, 1));
    assert_int_equal(jl_mode_set(&r->mode, F, G, &q, &w_bar, H, R, scratch),
                     JL_OK);
    for (i = 0; i < JL_KF_STATE(n, rig.mode.m) + 2 * EDGE; i++)
        r->mem[i] = NAN_;
    assert_int_equal(jl_kf_init(&r->kf, &r->mode, form, r->mem + EDGE,
                                JL_KF_STATE(n, rig.mode.m)), JL_OK);
    for (i = 0; i < n; i++)
        G[i] = rnd();
    make_cov(F, n, JL_C(0.1));
    assert_int_equal(jl_kf_set(&r->kf, G, F, spoilt(r)), JL_OK);
    check_edges(r);
    r->loglik = 77;
}

/* n = m = 1: F = f, H = 1, R = r, W = q, from x and P. */
static void make_scalar(struct rig *r, const jl_kf_form *form, jl_real f,
                        jl_real q, jl_real var, jl_real x, jl_real P)
{
    const jl_real one = 1;

    make(r, form, 1, 1);
    assert_int_equal(jl_mode_set(&r->mode, &f, &one, &q, NULL, &one, &var,
                                 scratch), JL_OK);
    assert_int_equal(jl_kf_set(&r->kf, &x, &P, spoilt(r)), JL_OK);
}

/* The same filter in other memory. */
static void make_twin(void)
{
    int n = rig.mode.n;

    memcpy(&twin, &rig, sizeof rig);
    jl_kf_init(&twin.kf, &rig.mode, rig.kf.form, twin.mem + EDGE,
               JL_KF_STATE(n, rig.mode.m));
    memcpy(twin.kf.x, rig.kf.x, (size_t)n * sizeof(jl_real));
    memcpy(twin.kf.P, rig.kf.P, (size_t)(n * n) * sizeof(jl_real));
}

static void check_same(const struct rig *a, const struct rig *b)
{
    assert_same_bits(a->mem, b->mem, sizeof a->mem);
    assert_same_bits(&a->loglik, &b->loglik, sizeof a->loglik);
}

/* The covariance of the estimate, which the form may keep otherwise. */
static const jl_real *cov_of(const struct rig *r)
{
    static jl_real P[MAX * MAX];

    jl_kf_cov(&r->kf, P);
    return P;
}

/* Exactly symmetric; a factor has D >= 0 and zeros below. */
static void check_symmetric(const struct rig *r)
{
    const jl_real *P = cov_of(r);
    int n = r->mode.n, i, j;

    for (i = 0; i < n; i++)
        for (j = 0; j < i; j++) {
            assert_same_bits(&P[i * n + j], &P[j * n + i], sizeof(jl_real));
            if (r->kf.form->cov->factored)
                assert_true(r->kf.P[i * n + j] == 0);
        }
    for (i = 0; i < n; i++)
        assert_true(r->kf.P[i * (n + 1)] >= 0);
}

enum { PREDICT, UPDATE, STEP };

/* One call on rig; on error nothing at all may have changed. */
static int call(int what, const jl_real *z)
{
    jl_real *s = spoilt(&rig);
    int status;

    memcpy(&before, &rig, sizeof rig);
    status = what == PREDICT ? jl_kf_predict(&rig.kf, s)
        : what == UPDATE ? jl_kf_update(&rig.kf, &rig.loglik, z, s)
        : jl_kf_step(&rig.kf, &rig.loglik, z, s);
    if (status != JL_OK)
        assert_same_bits(&rig, &before, sizeof rig);
    check_edges(&rig);
    return status;
}

/* --- the textbook ------------------------------------------------------- */

#define SMALL 8

typedef long double wide;

static struct { wide x[SMALL], P[SMALL][SMALL], loglik, nis, nu[SMALL]; } book;

static void book_start(const struct rig *r)
{
    const jl_real *P = cov_of(r);
    int n = r->mode.n, i, j;

    for (i = 0; i < n; i++) {
        book.x[i] = r->kf.x[i];
        for (j = 0; j < n; j++)
            book.P[i][j] = P[i * n + j];
    }
}

static void book_predict(const jl_mode *a)
{
    wide x[SMALL], P[SMALL][SMALL];
    int n = a->n, i, j, k, l;

    for (i = 0; i < n; i++) {
        x[i] = a->u[i];
        for (k = 0; k < n; k++)
            x[i] += (wide)a->F[i * n + k] * book.x[k];
        for (j = 0; j < n; j++) {
            P[i][j] = a->W[i * n + j];
            for (k = 0; k < n; k++)
                for (l = 0; l < n; l++)
                    P[i][j] += (wide)a->F[i * n + k] * book.P[k][l]
                        * a->F[j * n + l];
        }
    }
    memcpy(book.x, x, sizeof x);
    memcpy(book.P, P, sizeof P);
}

/* K = P H' S^-1 and P = P - K H P, with S inverted by elimination. */
static void book_update(const jl_mode *a, const jl_real *z)
{
    wide HP[SMALL][SMALL], S[SMALL][2 * SMALL], K[SMALL][SMALL], nu[SMALL];
    wide f, det = 1, distance = 0;
    int n = a->n, m = a->m, i, j, k;

    for (i = 0; i < m; i++) {
        nu[i] = z[i];
        for (k = 0; k < n; k++)
            nu[i] -= (wide)a->H[i * n + k] * book.x[k];
        for (j = 0; j < n; j++)
            for (HP[i][j] = 0, k = 0; k < n; k++)
                HP[i][j] += (wide)a->H[i * n + k] * book.P[k][j];
    }
    for (i = 0; i < m; i++)
        for (j = 0; j < m; j++) {
            S[i][j] = a->R[i * m + j];
            S[i][m + j] = i == j;
            for (k = 0; k < n; k++)
                S[i][j] += HP[i][k] * a->H[j * n + k];
        }
    for (k = 0; k < m; k++) {
        det *= f = S[k][k];
        for (j = 0; j < 2 * m; j++)
            S[k][j] /= f;
        for (i = 0; i < m; i++)
            if (i != k)
                for (f = S[i][k], j = 0; j < 2 * m; j++)
                    S[i][j] -= f * S[k][j];
    }
    for (i = 0; i < m; i++) {
        book.nu[i] = nu[i];
        for (j = 0; j < m; j++)
            distance += nu[i] * S[i][m + j] * nu[j];
    }
    book.nis = distance;
    book.loglik = -(m * logl(2 * acosl(-1)) + logl(det) + distance) / 2;
    for (i = 0; i < n; i++)
        for (j = 0; j < m; j++)
            for (K[i][j] = 0, k = 0; k < m; k++)
                K[i][j] += HP[k][i] * S[k][m + j];
    for (i = 0; i < n; i++)
        for (k = 0; k < m; k++) {
            book.x[i] += K[i][k] * nu[k];
            for (j = 0; j < n; j++)
                book.P[i][j] -= K[i][k] * HP[k][j];
        }
}

static void check_book(const struct rig *r, double tolerance)
{
    const jl_real *P = cov_of(r);
    int n = r->mode.n, i, j;

    for (i = 0; i < n; i++) {
        assert_close(r->kf.x[i], book.x[i], tolerance);
        for (j = 0; j < n; j++)
            assert_close(P[i * n + j], book.P[i][j], tolerance);
    }
}

/* --- init and set ------------------------------------------------------- */

static void test_kf_init(void **state)
{
    static const int sizes[] = { 1, 2, 5, MAX };
    int k, n, i;

    (void)state;
    for (k = 0; k < 4; k++) {
        n = sizes[k];
        make(&rig, &jl_kf_joseph, n, 1);
        memcpy(&before, &rig, sizeof rig);
        assert_int_equal(jl_kf_init(&rig.kf, &twin.mode, &jl_kf_standard,
                                    rig.mem, -1), JL_ENOMEM);
        assert_int_equal(jl_kf_init(&rig.kf, &rig.mode, &jl_kf_standard,
                                    rig.mem, JL_KF_STATE(n, rig.mode.m) - 1), JL_ENOMEM);
        assert_same_bits(&rig, &before, sizeof rig);
        assert_int_equal(jl_kf_init(&rig.kf, &rig.mode, &jl_kf_standard,
                                    rig.mem + EDGE, JL_KF_STATE(n, rig.mode.m)), JL_OK);
        check_edges(&rig);
        assert_ptr_equal(rig.kf.mode, &rig.mode);
        assert_ptr_equal(rig.kf.form, &jl_kf_standard);
        for (i = 0; i < n * n; i++) {
            assert_true(rig.kf.x[i % n] == 0);
            assert_true(rig.kf.P[i] == (jl_real)(i % (n + 1) == 0));
        }
    }
}

static jl_real set_x[3], set_P[9];

static int set(void)
{
    jl_real *s = spoilt(&rig);
    int status;

    memcpy(&before, &rig, sizeof rig);
    status = jl_kf_set(&rig.kf, set_x, set_P, s);
    if (status != JL_OK)
        assert_same_bits(&rig, &before, sizeof rig);
    check_edges(&rig);
    return status;
}

static void test_kf_set(void **state)
{
    const jl_real bad[] = { NAN_, INF_, -INF_, JL_LARGE * 2 };
    int i, k;

    (void)state;
    make(&rig, &jl_kf_joseph, 3, 1);
    for (k = 0; k < 4; k++)
        for (i = 0; i < 12; i++) {
            make_cov(set_P, 3, 1);
            *(i < 3 ? &set_x[i] : &set_P[i - 3]) = bad[k];
            if (i < 3 || k < 3)
                assert_int_equal(set(), JL_ENONFINITE);
            memset(set_x, 0, sizeof set_x);
        }
    make_cov(set_P, 3, 1);
    set_P[1] += JL_C(0.01);
    assert_int_equal(set(), JL_EASYM);
    make_cov(set_P, 3, 1);
    set_P[1] = set_P[3] = 5;
    assert_int_equal(set(), JL_EDEF);
    set_P[1] = set_P[3] = 0;
    set_P[4] = -1;
    assert_int_equal(set(), JL_EDEF);
    set_x[0] = JL_LARGE;
    set_x[1] = -JL_LARGE;
    make_cov(set_P, 3, 1);
    set_P[1] *= 1 + 2 * JL_EPSILON;     /* P is symmetric all the same */
    assert_int_equal(set(), JL_OK);
    check_symmetric(&rig);
    assert_same_bits(rig.kf.x, set_x, sizeof set_x);
    for (i = 0; i < 9; i++)
        assert_close(rig.kf.P[i], set_P[i], 4 * EPS);
    memset(set_P, 0, sizeof set_P);     /* known exactly */
    assert_int_equal(set(), JL_OK);
    assert_same_bits(rig.kf.P, set_P, sizeof set_P);
}

/* --- the equations ------------------------------------------------------ */

static void test_kf_forms_are_the_textbook(void **state)
{
    jl_real z[SMALL];
    int f, n, m, k, i;

    (void)state;
    for (f = 0; f < FORMS; f++)
        for (n = 1; n <= SMALL; n++)
            for (m = 1; m <= SMALL; m += 1 + (n > 3)) {
                make(&rig, forms[f], n, m);
                book_start(&rig);
                for (k = 0; k < 6; k++) {
                    for (i = 0; i < m; i++)
                        z[i] = 3 * rnd();
                    assert_int_equal(call(PREDICT, NULL), JL_OK);
                    book_predict(&rig.mode);
                    check_book(&rig, 2000 * EPS);
                    check_symmetric(&rig);
                    assert_int_equal(call(UPDATE, z), JL_OK);
                    book_update(&rig.mode, z);
                    check_book(&rig, 2000 * EPS);
                    check_symmetric(&rig);
                    assert_close(rig.loglik, book.loglik,
                                 500 * EPS * (1 + fabs((double)book.loglik)));
                    assert_close(rig.kf.innovation.nis, book.nis,
                                 500 * EPS * (1 + (double)book.nis));
                    for (i = 0; i < m; i++)
                        assert_close(rig.kf.innovation.nu[i], book.nu[i],
                                     500 * EPS);
                }
            }
}

static void check_innovation(const struct rig *r, double nis_mean)
{
    const jl_innovation *got = &r->kf.innovation;
    double size = 1 + (double)book.nis;
    int i;

    assert_close(got->loglik, book.loglik,
                 500 * EPS * (1 + fabs((double)book.loglik)));
    assert_close(got->nis, book.nis, 500 * EPS * size);
    assert_close(r->kf.nis_mean, nis_mean, 500 * EPS * (1 + nis_mean));
    for (i = 0; i < r->mode.m; i++)
        assert_close(got->nu[i], book.nu[i], 500 * EPS);
}

/* What an update tells, and that a missing measurement tells nothing new. */
static void test_kf_innovation(void **state)
{
    jl_real z[SMALL], P[SMALL * SMALL];
    double sum;
    int f, m, k, i, j;

    (void)state;
    for (f = 0; f < FORMS; f++)
        for (m = 1; m <= 5; m++) {
            make(&rig, forms[f], 4, m);
            book_start(&rig);
            for (sum = 0, k = 1; k <= 20; k++) {
                for (i = 0; i < m; i++)
                    z[i] = 3 * rnd();
                book_predict(&rig.mode);
                book_update(&rig.mode, z);
                sum += (double)book.nis;
                assert_int_equal(call(STEP, z), JL_OK);
                check_innovation(&rig, sum / k);
                assert_int_equal(rig.kf.accepted, k);
                assert_int_equal(call(UPDATE, NULL), JL_OK);
                check_innovation(&rig, sum / k);
                assert_int_equal(rig.kf.accepted, k);
                jl_kf_cov(&rig.kf, P);
                for (i = 0; i < 4; i++)
                    for (j = 0; j < 4; j++)
                        assert_close(P[i * 4 + j], book.P[i][j], 2000 * EPS);
            }
        }
}

/* After weeks at a kilohertz where a long has 32 bits. */
static void test_kf_counts_do_not_wrap(void **state)
{
    jl_real z = 1;
    int k;

    (void)state;
    make(&rig, &jl_kf_joseph, 2, 1);
    rig.kf.accepted = ULONG_MAX - 1;
    rig.kf.nis_mean = 1;
    for (k = 0; k < 3; k++) {
        assert_int_equal(call(STEP, &z), JL_OK);
        assert_true(rig.kf.accepted == ULONG_MAX);
        assert_close(rig.kf.nis_mean, 1, 0.1);
    }
    jl_kf_gate(&rig.kf, JL_C(1.0e-9), 2);
    rig.kf.run = INT_MAX;               /* what is absurd is never given in to */
    z = JL_REAL_MAX;
    for (k = 0; k < 3; k++) {
        assert_int_equal(call(STEP, &z), JL_OK);
        assert_int_equal(rig.kf.run, INT_MAX);
    }
}

static void test_kf_scalar_closed_form(void **state)
{
    const double log_2pi = 1.8378770664093454836;
    const jl_real z = 6;
    int f;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make_scalar(&rig, forms[f], 2, 3, 4, 1, 5);
        assert_int_equal(call(PREDICT, NULL), JL_OK);
        assert_close(rig.kf.x[0], 2, 0);
        assert_close(rig.kf.P[0], 23, 0);
        assert_int_equal(call(UPDATE, &z), JL_OK);
        assert_close(rig.kf.x[0], 2 + 23 / 27.0 * 4, 8 * EPS);
        assert_close(rig.kf.P[0], 23 * 4 / 27.0, 32 * EPS);
        assert_close(rig.loglik, -(log_2pi + log(27) + 16 / 27.0) / 2,
                     8 * EPS);
    }
}

/* The largest sizes: only that it stays inside its memory and sensible. */
static void test_kf_largest_sizes(void **state)
{
    static const int n[] = { MAX, MAX, 1 }, m[] = { MAX, 1, MAX };
    jl_real z[MAX];
    int f, k, i;

    (void)state;
    for (f = 0; f < FORMS; f++)
        for (k = 0; k < 3; k++) {
            make(&rig, forms[f], n[k], m[k]);
            for (i = 0; i < MAX; i++)
                z[i] = rnd();
            assert_int_equal(call(STEP, z), JL_OK);
            check_symmetric(&rig);
            assert_int_equal(jl_mat_check_cov(cov_of(&rig), scratch, n[k]),
                             JL_OK);
        }
}

/* A sensor nearly as good as rounding allows, on a prior of 1, for long. */
static void test_kf_joseph_keeps_semidefinite(void **state)
{
    jl_motion motion = { JL_MOTION_CA, 2, 3, 1, 0, 0, 0 };
    jl_real x[6], P[36], z[2] = { 0, 0 };
    int k;

    (void)state;
    motion.sigma_z = (jl_real)sqrt(1000 * EPS);
    make(&rig, &jl_kf_joseph, 6, 2);
    jl_mode_init(&rig.mode, 6, 2, 2, rig.mode_mem, JL_MODE_MEM(6, 2, 2));
    assert_int_equal(jl_mode_motion(&rig.mode, &motion, JL_C(0.01)), JL_OK);
    jl_motion_start(x, P, &motion, z, 100, 10);
    assert_int_equal(jl_kf_set(&rig.kf, x, P, spoilt(&rig)), JL_OK);
    for (k = 0; k < 500; k++) {
        z[0] = motion.sigma_z * rnd();
        z[1] = motion.sigma_z * rnd();
        assert_int_equal(call(STEP, z), JL_OK);
        check_symmetric(&rig);
        assert_int_equal(jl_mat_check_cov(rig.kf.P, scratch, 6), JL_OK);
    }
}

/* S = P + R = P in rounding: joseph still knows that P becomes R. */
static void test_kf_joseph_keeps_what_is_small(void **state)
{
    const jl_real z = 1, small = JL_EPSILON / 16;

    (void)state;
    make_scalar(&rig, &jl_kf_joseph, 1, 0, small, 0, 1);
    assert_int_equal(call(STEP, &z), JL_OK);
    assert_close(rig.kf.P[0], small, 4 * EPS * (double)small);
    make_scalar(&rig, &jl_kf_joseph, 1, 0, 1, 0, small);
    assert_int_equal(call(STEP, &z), JL_OK);
    assert_close(rig.kf.P[0], small, 4 * EPS * (double)small);
}

/* --- calls -------------------------------------------------------------- */

static void test_kf_step_is_predict_and_update(void **state)
{
    jl_real z[3], out[JL_KF_STATE(4, 3)], pred[JL_KF_STATE(4, 3)], nu[3];
    jl_innovation got;
    int f, k, i;

    (void)state;
    got.nu = nu;
    for (f = 0; f < FORMS; f++) {
        make(&rig, forms[f], 4, 3);
        make_twin();
        for (k = 0; k < 50; k++) {
            const jl_real *given = k % 7 == 3 ? NULL : z;

            for (i = 0; i < 3; i++)
                z[i] = rnd();
            /* the pieces of the form */
            memcpy(pred, twin.kf.x, sizeof pred);
            assert_int_equal(forms[f]->predict(pred, pred + 4, &rig.mode,
                                               spoilt(&rig)), JL_OK);
            check_edges(&rig);
            memcpy(out, pred, sizeof pred);
            assert_int_equal(forms[f]->update(out, out + 4, &got, &rig.mode,
                                              z, 0, spoilt(&rig)), JL_OK);
            check_edges(&rig);
            assert_int_equal(jl_kf_predict(&twin.kf, spoilt(&twin)), JL_OK);
            assert_same_bits(twin.kf.x, pred, 4 * sizeof *pred);
            assert_same_bits(twin.kf.P, pred + 4, 16 * sizeof *pred);
            assert_int_equal(jl_kf_update(&twin.kf, &twin.loglik, given,
                                          spoilt(&twin)), JL_OK);
            assert_int_equal(call(STEP, given), JL_OK);
            check_same(&rig, &twin);
            if (given != NULL) {
                assert_same_bits(rig.kf.x, out, 4 * sizeof *out);
                assert_same_bits(rig.kf.P, out + 4, 16 * sizeof *out);
                assert_same_bits(&rig.loglik, &got.loglik, sizeof z[0]);
            }
        }
    }
}

/* What is in the scratch does not matter, nor whether anyone wants loglik. */
static void test_kf_scratch_means_nothing(void **state)
{
    jl_real z[2];
    int f, k, i;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make(&rig, forms[f], 3, 2);
        make_twin();
        for (k = 0; k < 20; k++) {
            z[0] = rnd();
            z[1] = rnd();
            assert_int_equal(call(STEP, z), JL_OK);
            for (i = 0; i < JL_KF_SCRATCH(3, 2); i++)
                scratch[i] = 1000 * rnd();
            assert_int_equal(jl_kf_step(&twin.kf, NULL, z, scratch), JL_OK);
            twin.loglik = rig.loglik;
            check_same(&rig, &twin);
        }
    }
}

static void test_kf_missing_measurement(void **state)
{
    int f;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make(&rig, forms[f], 3, 2);
        make_twin();
        assert_int_equal(call(UPDATE, NULL), JL_OK);
        assert_true(rig.loglik == 0);
        assert_same_bits(rig.mem, twin.mem, sizeof rig.mem);
        assert_int_equal(jl_kf_update(&rig.kf, NULL, NULL, scratch), JL_OK);
        assert_same_bits(rig.mem, twin.mem, sizeof rig.mem);
        rig.loglik = 5;
        assert_int_equal(call(STEP, NULL), JL_OK);
        assert_true(rig.loglik == 0);
        jl_kf_predict(&twin.kf, scratch);
        assert_same_bits(rig.mem, twin.mem, sizeof rig.mem);
    }
}

static void test_kf_outlier(void **state)
{
    jl_real z[2];
    int f, i;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make(&rig, forms[f], 4, 2);
        z[0] = 1000;
        z[1] = -1000;
        book_start(&rig);
        book_predict(&rig.mode);
        book_update(&rig.mode, z);
        assert_int_equal(call(STEP, z), JL_OK);
        assert_close(rig.loglik, book.loglik,
                     200 * EPS * fabs((double)book.loglik));
        check_book(&rig, 200 * 1000 * EPS);
        for (i = 0; i < 2; i++) {
            z[0] = z[1] = 0;
            assert_int_equal(call(STEP, z), JL_OK);
        }
    }
}

/* --- failures ----------------------------------------------------------- */

static void test_kf_refuses_measurements(void **state)
{
    const jl_real bad[] = { NAN_, INF_, -INF_, JL_REAL_MAX };
    jl_real z[3];
    int f, i, k;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make(&rig, forms[f], 4, 3);
        for (k = 0; k < 4; k++)
            for (i = 0; i < 3; i++) {
                z[0] = z[1] = z[2] = 1;
                z[i] = bad[k];
                assert_int_equal(call(UPDATE, z), JL_ENONFINITE);
                assert_int_equal(call(STEP, z), JL_ENONFINITE);
            }
        make_twin();
        z[0] = z[1] = z[2] = 1;         /* and it goes on as if never asked */
        assert_int_equal(call(STEP, z), JL_OK);
        jl_kf_step(&twin.kf, &twin.loglik, z, scratch);
        check_same(&rig, &twin);
    }
}

/* Also where the sensor is so bad that every result would be moderate. */
static void test_kf_refuses_z_beyond_large(void **state)
{
    jl_real z;
    int f;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make_scalar(&rig, forms[f], 1, 0, JL_LARGE, 0, 1);
        for (z = -2 * JL_LARGE; z <= 2 * JL_LARGE; z += 4 * JL_LARGE) {
            assert_int_equal(call(UPDATE, &z), JL_ENONFINITE);
            assert_int_equal(call(STEP, &z), JL_ENONFINITE);
        }
        z = JL_LARGE;
        assert_int_equal(call(STEP, &z), JL_OK);
        assert_close(rig.kf.x[0], 1, 8 * EPS);
    }
}

/* A form keeps to its scratch, whose size is the header's, and to x, P, nu. */
static void check_form_edges(const jl_kf_form *form, int n, int m)
{
    static jl_real x[MAX + 2 * EDGE], P[MAX * MAX + 2 * EDGE], z[MAX];
    static jl_real nu[MAX + 2 * EDGE];
    jl_innovation got;
    int i, call;

    make(&rig, form, n, m);
    for (i = 0; i < m; i++)
        z[i] = rnd();
    for (call = PREDICT; call <= STEP; call++) {
        for (i = 0; i < JL_FORM_SCRATCH(n, m) + 2 * EDGE; i++)
            scratch[i] = NAN_;
        for (i = 0; i < MAX + 2 * EDGE; i++)
            x[i] = nu[i] = NAN_;
        for (i = 0; i < MAX * MAX + 2 * EDGE; i++)
            P[i] = NAN_;
        memcpy(x + EDGE, rig.kf.x, (size_t)n * sizeof *x);
        memcpy(P + EDGE, rig.kf.P, (size_t)(n * n) * sizeof *P);
        got.nu = nu + EDGE;
        assert_int_equal(call == PREDICT
            ? form->predict(x + EDGE, P + EDGE, &rig.mode, scratch + EDGE)
            : call == UPDATE
            ? form->update(x + EDGE, P + EDGE, &got, &rig.mode, z, 0,
                           scratch + EDGE)
            : form->step(x + EDGE, P + EDGE, &got, &rig.mode, z, 0,
                         scratch + EDGE), JL_OK);
        for (i = 0; i < EDGE; i++) {
            assert_true(isnan(scratch[i]) && isnan(x[i]) && isnan(P[i]));
            assert_true(isnan(scratch[EDGE + JL_FORM_SCRATCH(n, m) + i]));
            assert_true(isnan(x[EDGE + n + i]));
            assert_true(isnan(P[EDGE + n * n + i]));
            assert_true(isnan(nu[i]) && isnan(nu[EDGE + m + i]));
        }
    }
}

static void test_kf_form_keeps_to_its_scratch(void **state)
{
    int f, n, m;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        for (n = 1; n <= SMALL; n++)
            for (m = 1; m <= SMALL; m++)
                check_form_edges(forms[f], n, m);
        check_form_edges(forms[f], MAX, 1);
        check_form_edges(forms[f], 1, MAX);
        check_form_edges(forms[f], MAX, MAX);
    }
}

/* A form that fails leaves the estimate, and all else, as it was. */
static void test_kf_form_fails_alone(void **state)
{
    const jl_real z[2] = { NAN_, 1 };
    jl_real nu[2];
    jl_innovation got;
    int f;

    (void)state;
    got.nu = nu;
    for (f = 0; f < FORMS; f++) {
        make(&rig, forms[f], 3, 2);
        memcpy(&before, &rig, sizeof rig);
        assert_int_equal(forms[f]->update(rig.kf.x, rig.kf.P, &got, &rig.mode,
                                          z, 0, spoilt(&rig)), JL_ENONFINITE);
        check_edges(&rig);
        assert_int_equal(forms[f]->step(rig.kf.x, rig.kf.P, &got, &rig.mode,
                                        z, 0, spoilt(&rig)), JL_ENONFINITE);
        check_edges(&rig);
        assert_same_bits(&rig, &before, sizeof rig);
    }
}

static void test_kf_singular(void **state)
{
    const jl_real z = 1, z2[2] = { 1, 1 };
    int f;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make_scalar(&rig, forms[f], 1, 0, 2, 1, 1);
        rig.mode.R[0] = rig.mode.V[0] = -2;     /* S < 0 */
        assert_int_equal(call(UPDATE, &z), JL_ESINGULAR);
        assert_int_equal(call(STEP, &z), JL_ESINGULAR);
        rig.mode.R[0] = rig.mode.V[0] = -1;     /* S = 0 */
        assert_int_equal(call(UPDATE, &z), JL_ESINGULAR);
        assert_int_equal(call(STEP, &z), JL_ESINGULAR);
        assert_int_equal(call(STEP, NULL), JL_OK);  /* none needs S */
        rig.kf.P[0] = NAN_;
        assert_int_not_equal(call(UPDATE, &z), JL_OK);
        assert_int_not_equal(call(STEP, &z), JL_OK);
        assert_int_equal(call(PREDICT, NULL), JL_ENONFINITE);
        /* two sensors that say the same, with R lost beside P in rounding:
           only factors still know that P becomes R / 2 */
        make(&rig, forms[f], 1, 2);
        rig.kf.P[0] = rig.mode.H[0] = rig.mode.H[1] = 1;
        memset(rig.mode.R, 0, 4 * sizeof(jl_real));
        memset(rig.mode.V, 0, 4 * sizeof(jl_real));
        rig.mode.R[0] = rig.mode.R[3] = JL_EPSILON / 16;
        rig.mode.V[0] = rig.mode.V[3] = JL_EPSILON / 16;
        if (forms[f] == &jl_kf_sqrt) {
            assert_int_equal(call(UPDATE, z2), JL_OK);
            assert_close(rig.kf.P[0] / rig.mode.R[0], 0.5, 4 * EPS);
        } else {
            assert_int_equal(call(UPDATE, z2), JL_ESINGULAR);
        }
    }
}

static void test_kf_blow_up(void **state)
{
    jl_real z = JL_LARGE;
    int f;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make_scalar(&rig, forms[f], JL_LARGE, 1, 1, 2, 0);
        assert_int_equal(call(PREDICT, NULL), JL_ENONFINITE);   /* x */
        assert_int_equal(call(STEP, NULL), JL_ENONFINITE);
        assert_int_equal(call(STEP, &z), JL_ENONFINITE);
        make_scalar(&rig, forms[f], JL_LARGE, 1, 1, 0, 2);
        assert_int_equal(call(PREDICT, NULL), JL_ENONFINITE);   /* P */
        assert_int_equal(call(STEP, &z), JL_ENONFINITE);
        make_scalar(&rig, forms[f], JL_LARGE, 0, 1, 1, 1);      /* just not */
        assert_int_equal(call(PREDICT, NULL), JL_OK);
        assert_true(rig.kf.x[0] == JL_LARGE);
        /* x finite but beyond: H = 1/4 makes it 4 z */
        make_scalar(&rig, forms[f], 1, 0, 1, 0, 1);
        rig.kf.P[0] = JL_LARGE;
        rig.mode.H[0] = JL_C(0.25);
        rig.mode.every = 0;
        assert_int_equal(call(UPDATE, &z), JL_ENONFINITE);
        /* loglik = -z^2 / 2 R is beyond */
        make_scalar(&rig, forms[f], 1, 0, JL_REAL_MIN * 4, 0, 0);
        z = JL_LARGE;
        assert_int_equal(call(UPDATE, &z), JL_ENONFINITE);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kf_init),
        cmocka_unit_test(test_kf_set),
        cmocka_unit_test(test_kf_forms_are_the_textbook),
        cmocka_unit_test(test_kf_innovation),
        cmocka_unit_test(test_kf_counts_do_not_wrap),
        cmocka_unit_test(test_kf_scalar_closed_form),
        cmocka_unit_test(test_kf_largest_sizes),
        cmocka_unit_test(test_kf_joseph_keeps_semidefinite),
        cmocka_unit_test(test_kf_joseph_keeps_what_is_small),
        cmocka_unit_test(test_kf_step_is_predict_and_update),
        cmocka_unit_test(test_kf_scratch_means_nothing),
        cmocka_unit_test(test_kf_missing_measurement),
        cmocka_unit_test(test_kf_outlier),
        cmocka_unit_test(test_kf_refuses_measurements),
        cmocka_unit_test(test_kf_refuses_z_beyond_large),
        cmocka_unit_test(test_kf_form_keeps_to_its_scratch),
        cmocka_unit_test(test_kf_form_fails_alone),
        cmocka_unit_test(test_kf_singular),
        cmocka_unit_test(test_kf_blow_up),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
