/* Modes given by functions: Jacobians, angles, and that whatever a function
 * says or computes, a step is done or nothing has changed.  The tests of
 * filters run over every form. */
#include "close.h"

#include <stdint.h>
#include <stdlib.h>

#include "jumplink/imm.h"

#define EPS ((double)JL_EPSILON)
#define EPS_2_3 cbrt(EPS * EPS)
#define NAN_ ((jl_real)NAN)
#define INF_ ((jl_real)INFINITY)
#define PI_ 3.14159265358979323846
#define EDGE 4

enum { N_MAX = 6, Z_MAX = 3, M = 2 };

/* A form, whether it linearises with Jacobians, and whose bits it gives. */
#define FIXED(n, m) \
    { &JL_KF_FIXED(joseph, n, m), 1, &jl_kf_joseph }, \
    { &JL_KF_FIXED(standard, n, m), 1, &jl_kf_standard }

static const struct {
    const jl_kf_form *form;
    int jacobians;
    const jl_kf_form *same;
} forms[] = {
    { &jl_kf_joseph, 1, NULL },
    { &jl_kf_standard, 1, NULL },
    { &jl_kf_sqrt, 1, NULL },
    { &jl_kf_unscented, 0, NULL },
    FIXED(3, 1), FIXED(4, 2), FIXED(6, 3)
};
enum { FORMS = sizeof forms / sizeof *forms };

static const struct { int n, m; } sizes[] = {
    { 1, 1 }, { 2, 1 }, { 3, 1 }, { 4, 2 }, { 5, 2 }, { 6, 2 }, { 6, 3 }
};
enum { SIZES = sizeof sizes / sizeof *sizes };

static uint32_t seed = 5;

/* Uniform in [-1, 1). */
static jl_real rnd(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (jl_real)(seed >> 8) / 8388608 - 1;
}

/* --- a model, and what goes wrong with it -------------------------------- */

enum { F_, JF, H_, JH, RESIDUAL, NONE };

struct world {
    int n, m, calls[NONE];
    int where, when;            /* this call of this function ...           */
    int code;                   /* ... returns this, or, if that is JL_OK,  */
    int element;                /* ... leaves in this element               */
    jl_real poison;             /* ... this                                 */
    const jl_mode *linear;      /* the model is this one's matrices         */
};

static int told(struct world *w, int where, jl_real *y)
{
    if (w->calls[where]++ != w->when || w->where != where)
        return JL_OK;
    if (w->code == JL_OK)
        y[w->element] = w->poison;
    return w->code;
}

/* f_i = 0.9 x_i + 0.4 sin x_(i+1), h_i = x_i + 0.2 sin(x_i - x_last) */
static int f(jl_real *y, const jl_real *x, void *context)
{
    struct world *w = context;
    jl_real s, c;
    int i;

    for (i = 0; i < w->n; i++) {
        if (jl_sincos(&s, &c, x[(i + 1) % w->n]) != JL_OK)
            return JL_ERANGE;
        y[i] = JL_C(0.9) * x[i] + JL_C(0.4) * s;
    }
    return told(w, F_, y);
}

static int jacobian_f(jl_real *F, const jl_real *x, void *context)
{
    struct world *w = context;
    jl_real s, c;
    int i, n = w->n;

    memset(F, 0, (size_t)(n * n) * sizeof *F);
    for (i = 0; i < n; i++) {
        if (jl_sincos(&s, &c, x[(i + 1) % n]) != JL_OK)
            return JL_ERANGE;
        F[i * n + i] = JL_C(0.9);
        F[i * n + (i + 1) % n] += JL_C(0.4) * c;
    }
    return told(w, JF, F);
}

static int h(jl_real *z, const jl_real *x, void *context)
{
    struct world *w = context;
    jl_real s, c;
    int i;

    for (i = 0; i < w->m; i++) {
        if (jl_sincos(&s, &c, x[i] - x[w->n - 1]) != JL_OK)
            return JL_ERANGE;
        z[i] = x[i] + JL_C(0.2) * s;
    }
    return told(w, H_, z);
}

static int jacobian_h(jl_real *H, const jl_real *x, void *context)
{
    struct world *w = context;
    jl_real s, c;
    int i, n = w->n;

    memset(H, 0, (size_t)(w->m * n) * sizeof *H);
    for (i = 0; i < w->m; i++) {
        if (jl_sincos(&s, &c, x[i] - x[n - 1]) != JL_OK)
            return JL_ERANGE;
        H[i * n + i] = 1 + JL_C(0.2) * c;
        H[i * n + n - 1] -= JL_C(0.2) * c;
    }
    return told(w, JH, H);
}

static void residual(jl_real *d, const jl_real *a, const jl_real *b,
                     void *context)
{
    struct world *w = context;
    int i;

    assert_true(jl_vec_within(a, w->m, JL_REAL_MAX)
                && jl_vec_within(b, w->m, JL_REAL_MAX));
    for (i = 0; i < w->m; i++)
        d[i] = a[i] - b[i];
    (void)told(w, RESIDUAL, d);
}

/* A mode's matrices as functions: the sums as the library has them. */
static void apply(jl_real *y, const jl_real *A, const jl_real *x, int n, int m)
{
    int i, k;

    for (i = 0; i < n; i++)
        for (y[i] = 0, k = 0; k < m; k++)
            y[i] += A[i * m + k] * x[k];
}

static int linear_f(jl_real *y, const jl_real *x, void *context)
{
    struct world *w = context;

    apply(y, w->linear->F, x, w->n, w->n);
    return JL_OK;
}

static int linear_jacobian_f(jl_real *F, const jl_real *x, void *context)
{
    struct world *w = context;

    (void)x;
    memcpy(F, w->linear->F, (size_t)(w->n * w->n) * sizeof *F);
    return JL_OK;
}

static int linear_h(jl_real *z, const jl_real *x, void *context)
{
    struct world *w = context;

    apply(z, w->linear->H, x, w->m, w->n);
    return JL_OK;
}

static int linear_jacobian_h(jl_real *H, const jl_real *x, void *context)
{
    struct world *w = context;

    (void)x;
    memcpy(H, w->linear->H, (size_t)(w->m * w->n) * sizeof *H);
    return JL_OK;
}

/* --- filters with their modes, memory and scratch ------------------------ */

#define MODE_MEM JL_MODE_MEM(N_MAX, Z_MAX, 1)

struct rig {
    jl_mode modes[M];
    jl_nonlinear nonlinear;
    struct world world;
    jl_kf kf;
    jl_imm imm;
    jl_real loglik;
    jl_real mode_mem[M][MODE_MEM];
    jl_real kf_mem[JL_KF_STATE(N_MAX, Z_MAX)];
    jl_real imm_mem[JL_IMM_STATE(M, N_MAX, Z_MAX)];
};

static struct rig rig, twin, before;
static jl_real scratch[JL_IMM_SCRATCH(M, N_MAX, Z_MAX)
                       + JL_MODE_SCRATCH(N_MAX, Z_MAX, 1) + 2 * EDGE];

/* NaN in the scratch, of so many reals, and around it. */
static jl_real *spoilt(int size)
{
    int i;

    for (i = 0; i < size + 2 * EDGE; i++)
        scratch[i] = NAN_;
    return scratch + EDGE;
}

static void check_edges(int size)
{
    int i;

    for (i = 0; i < EDGE; i++) {
        assert_true(isnan(scratch[i]));
        assert_true(isnan(scratch[EDGE + size + i]));
    }
}

/* A = B B' / n + c I */
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
                A[i * n + j] += B[i * n + k] * B[j * n + k] / (jl_real)n;
        }
}

static void make_mode(jl_mode *mode, jl_real *mem, int n, int m)
{
    jl_real F[N_MAX * N_MAX], G[N_MAX], H[Z_MAX * N_MAX], R[Z_MAX * Z_MAX];
    jl_real q = JL_C(0.1), w_bar = rnd();
    int i;

    for (i = 0; i < n * n; i++)
        F[i] = rnd() / (jl_real)n + (i % (n + 1) == 0 ? JL_C(0.6) : 0);
    for (i = 0; i < m * n; i++)
        H[i] = rnd();
    for (i = 0; i < n; i++)
        G[i] = rnd();
    make_cov(R, m, JL_C(0.5));
    assert_int_equal(jl_mode_init(mode, n, m, 1, mem, JL_MODE_MEM(n, m, 1)),
                     JL_OK);
    assert_int_equal(jl_mode_set(mode, F, G, &q, &w_bar, H, R, scratch),
                     JL_OK);
}

/* Where the filters start, and how their modes are nonlinear. */
static struct {
    jl_real x[M * N_MAX], P[M * N_MAX * N_MAX];
    jl_nonlinear nonlinear;
} in;

/* Filters of r's own over r's modes, from in. */
static void bind(struct rig *r, const jl_kf_form *form)
{
    static const jl_real Pi[M * M] = { JL_C(0.9), JL_C(0.1), JL_C(0.2),
                                       JL_C(0.8) };
    static const jl_real mu[M] = { JL_C(0.7), JL_C(0.3) };
    int n = r->modes[0].n, m = r->modes[0].m, j;

    memset(&r->world, 0, sizeof r->world);
    r->world.n = n;
    r->world.m = m;
    r->world.where = NONE;
    r->world.linear = &r->modes[0];
    r->nonlinear = in.nonlinear;
    r->nonlinear.context = &r->world;
    for (j = 0; j < M; j++)
        assert_int_equal(jl_mode_nonlinear(&r->modes[j], &r->nonlinear),
                         JL_OK);
    assert_int_equal(jl_kf_init(&r->kf, &r->modes[0], form, r->kf_mem,
                                JL_KF_STATE(n, m)), JL_OK);
    assert_int_equal(jl_kf_set(&r->kf, in.x, in.P,
                               spoilt(JL_KF_SCRATCH(n, m))), JL_OK);
    assert_int_equal(jl_imm_init(&r->imm, M, r->modes, form, JL_MIX_GENERAL,
                                 r->imm_mem, JL_IMM_STATE(M, n, m)), JL_OK);
    assert_int_equal(jl_imm_chain(&r->imm, Pi), JL_OK);
    assert_int_equal(jl_imm_set(&r->imm, in.x, in.P, mu,
                                spoilt(JL_IMM_SCRATCH(M, n, m))), JL_OK);
    r->loglik = 77;
}

static const jl_nonlinear whole = { f, jacobian_f, h, jacobian_h, residual,
                                    NULL, 0 };

static void make(struct rig *r, const jl_kf_form *form, int n, int m)
{
    int j, i;

    for (j = 0; j < M; j++) {
        make_mode(&r->modes[j], r->mode_mem[j], n, m);
        make_cov(in.P + j * n * n, n, JL_C(0.1));
        for (i = 0; i < n; i++)
            in.x[j * n + i] = 2 * rnd();
    }
    in.nonlinear = whole;
    bind(r, form);
}

/* The same modes in the twin, linear or nonlinear as `how` says. */
static void make_twin(const jl_kf_form *form, const jl_nonlinear *how)
{
    int n = rig.modes[0].n, m = rig.modes[0].m, j;

    for (j = 0; j < M; j++) {
        assert_int_equal(jl_mode_init(&twin.modes[j], n, m, 1,
                                      twin.mode_mem[j], MODE_MEM), JL_OK);
        memcpy(twin.mode_mem[j], rig.mode_mem[j], sizeof twin.mode_mem[j]);
    }
    if (how != NULL)
        in.nonlinear = *how;
    bind(&twin, form);
    for (j = 0; j < M && how == NULL; j++)
        assert_int_equal(jl_mode_nonlinear(&twin.modes[j], NULL), JL_OK);
}

static int fits(const jl_kf_form *form, int n, int m)
{
    return form->n == 0 || (form->n == n && form->m == m);
}

static int kf_step(struct rig *r, const jl_real *z)
{
    int size = JL_KF_SCRATCH(r->modes[0].n, r->modes[0].m), status;

    status = jl_kf_step(&r->kf, &r->loglik, z, spoilt(size));
    check_edges(size);
    return status;
}

static int imm_step(struct rig *r, const jl_real *z)
{
    int size = JL_IMM_SCRATCH(M, r->modes[0].n, r->modes[0].m), status;

    status = jl_imm_step(&r->imm, z, spoilt(size));
    check_edges(size);
    return status;
}

/* The estimates of two rigs, in units of their deviations. */
static void check_close(const struct rig *a, const struct rig *b,
                        double within)
{
    int n = a->modes[0].n, i, j;
    jl_real P[N_MAX * N_MAX], Q[N_MAX * N_MAX];

    jl_kf_cov(&a->kf, P);
    jl_kf_cov(&b->kf, Q);
    for (i = 0; i < n; i++) {
        double si = sqrt((double)Q[i * (n + 1)]);

        assert_close(a->kf.x[i], b->kf.x[i], within * si);
        assert_close(a->imm.xhat[i], b->imm.xhat[i],
                     within * sqrt((double)b->imm.Phat[i * (n + 1)]));
        for (j = 0; j < n; j++)
            assert_close(P[i * n + j], Q[i * n + j],
                         within * si * sqrt((double)Q[j * (n + 1)]));
    }
    for (j = 0; j < M; j++)
        assert_close(a->imm.mu[j], b->imm.mu[j], within);
    assert_close(a->loglik, b->loglik,
                 within * (1 + fabs((double)b->loglik)));
    assert_close(a->imm.loglik, b->imm.loglik,
                 within * (1 + fabs((double)b->imm.loglik)));
}

static void check_same(const struct rig *a, const struct rig *b)
{
    size_t n = (size_t)a->modes[0].n;

    assert_same_bits(a->kf.x, b->kf.x, n * sizeof(jl_real));
    assert_same_bits(a->kf.P, b->kf.P, n * n * sizeof(jl_real));
    assert_same_bits(&a->loglik, &b->loglik, sizeof a->loglik);
    assert_same_bits(a->imm.x, b->imm.x, M * n * sizeof(jl_real));
    assert_same_bits(a->imm.P, b->imm.P, M * n * n * sizeof(jl_real));
    assert_same_bits(a->imm.logmu, b->imm.logmu, M * sizeof(jl_real));
    assert_same_bits(a->imm.mu, b->imm.mu, M * sizeof(jl_real));
}

static void measure(jl_real *z, int m)
{
    int i;

    for (i = 0; i < m; i++)
        z[i] = 2 * rnd();
}

/* --- the two models ------------------------------------------------------ */

static void test_nonlinear_adds_noise_mean(void **state)
{
    jl_real x[3] = { 1, -2, JL_C(0.5) }, xp[3], y[3], s[9];
    int i;

    (void)state;
    make(&rig, &jl_kf_joseph, 3, 2);
    assert_int_equal(jl_mode_move(xp, NULL, &rig.modes[0], x, s), JL_OK);
    assert_int_equal(f(y, x, &rig.world), JL_OK);
    for (i = 0; i < 3; i++) {
        assert_true(fabs((double)rig.modes[0].u[i]) > 0);
        assert_close(xp[i], y[i] + rig.modes[0].u[i], 0);
    }
}

static void test_nonlinear_innovation(void **state)
{
    jl_real x[3] = { 1, -2, JL_C(0.5) }, z[2] = { 4, 5 }, nu[2], y[2];
    int i;

    (void)state;
    make(&rig, &jl_kf_joseph, 3, 2);
    rig.nonlinear.residual = NULL;
    assert_int_equal(jl_mode_sense(nu, NULL, &rig.modes[0], z, x, NULL), JL_OK);
    assert_int_equal(h(y, x, &rig.world), JL_OK);
    for (i = 0; i < 2; i++)
        assert_close(nu[i], z[i] - y[i], 0);
    rig.nonlinear.residual = residual;
    rig.world.where = RESIDUAL;         /* it has the last word */
    rig.world.poison = 33;
    rig.world.element = 1;
    assert_int_equal(jl_mode_sense(nu, NULL, &rig.modes[0], z, x, NULL), JL_OK);
    assert_close(nu[0], z[0] - y[0], 0);
    assert_close(nu[1], 33, 0);
}

/* Each member that is NULL is the mode's matrix, alone and all together. */
static void test_nonlinear_falls_back_to_matrices(void **state)
{
    static const jl_nonlinear none = { NULL, NULL, NULL, NULL, NULL, NULL, 0 };
    static const jl_nonlinear jacobians = { NULL, jacobian_f, NULL, jacobian_h,
                                            NULL, NULL, 0 };
    jl_real z[Z_MAX];
    int k, s, i;

    (void)state;
    for (k = 0; k < FORMS; k++)
        for (s = 0; s < SIZES; s++) {
            if (!fits(forms[k].form, sizes[s].n, sizes[s].m))
                continue;
            make(&rig, forms[k].form, sizes[s].n, sizes[s].m);
            in.nonlinear = s % 2 ? none : jacobians;
            bind(&rig, forms[k].form);
            make_twin(forms[k].form, NULL);
            for (i = 0; i < 10; i++) {
                measure(z, sizes[s].m);
                assert_int_equal(kf_step(&rig, z), JL_OK);
                assert_int_equal(imm_step(&rig, z), JL_OK);
                assert_int_equal(kf_step(&twin, z), JL_OK);
                assert_int_equal(imm_step(&twin, z), JL_OK);
                check_same(&rig, &twin);
            }
            assert_int_equal(rig.world.calls[JF] + rig.world.calls[JH], 0);
        }
}

/* Half of it: a matrix and a function, either way. */
static void test_nonlinear_halves(void **state)
{
    jl_real x[4] = { 1, -2, JL_C(0.5), 3 }, z[2] = { 1, 2 }, y[4], A[16];
    jl_real want[4], s[12];

    (void)state;
    make(&rig, &jl_kf_joseph, 4, 2);
    make_twin(&jl_kf_joseph, NULL);
    rig.nonlinear.f = NULL;
    rig.nonlinear.jacobian_f = NULL;
    assert_int_equal(jl_mode_move(y, A, &rig.modes[0], x, s), JL_OK);
    assert_int_equal(jl_mode_move(want, NULL, &twin.modes[0], x, s), JL_OK);
    assert_same_bits(y, want, sizeof y);
    assert_same_bits(A, rig.modes[0].F, sizeof A);
    assert_int_equal(rig.world.calls[F_], 0);
    rig.nonlinear = whole;
    rig.nonlinear.context = &rig.world;
    rig.nonlinear.h = NULL;
    assert_int_equal(jl_mode_sense(y, A, &rig.modes[0], z, x, s), JL_OK);
    assert_int_equal(jl_mode_sense(want, NULL, &twin.modes[0], z, x, s), JL_OK);
    assert_same_bits(y, want, 2 * sizeof *y);
    assert_same_bits(A, rig.modes[0].H, 8 * sizeof *A);
    assert_int_equal(rig.world.calls[RESIDUAL], 1);
}

static void test_nonlinear_model_may_be_set_anew(void **state)
{
    jl_motion motion = { JL_MOTION_CV, 2, 2, 1, 0, 20, 0 };
    jl_mode *a = &rig.modes[0];
    jl_real F[16], mem[JL_MODE_MEM(4, 2, 2)], q[4] = { 1, 0, 0, 1 };
    jl_real G[8] = { 1, 0, 0, 1, 1, 0, 0, 1 };
    jl_real H[8] = { 1, 0, 0, 0, 0, 0, 1, 0 };

    (void)state;
    make(&rig, &jl_kf_joseph, 4, 2);
    assert_int_equal(jl_mode_init(a, 4, 2, 2, mem, JL_MODE_MEM(4, 2, 2)), 0);
    assert_null(a->nonlinear);
    assert_true(a->move == NULL && a->sense == NULL);
    assert_int_equal(jl_mode_nonlinear(a, &rig.nonlinear), JL_OK);
    assert_int_equal(jl_mode_motion(a, &motion, 1), JL_OK);
    assert_ptr_equal(a->nonlinear, &rig.nonlinear);
    assert_true(a->move == jl_mode_move && a->sense == jl_mode_sense);
    memcpy(F, a->F, sizeof F);
    assert_int_equal(jl_mode_set(a, F, G, q, NULL, H, q, scratch), JL_OK);
    assert_ptr_equal(a->nonlinear, &rig.nonlinear);
    assert_true(a->move == jl_mode_move && a->sense == jl_mode_sense);
    assert_same_bits(a->F, F, sizeof F);
    assert_int_equal(jl_mode_nonlinear(a, NULL), JL_OK);
    assert_null(a->nonlinear);
    assert_true(a->move == NULL && a->sense == NULL);
}

/* What functions stand for needs no matrix. */
static void test_nonlinear_needs_no_matrices(void **state)
{
    jl_mode *a = &rig.modes[0];
    jl_real G[3] = { 1, 2, 3 }, q = 1, w_bar = 2, R[4] = { 1, 0, 0, 1 };
    int i;

    (void)state;
    make(&rig, &jl_kf_joseph, 3, 2);
    assert_int_equal(jl_mode_set(a, NULL, G, &q, &w_bar, NULL, R, scratch),
                     JL_OK);
    for (i = 0; i < 9; i++) {
        assert_true(a->F[i] == 0);
        assert_true(a->H[i % 6] == 0);
        assert_true(a->u[i % 3] == 2 * G[i % 3]);
    }
    assert_int_equal(jl_mode_set(a, NULL, G, &q, NULL, NULL, R, scratch),
                     JL_OK);
    for (i = 0; i < 3; i++)
        assert_true(a->u[i] == 0);
}

static void test_nonlinear_refuses_kappa(void **state)
{
    const jl_real bad[] = { -1, -JL_EPSILON, NAN_, INF_, 2 * JL_LARGE };
    int i;

    (void)state;
    make(&rig, &jl_kf_joseph, 3, 2);
    in.nonlinear = whole;
    for (i = 0; i < 5; i++) {
        in.nonlinear.kappa = bad[i];
        before = rig;
        assert_int_equal(jl_mode_nonlinear(&rig.modes[0], &in.nonlinear),
                         JL_ERANGE);
        assert_same_bits(&rig, &before, sizeof rig);
    }
    in.nonlinear.kappa = 2;
    assert_int_equal(jl_mode_nonlinear(&rig.modes[0], &in.nonlinear), JL_OK);
}

/* --- Jacobians ----------------------------------------------------------- */

/* Against the given ones, at many places and scales.  |f| <= 0.9 |x| + 0.4 is
 * computed with an error below 2 eps of it, |f'''| <= 0.4. */
static void test_nonlinear_jacobian_f_by_differences(void **state)
{
    jl_real x[N_MAX], xp[N_MAX], F[N_MAX * N_MAX], want[N_MAX * N_MAX];
    double most, scale;
    int k, s, i, j, n;

    (void)state;
    for (k = 0; k < 400; k++)
        for (s = 0; s < SIZES; s++) {
            n = sizes[s].n;
            make(&rig, &jl_kf_joseph, n, sizes[s].m);
            rig.nonlinear.jacobian_f = NULL;
            most = 0;
            for (i = 0; i < n; i++) {
                x[i] = rnd() * (k % 3 == 0 ? 1 : k % 3 == 1 ? 100 : JL_C(1e-4));
                most = fmax(most, fabs((double)x[i]));
            }
            assert_int_equal(jl_mode_move(xp, F, &rig.modes[0], x,
                                          spoilt(3 * n)), JL_OK);
            check_edges(3 * n);
            assert_int_equal(rig.world.calls[F_], 1 + 2 * n);
            assert_int_equal(jacobian_f(want, x, &rig.world), JL_OK);
            for (i = 0; i < n; i++)
                for (j = 0; j < n; j++) {
                    scale = fmax(1, fabs((double)x[j]));
                    assert_close(F[i * n + j], want[i * n + j], EPS_2_3
                                 * (scale * scale * 0.4 / 6
                                    + 2 * (0.9 * most + 0.4) / scale));
                }
        }
}

static void test_nonlinear_jacobian_h_by_differences(void **state)
{
    jl_real x[N_MAX], z[Z_MAX], nu[Z_MAX], H[Z_MAX * N_MAX];
    jl_real want[Z_MAX * N_MAX];
    int k, s, i, n, m, hook;

    (void)state;
    for (k = 0; k < 400; k++)
        for (s = 0; s < SIZES; s++)
            for (hook = 0; hook < 2; hook++) {
                n = sizes[s].n;
                m = sizes[s].m;
                make(&rig, &jl_kf_joseph, n, m);
                rig.nonlinear.jacobian_h = NULL;
                if (!hook)
                    rig.nonlinear.residual = NULL;
                for (i = 0; i < n; i++)
                    x[i] = rnd();
                measure(z, m);
                assert_int_equal(jl_mode_sense(nu, H, &rig.modes[0], z, x,
                                               spoilt(n + 2 * m)), JL_OK);
                check_edges(n + 2 * m);
                assert_int_equal(rig.world.calls[H_], 1 + 2 * n);
                assert_int_equal(rig.world.calls[RESIDUAL],
                                 hook ? 1 + n : 0);
                assert_int_equal(jacobian_h(want, x, &rig.world), JL_OK);
                for (i = 0; i < m * n; i++)
                    assert_close(H[i], want[i],
                                 EPS_2_3 * (0.2 / 6 + 2 * 1.2));
            }
}

/* --- angles -------------------------------------------------------------- */

/* The bearing of (x, y), from (-pi, pi]. */
static int bearing(jl_real *z, const jl_real *x, void *context)
{
    (void)context;
    z[0] = jl_atan2(x[1], x[0]);
    return JL_OK;
}

static void wrapped(jl_real *d, const jl_real *a, const jl_real *b,
                    void *context)
{
    const jl_real pi = JL_C(3.14159265358979323846);

    (void)context;
    d[0] = a[0] - b[0];
    if (d[0] >= pi)
        d[0] -= 2 * pi;
    else if (d[0] < -pi)
        d[0] += 2 * pi;
}

static const jl_nonlinear by_bearing = { NULL, NULL, bearing, NULL, wrapped,
                                         NULL, 0 };

/* West of the sensor, where the bearing jumps: in the innovation, and between
 * the two ends of a difference. */
static void test_nonlinear_angles_wrap(void **state)
{
    static const jl_real ys[] = { 0, JL_C(1e-7), JL_C(-1e-7), JL_C(0.01),
                                  JL_C(-0.01) };
    jl_real x[2], z, nu, H[2], s[4];
    double want;
    int i, side;

    (void)state;
    make(&rig, &jl_kf_joseph, 2, 1);
    assert_int_equal(jl_mode_nonlinear(&rig.modes[0], &by_bearing), JL_OK);
    for (i = 0; i < 5; i++)
        for (side = -1; side <= 1; side += 2) {
            x[0] = -2;
            x[1] = ys[i];
            z = (jl_real)(side * (PI_ - 0.125));
            assert_int_equal(jl_mode_sense(&nu, H, &rig.modes[0], &z, x, s),
                             JL_OK);
            want = (double)z - atan2((double)x[1], -2);
            want -= 2 * PI_ * nearbyint(want / (2 * PI_));
            assert_close(nu, want, 8 * EPS);
            /* y / r^2 and -x / r^2, with third derivatives of 2 / r^3 */
            assert_close(H[0], -(double)x[1] / (4 + (double)(x[1] * x[1])),
                         EPS_2_3 * (4 * 0.25 / 6 + PI_ / 2));
            assert_close(H[1], -2 / (4 + (double)(x[1] * x[1])),
                         EPS_2_3 * (0.25 / 6 + PI_));
        }
}

/* So a filter follows what passes there as it does anywhere else. */
static void test_nonlinear_filter_across_pi(void **state)
{
    jl_real x[2] = { -100, -30 }, P[4] = { 400, 0, 0, 400 }, z, scale = 0;
    const jl_real F[4] = { 1, 0, 0, 1 }, G[2] = { 0, 1 }, R = JL_C(1e-4);
    const jl_real H[2] = { 0, 0 }, q = 1, step = 5;
    int k, i, crossed = 0;

    (void)state;
    for (k = 0; k < FORMS; k++) {
        if (!fits(forms[k].form, 2, 1))
            continue;
        make(&rig, forms[k].form, 2, 1);
        assert_int_equal(jl_mode_set(&rig.modes[0], F, G, &q, &step, H, &R,
                                     scratch), JL_OK);
        assert_int_equal(jl_mode_nonlinear(&rig.modes[0], &by_bearing), JL_OK);
        assert_int_equal(jl_kf_set(&rig.kf, x, P, scratch), JL_OK);
        for (i = 1; i <= 12; i++) {
            double y = -30 + 5.0 * i;

            z = (jl_real)atan2(y, -100);
            crossed += z > 3;
            assert_int_equal(kf_step(&rig, &z), JL_OK);
            scale = -100 / rig.kf.x[0];
            assert_close(rig.kf.x[1] * scale, y, 1);
            assert_close(rig.kf.innovation.nu[0], 0, 0.02);
        }
    }
    assert_true(crossed > 0);
}

/* --- a linear model as functions ----------------------------------------- */

static const jl_nonlinear linear = { linear_f, linear_jacobian_f, linear_h,
                                     linear_jacobian_h, NULL, NULL, 0 };
static const jl_nonlinear linear_by_differences = { linear_f, NULL, linear_h,
                                                    NULL, residual, NULL, 0 };

/* With its Jacobians the bits; by differences or sigma points up to rounding,
 * of which differences magnify theirs. */
static void test_nonlinear_linear_functions_are_matrices(void **state)
{
    jl_real z[Z_MAX];
    int k, s, i, j, given;

    (void)state;
    for (k = 0; k < FORMS; k++)
        for (s = 0; s < SIZES; s++)
            for (given = 0; given < 2; given++) {
                if (!fits(forms[k].form, sizes[s].n, sizes[s].m))
                    continue;
                make(&rig, forms[k].form, sizes[s].n, sizes[s].m);
                memcpy(rig.mode_mem[1], rig.mode_mem[0],
                       sizeof rig.mode_mem[1]);
                in.nonlinear = given ? linear : linear_by_differences;
                bind(&rig, forms[k].form);
                make_twin(forms[k].form, NULL);
                for (i = 0; i < 20; i++) {
                    const jl_real *got = i % 7 == 5 ? NULL : z;

                    measure(z, sizes[s].m);
                    for (j = 0; j < 2; j++) {
                        struct rig *r = j ? &twin : &rig;

                        assert_int_equal(kf_step(r, got), JL_OK);
                        assert_int_equal(imm_step(r, got), JL_OK);
                    }
                    if (given && forms[k].jacobians)
                        check_same(&rig, &twin);
                    else
                        check_close(&rig, &twin, forms[k].jacobians
                                    ? 40 * EPS_2_3 : 200 * EPS);
                }
            }
}

/* The forms that linearise differ in rounding only, those of fixed size from
 * those of any in nothing. */
static void test_nonlinear_forms_agree(void **state)
{
    jl_real z[Z_MAX];
    int k, s, i, j;

    (void)state;
    for (k = 1; k < FORMS; k++)
        for (s = 0; s < SIZES; s++) {
            if (!forms[k].jacobians
                || !fits(forms[k].form, sizes[s].n, sizes[s].m))
                continue;
            make(&rig, forms[k].same != NULL ? forms[k].same : &jl_kf_joseph,
                 sizes[s].n, sizes[s].m);
            make_twin(forms[k].form, &whole);
            for (i = 0; i < 40; i++) {
                measure(z, sizes[s].m);
                for (j = 0; j < 2; j++) {
                    assert_int_equal(kf_step(j ? &twin : &rig, z), JL_OK);
                    assert_int_equal(imm_step(j ? &twin : &rig, z), JL_OK);
                }
                if (forms[k].same != NULL)
                    check_same(&twin, &rig);
                else
                    check_close(&twin, &rig, 1e4 * EPS);
            }
        }
}

/* --- functions that fail ------------------------------------------------- */

/* The models themselves refuse, whatever a form would notice. */
static void test_nonlinear_models_refuse_what_is_not_finite(void **state)
{
    const jl_real bad[] = { NAN_, INF_, -INF_, 2 * JL_LARGE, -2 * JL_LARGE };
    jl_real x[3] = { 1, -2, JL_C(0.5) }, z[2] = { 4, 5 }, y[3], A[9];
    int where, c;

    (void)state;
    for (where = F_; where < NONE; where++)
        for (c = 0; c < (where < RESIDUAL ? 5 : 3); c++) {
            make(&rig, &jl_kf_joseph, 3, 2);
            rig.world.where = where;
            rig.world.element = where == JH ? 5 : where == JF ? 8 : 1;
            rig.world.poison = bad[c];
            assert_int_equal(jl_mode_move(y, A, &rig.modes[0], x, NULL),
                             where <= JF ? JL_ENONFINITE : JL_OK);
            assert_int_equal(jl_mode_sense(y, A, &rig.modes[0], z, x, NULL),
                             where > JF ? JL_ENONFINITE : JL_OK);
        }
}

/* A step in which the call `when` of function `where` goes wrong: returns
 * whether there is such a call. */
static int try_failure(int imm, int where, int when, int code,
                       int element, jl_real poison)
{
    jl_real z[Z_MAX];
    int status, want = code == JL_OK ? JL_ENONFINITE : code;

    measure(z, rig.world.m);
    memset(rig.world.calls, 0, sizeof rig.world.calls);
    rig.world.where = where;
    rig.world.when = when;
    rig.world.code = code;
    rig.world.element = element;
    rig.world.poison = poison;
    before = rig;
    status = imm ? imm_step(&rig, z) : kf_step(&rig, z);
    rig.world.where = NONE;
    if (rig.world.calls[where] <= when) {       /* it was never asked */
        assert_int_equal(status, JL_OK);
        return 0;
    }
    assert_int_equal(status, want);
    if (imm) {
        assert_ptr_equal(rig.imm.x, before.imm.x);
        assert_int_equal(jl_imm_weigh(&rig.imm), JL_EORDER);
    } else {
        assert_same_bits(&rig.kf, &before.kf, sizeof rig.kf);
    }
    check_same(&rig, &twin);            /* a rig that was never asked */
    return 1;
}

static void try_failures(const jl_kf_form *form, int jacobians, int n, int m)
{
    static const int codes[] = { JL_ERANGE, JL_ESINGULAR, JL_OK, JL_OK, JL_OK,
                                 JL_OK };
    const jl_real poisons[] = { 0, 0, NAN_, INF_, -INF_, 2 * JL_LARGE };
    int where, when, c, imm, given, tried;

    for (given = 0; given < 2; given++)
        for (imm = 0; imm < 2; imm++)
            for (where = F_; where <= JH; where++)
                for (c = 0; c < 6; c++) {
                    make(&rig, form, n, m);
                    if (!given)
                        in.nonlinear.jacobian_f = in.nonlinear.jacobian_h
                            = NULL;
                    bind(&rig, form);
                    make_twin(form, &in.nonlinear);
                    for (when = 0, tried = 0; ; when++) {
                        int element = (int)((unsigned)when * 7u + (unsigned)c)
                            % (where <= JF ? n : m);

                        if (!try_failure(imm, where, when, codes[c], element,
                                         poisons[c]))
                            break;
                        tried++;
                    }
                    assert_true(tried > 0
                                || ((where == JF || where == JH)
                                    && (!given || !jacobians)));
                }
}

static void test_nonlinear_failures_change_nothing(void **state)
{
    int k, s;

    (void)state;
    for (k = 0; k < FORMS; k++)
        for (s = 0; s < SIZES; s++)
            if (fits(forms[k].form, sizes[s].n, sizes[s].m))
                try_failures(forms[k].form, forms[k].jacobians, sizes[s].n,
                             sizes[s].m);
}

/* A residual has no code, but may compute nonsense. */
static void test_nonlinear_residual_that_is_not_finite(void **state)
{
    const jl_real poisons[] = { NAN_, INF_, -INF_ };
    int k, c, imm, when;

    (void)state;
    for (k = 0; k < FORMS; k++)
        for (c = 0; c < 3; c++)
            for (imm = 0; imm < 2; imm++) {
                if (!fits(forms[k].form, 4, 2))
                    continue;
                make(&rig, forms[k].form, 4, 2);
                in.nonlinear.jacobian_h = NULL;
                bind(&rig, forms[k].form);
                make_twin(forms[k].form, &in.nonlinear);
                for (when = 0; try_failure(imm, RESIDUAL, when, JL_OK,
                                           when % 2, poisons[c]); when++)
                    ;
                assert_true(when >= 1 + 4);
            }
}

/* After a failure, the step is done as if never tried. */
static void test_nonlinear_goes_on_after_failure(void **state)
{
    jl_real z[2];
    int k, i, j;

    (void)state;
    for (k = 0; k < FORMS; k++) {
        if (!fits(forms[k].form, 4, 2))
            continue;
        make(&rig, forms[k].form, 4, 2);
        make_twin(forms[k].form, &whole);
        for (i = 0; i < 8; i++) {
            assert_true(try_failure(i % 2, i % 4 < 2 ? F_ : H_, i % 2,
                                    JL_ERANGE, 0, 0));
            measure(z, 2);
            for (j = 0; j < 2; j++) {
                assert_int_equal(kf_step(j ? &twin : &rig, z), JL_OK);
                assert_int_equal(imm_step(j ? &twin : &rig, z), JL_OK);
            }
            check_same(&rig, &twin);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nonlinear_adds_noise_mean),
        cmocka_unit_test(test_nonlinear_innovation),
        cmocka_unit_test(test_nonlinear_falls_back_to_matrices),
        cmocka_unit_test(test_nonlinear_halves),
        cmocka_unit_test(test_nonlinear_model_may_be_set_anew),
        cmocka_unit_test(test_nonlinear_needs_no_matrices),
        cmocka_unit_test(test_nonlinear_refuses_kappa),
        cmocka_unit_test(test_nonlinear_jacobian_f_by_differences),
        cmocka_unit_test(test_nonlinear_jacobian_h_by_differences),
        cmocka_unit_test(test_nonlinear_angles_wrap),
        cmocka_unit_test(test_nonlinear_filter_across_pi),
        cmocka_unit_test(test_nonlinear_linear_functions_are_matrices),
        cmocka_unit_test(test_nonlinear_forms_agree),
        cmocka_unit_test(test_nonlinear_models_refuse_what_is_not_finite),
        cmocka_unit_test(test_nonlinear_failures_change_nothing),
        cmocka_unit_test(test_nonlinear_residual_that_is_not_finite),
        cmocka_unit_test(test_nonlinear_goes_on_after_failure),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
