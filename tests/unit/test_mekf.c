/* The MEKF and the plain EKF: memory, what they refuse, and that they are as
 * before then.  (That they compute what they ought to: tests/golden.) */
#include "close.h"

#include <stdlib.h>

#include "jumplink/mat.h"
#include "jumplink/mekf.h"

#define NAN_ ((jl_real)NAN)
#define INF_ ((jl_real)INFINITY)
#define EDGE 3

/* --- a model of any size ------------------------------------------------- */

/* What goes wrong with which call of a function. */
enum fault { A_CODE, A_NAN, TOO_LARGE, FAULTS };

struct odd {
    jl_mekf_model model;
    int calls, bad_call, c_calls;
    enum fault fault;
    jl_real gain;                       /* of f                             */
};

/* A number in [-1, 1) that depends on i, j, k only. */
static jl_real scatter(int i, int j, int k)
{
    uint32_t h = (uint32_t)(i * 73 + j * 1021 + k * 7919 + 17);

    h = (h ^ h >> 7) * 2654435761u;
    h = (h ^ h >> 13) * 2246822519u;
    return (jl_real)(h >> 9) / 4194304 - 1;
}

/* Counts a call of n numbers to be written, all 0 before, at x, y that must be
 * within bounds; afterwards spoils what was written, or gives the code to
 * return. */
static void begin(struct odd *odd, const jl_real *out, int n,
                  const jl_real *x, const jl_real *y)
{
    int i;

    assert_true(x == NULL || jl_vec_within(x, odd->model.n, JL_LARGE));
    assert_true(jl_vec_within(y, odd->model.m, JL_LARGE));
    for (i = 0; i < n; i++)
        assert_true(out[i] == 0);
    odd->calls++;
}

static int end(struct odd *odd, jl_real *out, int n)
{
    if (odd->calls != odd->bad_call || n == 0)
        return JL_OK;
    if (odd->fault == A_CODE)
        return JL_ERANGE;
    out[n - 1] = odd->fault == A_NAN ? NAN_ : 2 * JL_LARGE;
    return JL_OK;
}

/* 0.6 I, some off the diagonal, some by y */
static int odd_f(jl_real *f, const jl_real *y, void *context)
{
    struct odd *odd = context;
    int n = odd->model.n, m = odd->model.m, i, j;

    begin(odd, f, n * n, NULL, y);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            f[i * n + j] = odd->gain * ((i == j ? JL_C(0.6) : 0)
                + (JL_C(0.1) + JL_C(0.05) * y[(i + j) % m])
                * scatter(i, j, 1) / (jl_real)n);
    return end(odd, f, n * n);
}

static int odd_df(jl_real *J, const jl_real *x, const jl_real *y,
                  void *context)
{
    struct odd *odd = context;
    int n = odd->model.n, m = odd->model.m, i, j;

    begin(odd, J, n * m, x, y);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            J[i * m + (i + j) % m] += odd->gain * JL_C(0.05)
                * scatter(i, j, 1) / (jl_real)n * x[j];
    return end(odd, J, n * m);
}

static int odd_h(jl_real *y_next, const jl_real *x, const jl_real *y,
                 void *context)
{
    struct odd *odd = context;
    int n = odd->model.n, m = odd->model.m, i;

    begin(odd, y_next, m, x, y);
    for (i = 0; i < m; i++)
        y_next[i] = JL_C(0.9) * y[i] + JL_C(0.1) * x[i % n];
    return end(odd, y_next, m);
}

static int odd_dh(jl_real *J, const jl_real *x, const jl_real *y,
                  void *context)
{
    struct odd *odd = context;
    int n = odd->model.n, m = odd->model.m, i;

    begin(odd, J, m * (n + m), x, y);
    for (i = 0; i < m; i++) {
        J[i * (n + m) + i % n] = JL_C(0.1);
        J[i * (n + m) + n + i] = JL_C(0.9);
    }
    return end(odd, J, m * (n + m));
}

static int odd_c(jl_real *c, const jl_real *x, const jl_real *y,
                 void *context)
{
    struct odd *odd = context;
    int n = odd->model.n, r = odd->model.r, i, j;

    begin(odd, c, r * n, x, y);
    odd->c_calls++;
    for (i = 0; i < r; i++)
        for (j = 0; j < n; j++)
            c[i * n + j] = scatter(i, j, 2) + (j == 0 ? y[0] / 4 : 0);
    return end(odd, c, r * n);
}

static int odd_dc(jl_real *J, const jl_real *x, const jl_real *y,
                  void *context)
{
    struct odd *odd = context;
    int n = odd->model.n, N = n + odd->model.m, r = odd->model.r, i, j;

    begin(odd, J, r * N, x, y);
    for (i = 0; i < r; i++) {
        for (j = 0; j < n; j++)
            J[i * N + j] = scatter(i, j, 2) + (j == 0 ? y[0] / 4 : 0);
        J[i * N + n] = x[0] / 4;
    }
    return end(odd, J, r * N);
}

static int odd_G(jl_real *G1, jl_real *G2, jl_real *G3, const jl_real *x,
                 const jl_real *y, void *context)
{
    struct odd *odd = context;
    const jl_mekf_model *m = &odd->model;
    int i;

    begin(odd, G1, m->n * m->p1, x, y);
    for (i = 0; i < m->n * m->p1; i++)
        G1[i] = scatter(i, 0, 3);
    for (i = 0; i < m->m * m->p1; i++)
        G2[i] = scatter(i, 0, 4);
    for (i = 0; i < m->m * m->p2; i++)
        G3[i] = scatter(i, 0, 5);
    return end(odd, G1, m->n * m->p1);
}

static void odd_init(struct odd *odd, int n, int m, int r, int p1, int p2,
                     int derivatives)
{
    memset(odd, 0, sizeof *odd);
    odd->gain = 1;
    odd->model.n = n;
    odd->model.m = m;
    odd->model.r = r;
    odd->model.p1 = p1;
    odd->model.p2 = p2;
    odd->model.f = odd_f;
    odd->model.h = odd_h;
    odd->model.c = odd_c;
    odd->model.G = odd_G;
    odd->model.context = odd;
    if (derivatives) {
        odd->model.df = odd_df;
        odd->model.dh = odd_dh;
        odd->model.dc = odd_dc;
    }
}

/* --- a filter whose memory's edges are watched --------------------------- */

struct rig {
    struct odd odd;
    jl_mekf f;
    jl_ekf ekf;
    jl_real *block[4];                  /* mem, scratch; the EKF's          */
    int size[4];
    jl_real *Q, *R, *P, *x, *z;
};

/* size reals between edges, all NaN */
static jl_real *watched(jl_real **block, int size)
{
    int i;

    *block = malloc((size_t)(size + 2 * EDGE) * sizeof **block);
    assert_non_null(*block);
    for (i = 0; i < size + 2 * EDGE; i++)
        (*block)[i] = NAN_;
    return *block + EDGE;
}

static void check_edges(const struct rig *rig)
{
    int b, i;

    for (b = 0; b < 4; b++)
        for (i = 0; i < EDGE; i++) {
            assert_true(isnan(rig->block[b][i]));
            assert_true(isnan(rig->block[b][EDGE + rig->size[b] + i]));
        }
}

/* A = B B' + diagonal, B [n,n] */
static jl_real *covariance(int n, jl_real diagonal, int seed)
{
    jl_real *A = malloc((size_t)(n * n) * sizeof *A);
    int i, j, k;

    assert_non_null(A);
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            jl_real s = i == j ? diagonal : 0;

            for (k = 0; k < n; k++)
                s += scatter(i, k, seed) * scatter(j, k, seed) / (jl_real)n;
            A[i * n + j] = A[j * n + i] = s;
        }
    return A;
}

static jl_real *vector(int n, int seed)
{
    jl_real *v = malloc((size_t)n * sizeof *v);
    int i;

    assert_non_null(v);
    for (i = 0; i < n; i++)
        v[i] = scatter(i, 0, seed);
    return v;
}

static jl_real *scratch_of(const struct rig *rig)
{
    return rig->block[1] + EDGE;
}

static jl_real *ekf_scratch_of(const struct rig *rig)
{
    return rig->block[3] + EDGE;
}

static void rig_init(struct rig *rig, int n, int m, int r, int p1, int p2,
                     int derivatives)
{
    jl_real *mem, *ekf_mem;

    memset(rig, 0, sizeof *rig);
    odd_init(&rig->odd, n, m, r, p1, p2, derivatives);
    rig->size[0] = JL_MEKF_STATE(n, m, r, p1, p2);
    rig->size[1] = JL_MEKF_SCRATCH(n, m, r, p1, p2);
    rig->size[2] = JL_EKF_STATE(n, m, r, p1, p2);
    rig->size[3] = JL_EKF_SCRATCH(n, m, r, p1, p2);
    mem = watched(&rig->block[0], rig->size[0]);
    watched(&rig->block[1], rig->size[1]);
    ekf_mem = watched(&rig->block[2], rig->size[2]);
    watched(&rig->block[3], rig->size[3]);
    rig->Q = covariance(p1 + p2, 0, 6);
    rig->R = covariance(r, JL_C(0.1), 7);
    rig->P = covariance(n + m, JL_C(0.1), 8);
    rig->x = vector(n + m, 9);
    rig->z = vector(r, 10);
    assert_int_equal(jl_mekf_init(&rig->f, &rig->odd.model, rig->Q, rig->R,
                                  mem, rig->size[0], scratch_of(rig)), JL_OK);
    assert_int_equal(jl_ekf_init(&rig->ekf, &rig->odd.model, rig->Q, rig->R,
                                 ekf_mem, rig->size[2], ekf_scratch_of(rig)),
                     JL_OK);
    assert_int_equal(jl_mekf_set(&rig->f, rig->x, rig->P, NULL,
                                 scratch_of(rig)), JL_OK);
    assert_int_equal(jl_ekf_set(&rig->ekf, rig->x, rig->P,
                                ekf_scratch_of(rig)), JL_OK);
}

static void rig_close(struct rig *rig)
{
    int b;

    check_edges(rig);
    for (b = 0; b < 4; b++)
        free(rig->block[b]);
    free(rig->Q);
    free(rig->R);
    free(rig->P);
    free(rig->x);
    free(rig->z);
}

static int step(struct rig *rig, const jl_real *z)
{
    return jl_mekf_step(&rig->f, z, scratch_of(rig));
}

static int ekf_step(struct rig *rig, const jl_real *z)
{
    return jl_ekf_step(&rig->ekf, z, ekf_scratch_of(rig));
}

/* The bits of both filters, before and after. */
struct kept {
    jl_real *mem[2];
    jl_mekf f;
    jl_ekf ekf;
};

static void keep(struct kept *kept, const struct rig *rig)
{
    int i;

    for (i = 0; i < 2; i++) {
        size_t octets = (size_t)rig->size[2 * i] * sizeof(jl_real);

        kept->mem[i] = malloc(octets);
        assert_non_null(kept->mem[i]);
        memcpy(kept->mem[i], rig->block[2 * i] + EDGE, octets);
    }
    kept->f = rig->f;
    kept->ekf = rig->ekf;
}

static void check_kept(const struct kept *kept, const struct rig *rig)
{
    int i;

    for (i = 0; i < 2; i++)
        assert_same_bits(kept->mem[i], rig->block[2 * i] + EDGE,
                         (size_t)rig->size[2 * i] * sizeof(jl_real));
    assert_same_bits(&kept->f, &rig->f, sizeof rig->f);
    assert_same_bits(&kept->ekf, &rig->ekf, sizeof rig->ekf);
}

static void let_go(struct kept *kept)
{
    free(kept->mem[0]);
    free(kept->mem[1]);
}

/* --- memory -------------------------------------------------------------- */

/* Upper, and the diagonal not below 0. */
static void check_factor(const jl_real *U, int n)
{
    int i, j;

    for (i = 0; i < n; i++) {
        assert_true(U[i * (n + 1)] >= 0);
        for (j = 0; j < n; j++) {
            assert_true(isfinite(U[i * n + j]));
            assert_true(j >= i || U[i * n + j] == 0);
        }
    }
}

static void test_mekf_memory_every_size(void **state)
{
    static const int sizes[][5] = {     /* n m r p1 p2 */
        { 1, 1, 1, 1, 0 }, { 1, 1, 1, 1, 1 }, { 3, 2, 2, 2, 1 },
        { 1, 5, 1, 1, 4 }, { 5, 1, 7, 3, 1 }, { 2, 2, 1, 9, 3 },
        { 1, JL_MAX_STATES - 1, 1, 1, 0 },
        { JL_MAX_STATES - 1, 1, 1, 1, 0 },
        { 1, 1, JL_MAX_STATES, 1, 0 },
        { 1, 1, 1, 1, JL_MAX_STATES - 1 },
        { 32, JL_MAX_STATES - 32, JL_MAX_STATES, JL_MAX_STATES, 0 }
    };
    size_t s;
    int derivatives, c;

    (void)state;
    for (s = 0; s < sizeof sizes / sizeof *sizes; s++)
        for (derivatives = 0; derivatives < 2; derivatives++)
            for (c = 0; c < 3; c++) {
                const int *of = sizes[s], n = of[0], N = n + of[1];
                struct rig rig;

                rig_init(&rig, n, of[1], of[2], of[3], of[4], derivatives);
                rig.f.c = (jl_mekf_c)c;
                rig.f.spread = c == 1;
                check_factor(rig.f.UQ, of[3] + of[4]);
                check_factor(rig.f.UR, of[2]);
                assert_int_equal(step(&rig, rig.z), JL_OK);
                assert_int_equal(step(&rig, NULL), JL_OK);
                assert_int_equal(step(&rig, rig.z), JL_OK);
                assert_int_equal(ekf_step(&rig, rig.z), JL_OK);
                assert_int_equal(ekf_step(&rig, NULL), JL_OK);
                check_factor(rig.f.U, N);
                check_factor(rig.f.U1, n);
                assert_true(jl_vec_within(rig.f.x, N, JL_LARGE));
                assert_true(jl_vec_within(rig.f.xhat, n, JL_LARGE));
                assert_true(jl_vec_within(rig.ekf.x, N, JL_LARGE));
                rig_close(&rig);
            }
}

static void test_mekf_without_measurement_leaves_c_alone(void **state)
{
    struct rig rig;

    (void)state;
    rig_init(&rig, 3, 2, 2, 2, 1, 0);
    assert_int_equal(step(&rig, NULL), JL_OK);
    assert_int_equal(ekf_step(&rig, NULL), JL_OK);
    assert_int_equal(rig.odd.c_calls, 0);
    rig_close(&rig);
}

/* --- state --------------------------------------------------------------- */

static void check_near(const jl_real *A, const jl_real *B, int n, int stride)
{
    int i, j;

    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            assert_close(A[i * n + j], B[i * stride + j],
                         20 * (double)JL_EPSILON
                         * sqrt((double)B[i * (stride + 1)]
                                * (double)B[j * (stride + 1)]));
}

static void test_mekf_set_and_cov(void **state)
{
    jl_real P[25], P1[9], *other = covariance(3, JL_C(0.5), 11);
    struct rig rig;

    (void)state;
    rig_init(&rig, 3, 2, 2, 2, 1, 1);
    jl_mekf_cov(&rig.f, P, P1);
    check_near(P, rig.P, 5, 5);
    check_near(P1, rig.P, 3, 5);
    assert_same_bits(rig.f.x, rig.x, 5 * sizeof *rig.x);
    assert_same_bits(rig.f.xhat, rig.x, 3 * sizeof *rig.x);
    assert_int_equal(jl_mekf_set(&rig.f, rig.x, rig.P, other,
                                 scratch_of(&rig)), JL_OK);
    jl_mekf_cov(&rig.f, NULL, P1);
    check_near(P1, other, 3, 3);
    jl_mekf_cov(&rig.f, P, NULL);
    check_near(P, rig.P, 5, 5);
    free(other);
    rig_close(&rig);
}

static void test_mekf_starts_at_nought(void **state)
{
    jl_real mem[JL_MEKF_STATE(2, 1, 1, 1, 1)], P[9], P1[4];
    jl_real scratch[JL_MEKF_SCRATCH(2, 1, 1, 1, 1)];
    const jl_real Q[] = { 4, 0, 0, 0 }, R[] = { 0 };
    struct odd odd;
    jl_mekf f;
    int i;

    (void)state;
    odd_init(&odd, 2, 1, 1, 1, 1, 1);
    assert_int_equal(jl_mekf_init(&f, &odd.model, Q, R, mem,
                                  JL_MEKF_STATE(2, 1, 1, 1, 1), scratch),
                     JL_OK);
    assert_true(f.c == JL_MEKF_PREV && f.spread == 0 && f.model == &odd.model);
    assert_true(f.UQ[0] == 2 && f.UQ[1] == 0 && f.UQ[3] == 0 && f.UR[0] == 0);
    jl_mekf_cov(&f, P, P1);
    for (i = 0; i < 9; i++)
        assert_true(P[i] == (i % 4 == 0));
    for (i = 0; i < 4; i++)
        assert_true(P1[i] == (i % 3 == 0));
    for (i = 0; i < 3; i++)
        assert_true(f.x[i] == 0);
    assert_true(f.xhat[0] == 0 && f.xhat[1] == 0);
}

/* P of low rank: its factor has rows of zeros, and is no root of rounding. */
static void test_mekf_semidefinite(void **state)
{
    const jl_real v[] = { 1, JL_C(0.1), -3, JL_C(0.7), 2 };
    jl_real P[25], back[25];
    struct rig rig;
    int i, j;

    (void)state;
    rig_init(&rig, 3, 2, 2, 2, 1, 1);
    for (i = 0; i < 5; i++)
        for (j = 0; j < 5; j++)
            P[i * 5 + j] = v[i] * v[j];
    assert_int_equal(jl_mekf_set(&rig.f, rig.x, P, NULL, scratch_of(&rig)),
                     JL_OK);
    jl_mekf_cov(&rig.f, back, NULL);
    check_near(back, P, 5, 5);
    check_factor(rig.f.U, 5);
    for (i = 1; i < 5; i++)
        for (j = i; j < 5; j++)
            assert_true(rig.f.U[i * 5 + j] == 0);
    assert_int_equal(step(&rig, rig.z), JL_OK);
    rig_close(&rig);
}

/* --- refusals ------------------------------------------------------------ */

static void test_mekf_init_refuses_sizes(void **state)
{
    static const int sizes[][5] = {
        { 0, 1, 1, 1, 1 }, { 1, 0, 1, 1, 1 }, { 1, 1, 0, 1, 1 },
        { 1, 1, 1, 0, 1 }, { 1, 1, 1, 1, -1 }, { -1, 3, 1, 1, 1 },
        { JL_MAX_STATES, 1, 1, 1, 1 }, { 1, JL_MAX_STATES, 1, 1, 1 },
        { 1, INT_MAX, 1, 1, 1 }, { INT_MAX, 1, 1, 1, 1 },
        { 1, 1, JL_MAX_STATES + 1, 1, 1 }, { 1, 1, 1, JL_MAX_STATES, 1 },
        { 1, 1, 1, 1, INT_MAX }
    };
    jl_real mem[64], scratch[64];
    const jl_real one[] = { 1, 0, 0, 1 };
    struct odd odd;
    jl_mekf f, f_before;
    jl_ekf ekf, ekf_before;
    size_t s;

    (void)state;
    memset(&f, 1, sizeof f);
    memset(&ekf, 1, sizeof ekf);
    f_before = f;
    ekf_before = ekf;
    for (s = 0; s < sizeof sizes / sizeof *sizes + 3; s++) {
        if (s < sizeof sizes / sizeof *sizes)
            odd_init(&odd, sizes[s][0], sizes[s][1], sizes[s][2], sizes[s][3],
                     sizes[s][4], 1);
        else
            odd_init(&odd, 1, 1, 1, 1, 1, 1);
        if (s == sizeof sizes / sizeof *sizes)
            odd.model.f = NULL;
        if (s == sizeof sizes / sizeof *sizes + 1)
            odd.model.c = NULL;
        if (s == sizeof sizes / sizeof *sizes + 2)
            odd.model.G = NULL;
        assert_int_equal(jl_mekf_init(&f, &odd.model, one, one, mem, 64,
                                      scratch), JL_EDIM);
        assert_int_equal(jl_ekf_init(&ekf, &odd.model, one, one, mem, 64,
                                     scratch), JL_EDIM);
    }
    odd_init(&odd, 1, 1, 1, 1, 1, 1);
    assert_int_equal(jl_mekf_init(&f, &odd.model, one, one, mem,
                                  JL_MEKF_STATE(1, 1, 1, 1, 1) - 1, scratch),
                     JL_ENOMEM);
    assert_int_equal(jl_ekf_init(&ekf, &odd.model, one, one, mem,
                                 JL_EKF_STATE(1, 1, 1, 1, 1) - 1, scratch),
                     JL_ENOMEM);
    assert_same_bits(&f, &f_before, sizeof f);
    assert_same_bits(&ekf, &ekf_before, sizeof ekf);
}

/* Covariances that are none, [2,2], and their codes. */
static const struct {
    jl_real A[4];
    int status;
} none[] = {
    { { 1, 0, 0, NAN_ }, JL_ENONFINITE }, { { INF_, 0, 0, 1 }, JL_ENONFINITE },
    { { 1, JL_C(0.5), 0, 1 }, JL_EASYM }, { { 1, 2, 2, 1 }, JL_EDEF },
    { { -1, 0, 0, 1 }, JL_EDEF }
};

static void test_mekf_refuses_covariances(void **state)
{
    const jl_real unit[] = { 1, 0, 0, 1 }, x[] = { 1, 2, 3 };
    struct rig rig;
    struct kept kept;
    size_t i;

    (void)state;
    rig_init(&rig, 1, 1, 2, 1, 1, 1);
    keep(&kept, &rig);
    for (i = 0; i < sizeof none / sizeof *none; i++) {
        const jl_real *A = none[i].A;
        int want = none[i].status;

        assert_int_equal(jl_mekf_init(&rig.f, &rig.odd.model, A, unit,
                                      rig.block[0] + EDGE, rig.size[0],
                                      scratch_of(&rig)), want);
        assert_int_equal(jl_mekf_init(&rig.f, &rig.odd.model, unit, A,
                                      rig.block[0] + EDGE, rig.size[0],
                                      scratch_of(&rig)), want);
        assert_int_equal(jl_ekf_init(&rig.ekf, &rig.odd.model, A, unit,
                                     rig.block[2] + EDGE, rig.size[2],
                                     ekf_scratch_of(&rig)), want);
        assert_int_equal(jl_ekf_init(&rig.ekf, &rig.odd.model, unit, A,
                                     rig.block[2] + EDGE, rig.size[2],
                                     ekf_scratch_of(&rig)), want);
        assert_int_equal(jl_mekf_set(&rig.f, x, A, NULL, scratch_of(&rig)),
                         want);
        assert_int_equal(jl_ekf_set(&rig.ekf, x, A, ekf_scratch_of(&rig)),
                         want);
        check_kept(&kept, &rig);
    }
    let_go(&kept);
    rig_close(&rig);

    rig_init(&rig, 2, 1, 1, 1, 1, 1);           /* of P1, too */
    keep(&kept, &rig);
    for (i = 0; i < sizeof none / sizeof *none; i++) {
        assert_int_equal(jl_mekf_set(&rig.f, x, rig.P, none[i].A,
                                     scratch_of(&rig)), none[i].status);
        check_kept(&kept, &rig);
    }
    let_go(&kept);
    rig_close(&rig);
}

static void test_mekf_refuses_numbers(void **state)
{
    const jl_real bad[] = { NAN_, INF_, -INF_, 2 * JL_LARGE };
    struct rig rig;
    struct kept kept;
    size_t i;
    int a;

    (void)state;
    rig_init(&rig, 3, 2, 2, 2, 1, 1);
    keep(&kept, &rig);
    for (i = 0; i < sizeof bad / sizeof *bad; i++) {
        for (a = 0; a < 2; a++) {
            jl_real good = rig.z[a];

            rig.z[a] = bad[i];
            assert_int_equal(step(&rig, rig.z), JL_ENONFINITE);
            assert_int_equal(ekf_step(&rig, rig.z), JL_ENONFINITE);
            rig.z[a] = good;
        }
        for (a = 0; a < 5; a++) {
            jl_real good = rig.x[a];

            rig.x[a] = bad[i];
            assert_int_equal(jl_mekf_set(&rig.f, rig.x, rig.P, NULL,
                                         scratch_of(&rig)), JL_ENONFINITE);
            assert_int_equal(jl_ekf_set(&rig.ekf, rig.x, rig.P,
                                        ekf_scratch_of(&rig)), JL_ENONFINITE);
            rig.x[a] = good;
        }
    }
    check_kept(&kept, &rig);
    let_go(&kept);
    rig_close(&rig);
}

/* Every call of every function fails once, in every way. */
static void test_mekf_functions_fail(void **state)
{
    int derivatives, c, fault, calls, ekf_calls, call;
    struct rig rig;
    struct kept kept;

    (void)state;
    for (derivatives = 0; derivatives < 2; derivatives++)
        for (c = 0; c < 3; c++) {
            rig_init(&rig, 3, 2, 2, 2, 1, derivatives);
            rig.f.c = (jl_mekf_c)c;
            assert_int_equal(step(&rig, rig.z), JL_OK);
            calls = rig.odd.calls;
            assert_int_equal(ekf_step(&rig, rig.z), JL_OK);
            ekf_calls = rig.odd.calls - calls;
            assert_true(calls >= (c == JL_MEKF_PRED ? 7 : 8)
                        - 3 * !derivatives && ekf_calls >= 4);
            keep(&kept, &rig);
            for (fault = 0; fault < FAULTS; fault++)
                for (call = 1; call <= calls; call++) {
                    int want = fault == A_CODE ? JL_ERANGE : JL_ENONFINITE;

                    rig.odd.fault = (enum fault)fault;
                    rig.odd.bad_call = call;
                    rig.odd.calls = 0;
                    assert_int_equal(step(&rig, rig.z), want);
                    assert_int_equal(rig.odd.calls, call);
                    rig.odd.calls = 0;
                    if (call <= ekf_calls)
                        assert_int_equal(ekf_step(&rig, rig.z), want);
                    check_kept(&kept, &rig);
                }
            let_go(&kept);
            rig_close(&rig);
        }
}

/* What grows beyond JL_LARGE: states, and deviations. */
static void test_mekf_refuses_to_overflow(void **state)
{
    const jl_real big = JL_LARGE / 4;
    jl_real x[] = { 0, 0 }, P[] = { 1, 0, 0, 1 };
    struct rig rig;
    struct kept kept;
    int i;

    (void)state;
    for (i = 0; i < 4; i++) {
        rig_init(&rig, 1, 1, 1, 1, 1, 1);
        rig.odd.gain = i < 2 ? 10 : big;
        x[0] = i == 0 ? big : i == 2 ? 100 : 0;
        P[0] = i == 1 ? big * big : i == 3 ? 100 : 1;
        assert_int_equal(jl_mekf_set(&rig.f, x, P, NULL, scratch_of(&rig)),
                         JL_OK);
        assert_int_equal(jl_ekf_set(&rig.ekf, x, P, ekf_scratch_of(&rig)),
                         JL_OK);
        keep(&kept, &rig);
        assert_int_equal(step(&rig, NULL), JL_ENONFINITE);
        assert_int_equal(ekf_step(&rig, NULL), JL_ENONFINITE);
        assert_int_equal(step(&rig, rig.z), JL_ENONFINITE);
        check_kept(&kept, &rig);
        let_go(&kept);
        rig_close(&rig);
    }
}

/* Every element of the array is below JL_LARGE, a deviation above. */
static void test_mekf_refuses_large_deviations(void **state)
{
    jl_real x[] = { 0, 0, 0 }, P[9] = { 0 }, f[4] = { 0 }, most = 0;
    struct rig rig;
    struct kept kept;
    int i;

    (void)state;
    rig_init(&rig, 2, 1, 1, 1, 1, 1);
    assert_int_equal(odd_f(f, x, &rig.odd), JL_OK);
    for (i = 0; i < 4; i++)
        if (f[i] > most)
            most = f[i];
    rig.odd.gain = JL_C(0.99999) / most;
    P[0] = P[4] = JL_LARGE * JL_LARGE;
    P[8] = 1;
    assert_int_equal(jl_mekf_set(&rig.f, x, P, NULL, scratch_of(&rig)),
                     JL_OK);
    assert_int_equal(jl_ekf_set(&rig.ekf, x, P, ekf_scratch_of(&rig)),
                     JL_OK);
    keep(&kept, &rig);
    assert_int_equal(step(&rig, NULL), JL_ENONFINITE);
    assert_int_equal(ekf_step(&rig, NULL), JL_ENONFINITE);
    check_kept(&kept, &rig);
    let_go(&kept);
    rig.odd.gain = JL_C(0.99) / most;
    assert_int_equal(step(&rig, NULL), JL_OK);
    assert_int_equal(ekf_step(&rig, NULL), JL_OK);
    rig_close(&rig);
}

/* --- a singular V -------------------------------------------------------- */

struct rows {
    int r;
    jl_real c[3 * 3];
    jl_real v[3];               /* R = v v' */
};

static int rows_f(jl_real *f, const jl_real *y, void *context)
{
    (void)context;
    f[0] = f[4] = f[8] = JL_C(0.9);
    f[1] = y[0] / 10;
    return JL_OK;
}

static int rows_c(jl_real *c, const jl_real *x, const jl_real *y,
                  void *context)
{
    const struct rows *rows = context;

    (void)x, (void)y;
    memcpy(c, rows->c, (size_t)(rows->r * 3) * sizeof *c);
    return JL_OK;
}

static int rows_G(jl_real *G1, jl_real *G2, jl_real *G3, const jl_real *x,
                  const jl_real *y, void *context)
{
    (void)G3, (void)x, (void)y, (void)context;
    G1[0] = JL_C(0.3);
    G1[1] = JL_C(0.7);
    G2[0] = JL_C(0.1);
    return JL_OK;
}

/* A step with measurements c, R = v v', and R_rr more by last. */
static int step_of_rows(const struct rows *rows, jl_real last, jl_real scale)
{
    static jl_real mem[JL_MEKF_STATE(3, 1, 3, 1, 0)];
    static jl_real scratch[JL_MEKF_SCRATCH(3, 1, 3, 1, 0)];
    jl_mekf_model model = { 0 };
    jl_real x[] = { 1, 2, 3, JL_C(0.2) }, P[16] = { 0 }, R[9] = { 0 };
    const jl_real Q[] = { 1 }, z[] = { 1, 2, 3 };
    jl_mekf f;
    jl_real before[JL_MEKF_STATE(3, 1, 3, 1, 0)];
    int i, status;

    model.n = 3;
    model.m = 1;
    model.r = rows->r;
    model.p1 = 1;
    model.f = rows_f;
    model.c = rows_c;
    model.G = rows_G;
    model.context = (void *)(uintptr_t)rows;
    for (i = 0; i < 4; i++)
        P[i * 5] = scale * (jl_real)(i + 1);
    for (i = 0; i < rows->r * rows->r; i++)
        R[i] = rows->v[i / rows->r] * rows->v[i % rows->r];
    R[rows->r * rows->r - 1] += last;
    assert_int_equal(jl_mekf_init(&f, &model, Q, R, mem,
                                  (int)(sizeof mem / sizeof *mem), scratch),
                     JL_OK);
    assert_int_equal(jl_mekf_set(&f, x, P, NULL, scratch), JL_OK);
    memcpy(before, mem, sizeof mem);
    status = jl_mekf_step(&f, z, scratch);
    if (status != JL_OK)
        assert_same_bits(before, mem, sizeof mem);
    return status;
}

static void test_mekf_singular(void **state)
{
    const struct rows nothing = { 1, { 0 }, { 0 } };
    const struct rows one = { 1, { 1, 2, 3 }, { 0 } };
    struct rows same = { 2, { 0 }, { 0 } }, sum = { 3, { 0 }, { 0 } };
    struct rows noise = { 2, { 0 }, { 0 } };
    int i, k;

    (void)state;
    assert_int_equal(step_of_rows(&nothing, 0, 1), JL_ESINGULAR);
    assert_int_equal(step_of_rows(&nothing, 1, 1), JL_OK);
    assert_int_equal(step_of_rows(&one, 0, 1), JL_OK);
    for (k = 0; k < 500; k++) {
        static const jl_real scales[] = { 1, JL_C(1e6), JL_C(1e-6) };
        jl_real scale = scales[k % 3];

        for (i = 0; i < 3; i++) {
            same.c[i] = scatter(i, k, 12);
            same.c[3 + i] = same.c[i] * (1 + scatter(k, 0, 13) / 2);
            sum.c[i] = scatter(i, k, 14);
            sum.c[3 + i] = scatter(i, k, 15);
            sum.c[6 + i] = sum.c[i] - sum.c[3 + i];
            noise.v[i] = scatter(i, k, 16);
        }
        noise.r = 2 + k % 2;                    /* noise alone, of rank 1 */
        assert_int_equal(step_of_rows(&noise, 0, scale), JL_ESINGULAR);
        noise.r = 2;
        assert_int_equal(step_of_rows(&noise, 1, scale), JL_OK);
        assert_int_equal(step_of_rows(&same, 0, scale), JL_ESINGULAR);
        assert_int_equal(step_of_rows(&same, scale, scale), JL_OK);
        assert_int_equal(step_of_rows(&sum, 0, scale), JL_ESINGULAR);
        assert_int_equal(step_of_rows(&sum, scale, scale), JL_OK);
        sum.r = 2;                              /* two of the three do */
        assert_int_equal(step_of_rows(&sum, 0, scale), JL_OK);
        sum.r = 3;
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mekf_memory_every_size),
        cmocka_unit_test(test_mekf_without_measurement_leaves_c_alone),
        cmocka_unit_test(test_mekf_set_and_cov),
        cmocka_unit_test(test_mekf_starts_at_nought),
        cmocka_unit_test(test_mekf_semidefinite),
        cmocka_unit_test(test_mekf_init_refuses_sizes),
        cmocka_unit_test(test_mekf_refuses_covariances),
        cmocka_unit_test(test_mekf_refuses_numbers),
        cmocka_unit_test(test_mekf_functions_fail),
        cmocka_unit_test(test_mekf_refuses_to_overflow),
        cmocka_unit_test(test_mekf_refuses_large_deviations),
        cmocka_unit_test(test_mekf_singular),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
