/* Modes and chains: closed forms, every code, and nothing written on error. */
#include "close.h"

#include <stdint.h>
#include <stdlib.h>

#include "jumplink/model.h"

#define MAX JL_MAX_STATES
#define EPS ((double)JL_EPSILON)
#define NAN_ ((jl_real)NAN)
#define INF_ ((jl_real)INFINITY)

static uint32_t seed = 7;

/* Uniform in [-1, 1). */
static jl_real rnd(void)
{
    seed = seed * 1664525u + 1013904223u;
    return (jl_real)(seed >> 8) / 8388608 - 1;
}

/* --- a mode with its memory, and what it was before a call -------------- */

#define EDGE 4
#define CAP (JL_MODE_MEM(MAX, MAX, MAX) + 2 * EDGE)

struct rig {
    jl_mode mode;
    jl_real mem[CAP];                   /* EDGE reals of NaN, mode, NaN */
};

static struct rig rig, other, before;
static jl_real scratch[JL_MODE_SCRATCH(MAX, MAX, MAX) + EDGE];

static void make(struct rig *r, int n, int m, int p)
{
    int i;

    for (i = 0; i < CAP; i++)
        r->mem[i] = NAN_;
    assert_int_equal(jl_mode_init(&r->mode, n, m, p, r->mem + EDGE,
                                  JL_MODE_MEM(n, m, p)), JL_OK);
}

static void check_edges(const struct rig *r)
{
    const jl_mode *a = &r->mode;
    int i;

    for (i = 0; i < EDGE; i++) {
        assert_true(isnan(r->mem[i]));
        assert_true(isnan(r->mem[EDGE + JL_MODE_MEM(a->n, a->m, a->p) + i]));
    }
}

static void check_same(const jl_mode *a, const jl_mode *b)
{
    size_t n = (size_t)a->n, m = (size_t)a->m, p = (size_t)a->p;

    assert_same_bits(a->F, b->F, n * n * sizeof(jl_real));
    assert_same_bits(a->W, b->W, n * n * sizeof(jl_real));
    assert_same_bits(a->u, b->u, n * sizeof(jl_real));
    assert_same_bits(a->H, b->H, m * n * sizeof(jl_real));
    assert_same_bits(a->R, b->R, m * m * sizeof(jl_real));
    assert_same_bits(a->V, b->V, m * m * sizeof(jl_real));
    assert_same_bits(a->N, b->N, n * p * sizeof(jl_real));
    assert_same_bits(a->q, b->q, p * sizeof(jl_real));
}

/* --- init --------------------------------------------------------------- */

static void test_mode_init_refuses(void **state)
{
    static const int bad[] = { 0, -1, MAX + 1, INT_MAX, INT_MIN };
    int k;

    (void)state;
    make(&rig, 2, 1, 1);
    memcpy(&before, &rig, sizeof rig);
    for (k = 0; k < 5; k++) {
        assert_int_equal(jl_mode_init(&rig.mode, bad[k], 1, 1, rig.mem, CAP),
                         JL_EDIM);
        assert_int_equal(jl_mode_init(&rig.mode, 1, bad[k], 1, rig.mem, CAP),
                         JL_EDIM);
        assert_int_equal(jl_mode_init(&rig.mode, 1, 1, bad[k], rig.mem, CAP),
                         JL_EDIM);
    }
    assert_int_equal(jl_mode_init(&rig.mode, 3, 2, 4, rig.mem,
                                  JL_MODE_MEM(3, 2, 4) - 1), JL_ENOMEM);
    assert_int_equal(jl_mode_init(&rig.mode, MAX, MAX, MAX, rig.mem,
                                  JL_MODE_MEM(MAX, MAX, MAX) - 1), JL_ENOMEM);
    assert_int_equal(jl_mode_init(&rig.mode, 1, 1, 1, rig.mem, 0), JL_ENOMEM);
    assert_int_equal(jl_mode_init(&rig.mode, 1, 1, 1, rig.mem, -1), JL_ENOMEM);
    assert_same_bits(&rig, &before, sizeof rig);
}

/* Numbers an array from *next. */
static void number(jl_real *a, int count, int *next)
{
    int i;

    for (i = 0; i < count; i++) {
        assert_true(a[i] == 0);
        a[i] = (jl_real)(*next)++;
    }
}

static void check_layout(int n, int m, int p)
{
    jl_mode *a = &rig.mode;
    int next = 1, i, seen = 0;

    make(&rig, n, m, p);
    assert_true(a->n == n && a->m == m && a->p == p);
    number(a->F, n * n, &next);
    number(a->W, n * n, &next);
    number(a->u, n, &next);
    number(a->H, m * n, &next);
    number(a->R, m * m, &next);
    number(a->V, m * m, &next);
    number(a->N, n * p, &next);
    number(a->q, p, &next);
    assert_true(a->F[0] == 1 && a->q[p - 1] == (jl_real)(next - 1));
    for (i = 0; i < JL_MODE_MEM(n, m, p); i++)
        seen += rig.mem[EDGE + i] > 0;
    assert_int_equal(seen, next - 1);   /* none overlaps another */
    check_edges(&rig);
}

static void test_mode_init_lays_out(void **state)
{
    (void)state;
    check_layout(1, 1, 1);
    check_layout(4, 2, 3);
    check_layout(MAX, 1, 1);
    check_layout(1, MAX, 1);
    check_layout(1, 1, MAX);
    check_layout(MAX, MAX, MAX);
}

/* --- set ---------------------------------------------------------------- */

static struct {
    jl_real F[MAX * MAX], G[MAX * MAX], Q[MAX * MAX], w_bar[MAX];
    jl_real H[MAX * MAX], R[MAX * MAX];
} in;

static void make_cov(jl_real *A, int n, jl_real c)
{
    jl_real v[MAX];
    int i, j;

    for (i = 0; i < n; i++)
        v[i] = rnd();
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            A[i * n + j] = v[i] * v[j] + (i == j ? c : 0);
}

static void make_input(int m, int p)
{
    int i;

    for (i = 0; i < MAX * MAX; i++) {
        in.F[i] = rnd();
        in.G[i] = rnd();
        in.H[i] = rnd();
        in.w_bar[i % MAX] = rnd();
    }
    make_cov(in.Q, p, 0);               /* semidefinite is enough */
    make_cov(in.R, m, 1);
}

/* Sets rig from `in`; on error nothing may have changed. */
static int set(int with_mean)
{
    jl_mode *a = &rig.mode;
    int i, status, need = JL_MODE_SCRATCH(a->n, a->m, a->p);

    for (i = 0; i < need + EDGE; i++)
        scratch[i] = NAN_;
    memcpy(&before, &rig, sizeof rig);
    status = jl_mode_set(a, in.F, in.G, in.Q, with_mean ? in.w_bar : NULL,
                         in.H, in.R, scratch);
    for (i = 0; i < EDGE; i++)
        assert_true(isnan(scratch[need + i]));
    if (status != JL_OK)
        assert_same_bits(&rig, &before, sizeof rig);
    check_edges(&rig);
    return status;
}

static void check_set(int n, int m, int p)
{
    jl_mode *a = &rig.mode;
    double tolerance = 8.0 * (p + 1) * (p + 1) * EPS;
    long double want;
    int i, j, k, l;

    make(&rig, n, m, p);
    make_input(m, p);
    assert_int_equal(set(1), JL_OK);
    assert_same_bits(a->F, in.F, (size_t)(n * n) * sizeof *in.F);
    assert_same_bits(a->H, in.H, (size_t)(m * n) * sizeof *in.H);
    assert_same_bits(a->R, in.R, (size_t)(m * m) * sizeof *in.R);
    for (i = 0; i < n; i++) {
        for (want = 0, k = 0; k < p; k++)
            want += (long double)in.G[i * p + k] * in.w_bar[k];
        assert_close(a->u[i], want, tolerance);
        for (j = 0; j < n; j++) {
            for (want = 0, k = 0; k < p; k++)
                for (l = 0; l < p; l++)
                    want += (long double)in.G[i * p + k] * in.Q[k * p + l]
                        * in.G[j * p + l];
            assert_close(a->W[i * n + j], want, tolerance);
            assert_same_bits(&a->W[i * n + j], &a->W[j * n + i],
                             sizeof *a->W);
            for (k = 0; k < p; k++)     /* the same of the factors */
                want -= (long double)a->q[k] * a->N[k * n + i]
                    * a->N[k * n + j];
            assert_close(want, 0, 4 * tolerance);
        }
    }
    for (i = 0; i < m; i++)
        for (j = 0; j < m; j++) {
            want = in.R[i * m + j];
            for (k = 0; k <= i && k <= j; k++)
                want -= (long double)a->V[k * m + k]
                    * (k == i ? 1 : a->V[k * m + i])
                    * (k == j ? 1 : a->V[k * m + j]);
            assert_close(want, 0, 32.0 * m * EPS);
        }
    assert_int_equal(set(0), JL_OK);    /* no mean again */
    for (i = 0; i < n; i++)
        assert_true(a->u[i] == 0);
}

static void test_mode_set_products(void **state)
{
    (void)state;
    check_set(1, 1, 1);
    check_set(4, 2, 3);
    check_set(3, 5, 7);
    check_set(MAX, 1, 1);
    check_set(1, MAX, 5);
    check_set(2, 2, MAX);
}

static void check_poison(jl_real *a, int count, jl_real value, int expected)
{
    jl_real keep;
    int i;

    for (i = 0; i < count; i++) {
        keep = a[i];
        a[i] = value;
        assert_int_equal(set(1), expected);
        a[i] = keep;
    }
}

static void test_mode_set_refuses_nonfinite(void **state)
{
    const jl_real bad[] = { NAN_, INF_, -INF_, JL_LARGE * 2 };
    int k;

    (void)state;
    make(&rig, 3, 2, 2);
    make_input(2, 2);
    assert_int_equal(set(1), JL_OK);
    for (k = 0; k < 4; k++) {
        check_poison(in.F, 9, bad[k], JL_ENONFINITE);
        check_poison(in.G, 6, bad[k], JL_ENONFINITE);
        check_poison(in.H, 6, bad[k], JL_ENONFINITE);
        check_poison(in.w_bar, 2, bad[k], JL_ENONFINITE);
        if (k < 3) {
            check_poison(in.Q, 4, bad[k], JL_ENONFINITE);
            check_poison(in.R, 4, bad[k], JL_ENONFINITE);
        }
    }
    in.Q[0] = JL_LARGE * JL_LARGE;      /* each allowed, but not G Q G' */
    in.Q[1] = in.Q[2] = 0;
    in.G[0] = JL_LARGE;
    assert_int_equal(set(0), JL_ENONFINITE);
    in.Q[0] = 0;                        /* nor G w_bar */
    in.w_bar[0] = JL_LARGE;
    assert_int_equal(set(0), JL_OK);
    assert_int_equal(set(1), JL_ENONFINITE);
}

static void test_mode_set_refuses_covariances(void **state)
{
    (void)state;
    make(&rig, 3, 2, 2);
    make_input(2, 2);
    in.Q[1] += JL_C(0.01);
    assert_int_equal(set(0), JL_EASYM);
    make_input(2, 2);
    in.R[2] += JL_C(0.01);
    assert_int_equal(set(0), JL_EASYM);
    make_input(2, 2);
    in.Q[1] = in.Q[2] = 3;
    assert_int_equal(set(0), JL_EDEF);
    make_input(2, 2);
    in.R[1] = in.R[2] = 3;
    assert_int_equal(set(0), JL_EDEF);
    in.R[0] = in.R[1] = in.R[2] = in.R[3] = 1;  /* semidefinite only */
    assert_int_equal(set(0), JL_EDEF);
    in.R[0] = in.R[1] = in.R[2] = in.R[3] = 0;
    assert_int_equal(set(0), JL_EDEF);
    make_input(2, 2);
    memset(in.Q, 0, sizeof in.Q);               /* no noise is allowed */
    assert_int_equal(set(0), JL_OK);
}

/* The factor of R has full rank, for R has, however
 * alike two errors are. */
static void test_mode_set_keeps_small_pivots(void **state)
{
    const jl_real *V;

    (void)state;
    make(&rig, 3, 2, 2);
    make_input(2, 2);
    V = rig.mode.V;
    in.R[0] = in.R[3] = 1;
    in.R[1] = in.R[2] = 1 - 8 * JL_EPSILON;
    assert_int_equal(set(0), JL_OK);
    assert_close(V[0], 1, 0);
    assert_close(V[1], 1 - 8 * EPS, 0);
    assert_close(V[3], 16 * EPS, EPS);
    in.R[1] = in.R[2] = 0;
    in.R[3] = JL_REAL_MIN;
    assert_int_equal(set(0), JL_OK);
    assert_close(V[3], JL_REAL_MIN, 0);
    in.R[3] = JL_REAL_MIN / 2;                  /* no row of a factor */
    assert_int_equal(set(0), JL_EDEF);
}

/* --- motions ------------------------------------------------------------ */

static jl_motion motion_of(int kind, int axes, int order, jl_real rate)
{
    jl_motion motion;

    memset(&motion, 0, sizeof motion);
    motion.kind = kind;
    motion.axes = axes;
    motion.order = order;
    motion.accel_std = JL_C(1.3);
    motion.turn_rate = rate;
    motion.sigma_z = JL_C(0.7);
    return motion;
}

/* The largest number of a motion. */
static jl_real sqrt_of_large(void)
{
    return (jl_real)sqrt((double)JL_LARGE);
}

static void fill_motion(struct rig *r, const jl_motion *motion, jl_real dt)
{
    make(r, motion->axes * motion->order, motion->axes, motion->axes);
    assert_int_equal(jl_mode_motion(&r->mode, motion, dt), JL_OK);
    check_edges(r);
}

/* Everything but F of CT against the header's closed forms, and against
 * jl_mode_set of the same matrices. */
static void check_motion(int kind, int axes, int order, jl_real dt)
{
    static jl_real G[MAX * MAX], Q[MAX * MAX];
    jl_motion motion = motion_of(kind, axes, order, JL_C(0.3));
    const jl_mode *a = &rig.mode;
    int n = axes * order, i, j, row, col;
    long double T = dt;
    long double F[3][3] = { { 1, T, T * T / 2 }, { 0, 1, T }, { 0, 0, 1 } };
    long double g[3] = { T * T / 2, T, 1 };
    double tolerance = (double)(4 * (1 + T * T) * (1 + T * T)) * EPS;

    fill_motion(&rig, &motion, dt);
    if (kind != JL_MOTION_CA) {
        F[0][2] = F[1][2] = F[2][2] = 0;
        g[2] = 0;
    }
    for (i = 0; i < n; i++) {
        assert_true(a->u[i] == 0);
        row = i % order;
        for (j = 0; j < n; j++) {
            int same = i / order == j / order;

            col = j % order;
            if (kind != JL_MOTION_CT)
                assert_close(a->F[i * n + j], same ? F[row][col] : 0,
                             tolerance);
            assert_close(a->W[i * n + j],
                         same ? g[row] * g[col] * 1.69L : 0, tolerance);
        }
        for (j = 0; j < axes; j++) {
            assert_close(a->N[j * n + i], i / order == j ? g[row] : 0,
                         tolerance);
            assert_true(a->H[j * n + i] == (jl_real)(i == j * order));
        }
    }
    for (i = 0; i < axes; i++)
        for (j = 0; j < axes; j++) {
            Q[i * axes + j] = i == j ? a->q[i] : 0;
            assert_close(Q[i * axes + j], i == j ? 1.69 : 0, 4 * EPS);
            assert_close(a->R[i * axes + j], i == j ? 0.49 : 0, EPS);
            assert_close(a->V[i * axes + j], i == j ? 0.49 : 0, EPS);
        }
    for (i = 0; i < n; i++)
        for (j = 0; j < axes; j++)
            G[i * axes + j] = a->N[j * n + i];
    make(&other, n, axes, axes);
    assert_int_equal(jl_mode_set(&other.mode, a->F, G, Q, NULL, a->H, a->R,
                                 scratch), JL_OK);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            assert_close(a->W[i * n + j], other.mode.W[i * n + j],
                         tolerance);
            assert_same_bits(&a->W[i * n + j], &a->W[j * n + i],
                             sizeof *a->W);
        }
    jl_mode_motion(&other.mode, &motion, dt);
    check_same(&other.mode, a);
}

static void test_motion_closed_forms(void **state)
{
    static const jl_real dts[] = { 0, JL_C(0.001), JL_C(0.1), 1, JL_C(2.7),
                                   60 };
    int k, axes;

    (void)state;
    for (k = 0; k < 6; k++) {
        for (axes = 1; axes <= 5; axes++) {
            check_motion(JL_MOTION_CV, axes, 2, dts[k]);
            check_motion(JL_MOTION_CV, axes, 3, dts[k]);
            check_motion(JL_MOTION_CA, axes, 3, dts[k]);
        }
        check_motion(JL_MOTION_CT, 2, 2, dts[k]);
        check_motion(JL_MOTION_CT, 2, 3, dts[k]);
    }
    check_motion(JL_MOTION_CV, MAX / 2, 2, 1);
    check_motion(JL_MOTION_CA, MAX / 3, 3, 1);
}

/* Filled again, nothing of the former motion or mean is left. */
static void test_motion_forgets_the_former(void **state)
{
    jl_motion ca = motion_of(JL_MOTION_CA, 2, 3, 0);
    jl_motion ct = motion_of(JL_MOTION_CT, 2, 3, JL_C(0.2));
    jl_motion cv = motion_of(JL_MOTION_CV, 2, 3, 0);

    (void)state;
    make(&rig, 6, 2, 2);
    make_input(2, 2);
    assert_int_equal(set(1), JL_OK);
    fill_motion(&other, &ct, 2);
    assert_int_equal(jl_mode_motion(&rig.mode, &ct, 2), JL_OK);
    check_same(&rig.mode, &other.mode);
    fill_motion(&other, &ca, 1);
    assert_int_equal(jl_mode_motion(&rig.mode, &ca, 1), JL_OK);
    check_same(&rig.mode, &other.mode);
    fill_motion(&other, &cv, 1);
    assert_int_equal(jl_mode_motion(&rig.mode, &cv, 1), JL_OK);
    check_same(&rig.mode, &other.mode);
}

/* F of CT against the arc in long double; the rate from far below eps up. */
static void check_turn(int order, jl_real rate, jl_real dt)
{
    jl_motion ct = motion_of(JL_MOTION_CT, 2, order, rate);
    const jl_real *F = rig.mode.F;
    int n = 2 * order, y = order, i, j;
    long double a = (long double)rate * dt, want[4];
    double turned = ((double)fabsl(a) + 4) * EPS;
    double moved = ((double)fabsl(a) + 6) * EPS * (double)dt;

    want[0] = a == 0 ? dt : sinl(a) / rate;
    want[1] = a == 0 ? 0 : 2 * sinl(a / 2) * sinl(a / 2) / rate;
    want[2] = cosl(a);
    want[3] = sinl(a);
    fill_motion(&rig, &ct, dt);
    assert_close(F[1], want[0], moved);
    assert_close(F[y + 1], -want[1], moved);
    assert_close(F[y * n + 1], want[1], moved);
    assert_close(F[y * n + y + 1], want[0], moved);
    assert_close(F[n + 1], want[2], turned);
    assert_close(F[n + y + 1], -want[3], turned);
    assert_close(F[(y + 1) * n + 1], want[3], turned);
    assert_close(F[(y + 1) * n + y + 1], want[2], turned);
    if (fabsl(a) < 1)                   /* every digit of the small ones, too */
        assert_close(F[y * n + 1], want[1],
                     8 * EPS * fabs((double)want[1]) + (double)JL_REAL_MIN);
    for (i = 0; i < n; i++)             /* position in, and acceleration */
        for (j = 0; j < n; j++)
            if (j % order != 1)
                assert_true(F[i * n + j] == (jl_real)(i == j && j % y == 0));
            else if (i % order == 2)
                assert_true(F[i * n + j] == 0);
}

/* As model.h says: the motion in a mode with another sensor. */
static void test_motion_with_another_sensor(void **state)
{
    static const struct { int kind, order; jl_real rate; } motions[] = {
        { JL_MOTION_CV, 2, 0 }, { JL_MOTION_CV, 3, 0 }, { JL_MOTION_CA, 3, 0 },
        { JL_MOTION_CT, 2, JL_C(0.1) }, { JL_MOTION_SINGER, 3, 0 }
    };
    static const jl_real H[3 * 6] = { 1, 2, 3, 4, 5 };
    static const jl_real R[9] = { 4, 1, 0, 1, 9, 0, 0, 0, 1 };
    jl_real I[6 * 6], dt;
    size_t i;
    int a;

    (void)state;
    for (i = 0; i < sizeof motions / sizeof *motions; i++)
        for (dt = JL_C(0.001); dt < 2000; dt *= 7) {
            jl_motion motion = motion_of(motions[i].kind, 2, motions[i].order,
                                         motions[i].rate);
            int n = 2 * motion.order;

            motion.tau_s = 20;
            make(&rig, n, 2, jl_motion_noises(&motion));
            assert_int_equal(jl_mode_motion(&rig.mode, &motion, dt), JL_OK);
            make(&other, n, 3, n);
            memset(I, 0, sizeof I);
            for (a = 0; a < n; a++)
                I[a * (n + 1)] = 1;
            assert_int_equal(jl_mode_set(&other.mode, rig.mode.F, I,
                                         rig.mode.W, NULL, H, R, scratch),
                             JL_OK);
            assert_memory_equal(other.mode.F, rig.mode.F,
                                (size_t)(n * n) * sizeof *I);
            for (a = 0; a < n * n; a++)
                assert_true(!(other.mode.W[a] < rig.mode.W[a]
                              || other.mode.W[a] > rig.mode.W[a]));
        }
}

static void test_motion_turn_is_an_arc(void **state)
{
    jl_real rate;
    int order, sign;

    (void)state;
    for (order = 2; order <= 3; order++)
        for (sign = -1; sign <= 1; sign += 2) {
            for (rate = JL_C(1.0e-37); rate < 4; rate *= JL_C(1.7))
                check_turn(order, (jl_real)sign * rate, JL_C(0.75));
            check_turn(order, (jl_real)sign * 1024, 1);
            check_turn(order, (jl_real)sign * 64, 16);
            check_turn(order, (jl_real)sign * JL_C(0.1), 0);
            check_turn(order, (jl_real)sign * 0, 10);
        }
}

/* A gap in which it turned further than jl_sincos takes. */
static void test_motion_turns_over_long_gaps(void **state)
{
    static const jl_real rates[] = {
        JL_C(1.0701), JL_C(1.3), 3, JL_C(31.4159), 1000
    };
    static const jl_real gaps[] = { 957, 1000, 86400 };
    int r, g;

    (void)state;
    for (g = 0; g < 3; g++)
        for (r = 0; r < 5; r++) {
            check_turn(2, rates[r], gaps[g]);
            check_turn(3, -rates[r], gaps[g]);
        }
    check_turn(2, 2048, 1);
    check_turn(2, JL_C(1024.001), 1);
}

/* Of a gap so long that no digit of the angle is left: a turn is a turn. */
static void test_motion_turn_keeps_the_speed(void **state)
{
    const jl_real most = sqrt_of_large();
    jl_motion ct = motion_of(JL_MOTION_CT, 2, 2, most);
    const jl_real *F = rig.mode.F;
    jl_real dt;

    (void)state;
    ct.accel_std = 0;
    for (dt = 1; dt < most; dt *= 37) {
        fill_motion(&rig, &ct, dt);
        assert_close(F[5] * F[5] + F[7] * F[7], 1, 4 * EPS);
        assert_true(F[5] == F[15] && F[7] == -F[13]);
        assert_true(fabs((double)(F[1] * most)) <= 1 + 4 * EPS);
        assert_true(fabs((double)(F[3] * most)) <= 2 + 8 * EPS);
    }
}

static void test_motion_turn_zero_is_straight(void **state)
{
    jl_motion ct = motion_of(JL_MOTION_CT, 2, 2, 0);
    jl_motion cv = motion_of(JL_MOTION_CV, 2, 2, 0);
    int i;

    (void)state;
    fill_motion(&rig, &ct, JL_C(1.3));
    fill_motion(&other, &cv, JL_C(1.3));
    for (i = 0; i < 16; i++) {
        assert_true(rig.mode.F[i] == other.mode.F[i]);
        assert_true(rig.mode.W[i] == other.mode.W[i]);
    }
}

/* F(a) F(b) = F(a + b), of the motions without a noise in between. */
static void test_motion_composes(void **state)
{
    static const int kinds[] = { JL_MOTION_CV, JL_MOTION_CA, JL_MOTION_CT,
                                 JL_MOTION_CT };
    static const int orders[] = { 2, 3, 2, 3 };
    jl_real A[36], AB[36];
    int k, run, i, n;

    (void)state;
    for (k = 0; k < 4; k++)
        for (run = 0; run < 50; run++) {
            jl_motion motion = motion_of(kinds[k], 2, orders[k], 2 * rnd());
            jl_real a = 1 + rnd(), b = 1 + rnd();

            n = 2 * orders[k];
            fill_motion(&rig, &motion, a);
            memcpy(A, rig.mode.F, (size_t)(n * n) * sizeof *A);
            fill_motion(&rig, &motion, b);
            jl_mat_mul(AB, A, rig.mode.F, n, n, n);
            fill_motion(&rig, &motion, a + b);
            for (i = 0; i < n * n; i++)
                assert_close(AB[i], rig.mode.F[i], 64 * EPS);
        }
}

static int motion_status(const jl_motion *motion, jl_real dt)
{
    int status;

    memcpy(&before, &rig, sizeof rig);
    status = jl_mode_motion(&rig.mode, motion, dt);
    if (status != JL_OK)
        assert_same_bits(&rig, &before, sizeof rig);
    return status;
}

static int bent_status(int kind, int axes, int order)
{
    jl_motion motion = motion_of(kind, axes, order, 0);

    return motion_status(&motion, 1);
}

static void test_motion_refuses_sizes(void **state)
{
    int n;

    (void)state;
    make(&rig, 4, 2, 2);
    assert_int_equal(bent_status(JL_MOTION_CV, 2, 2), JL_OK);
    assert_int_equal(bent_status(0, 2, 2), JL_EDIM);
    assert_int_equal(bent_status(5, 2, 2), JL_EDIM);
    assert_int_equal(bent_status(-1, 2, 2), JL_EDIM);
    assert_int_equal(bent_status(JL_MOTION_CV, 4, 1), JL_EDIM);
    assert_int_equal(bent_status(JL_MOTION_CV, 1, 4), JL_EDIM);
    assert_int_equal(bent_status(JL_MOTION_CV, 2, 3), JL_EDIM);
    assert_int_equal(bent_status(JL_MOTION_CV, 1, 2), JL_EDIM);
    assert_int_equal(bent_status(JL_MOTION_CV, 0, 2), JL_EDIM);
    assert_int_equal(bent_status(JL_MOTION_CV, -2, -2), JL_EDIM);
    assert_int_equal(bent_status(JL_MOTION_CV, INT_MAX, 2), JL_EDIM);
    assert_int_equal(bent_status(JL_MOTION_CV, INT_MIN, 2), JL_EDIM);
    assert_int_equal(bent_status(JL_MOTION_CV, 2, INT_MAX), JL_EDIM);
    assert_int_equal(bent_status(JL_MOTION_CA, 2, 2), JL_EDIM);
    for (n = 1; n <= 3; n += 2) {       /* turns are of two axes */
        make(&rig, 2 * n, n, n);
        assert_int_equal(bent_status(JL_MOTION_CT, n, 2), JL_EDIM);
    }
    make(&rig, 4, 1, 2);
    assert_int_equal(bent_status(JL_MOTION_CV, 2, 2), JL_EDIM);
    make(&rig, 4, 2, 1);
    assert_int_equal(bent_status(JL_MOTION_CV, 2, 2), JL_EDIM);
}

/* One number of a CT motion replaced: 0 accel, 1 rate, 2 sigma, 3 dt. */
static int number_status(int which, jl_real value)
{
    jl_motion motion = motion_of(JL_MOTION_CT, 2, 2, JL_C(0.1));
    jl_real dt = 1;

    *(which == 0 ? &motion.accel_std : which == 1 ? &motion.turn_rate
      : which == 2 ? &motion.sigma_z : &dt) = value;
    return motion_status(&motion, dt);
}

static void test_motion_refuses_numbers(void **state)
{
    jl_motion cv = motion_of(JL_MOTION_CV, 2, 2, 0);
    int which;

    (void)state;
    make(&rig, 4, 2, 2);
    for (which = 0; which < 4; which++) {
        assert_int_equal(number_status(which, NAN_), JL_ENONFINITE);
        assert_int_equal(number_status(which, INF_), JL_ENONFINITE);
        assert_int_equal(number_status(which, -INF_), JL_ENONFINITE);
    }
    /* whose squares are beyond what a covariance may be */
    assert_int_equal(number_status(0, JL_LARGE * 2), JL_ENONFINITE);
    assert_int_equal(number_status(2, JL_LARGE * 2), JL_ENONFINITE);
    assert_int_equal(motion_status(&cv, JL_LARGE), JL_ENONFINITE);
    assert_int_equal(number_status(0, -JL_REAL_MIN), JL_ERANGE);
    assert_int_equal(number_status(0, 0), JL_OK);
    assert_int_equal(number_status(2, 0), JL_ERANGE);
    assert_int_equal(number_status(2, -1), JL_ERANGE);
    assert_int_equal(number_status(2, JL_REAL_MIN), JL_ERANGE); /* R = 0 */
    assert_int_equal(number_status(3, -JL_REAL_MIN), JL_ETIME);
    assert_int_equal(number_status(3, -1), JL_ETIME);
}

/* --- what products may leave out ----------------------------------------- */

static void check_structure(const jl_mode *mode, int block, int every)
{
    assert_int_equal(mode->block, block);
    assert_int_equal(mode->every, every);
}

static void check_motion_structure(int kind, int axes, int order,
                                   jl_real rate, jl_real dt, int block)
{
    jl_motion motion = motion_of(kind, axes, order, rate);

    motion.tau_s = 20;
    make(&rig, axes * order, axes, jl_motion_noises(&motion));
    assert_int_equal(jl_mode_motion(&rig.mode, &motion, dt), JL_OK);
    check_structure(&rig.mode, block, order);
}

static void test_motion_structure(void **state)
{
    int axes;

    (void)state;
    for (axes = 1; axes <= 3; axes++) {
        check_motion_structure(JL_MOTION_CV, axes, 2, 0, 1, 2);
        check_motion_structure(JL_MOTION_CV, axes, 3, 0, 1, 3);
        check_motion_structure(JL_MOTION_CA, axes, 3, 0, 1, 3);
        check_motion_structure(JL_MOTION_SINGER, axes, 3, 0, 1, 3);
        check_motion_structure(JL_MOTION_CV, axes, 2, 0, 0, 1);     /* F = I */
        check_motion_structure(JL_MOTION_CA, axes, 3, 0, 0, 1);
    }
    check_motion_structure(JL_MOTION_CT, 2, 2, JL_C(0.3), 1, 4);
    check_motion_structure(JL_MOTION_CT, 2, 3, JL_C(0.3), 1, 6);
    check_motion_structure(JL_MOTION_CT, 2, 2, 0, 1, 2);
    check_motion_structure(JL_MOTION_CT, 2, 3, 0, 1, 3);
}

/* An F [n,n] that couples states i and k, one of the other, beside each with
 * itself. */
static void check_block(int n, int i, int k, int block)
{
    int a;

    make(&rig, n, 1, 1);
    make_input(1, 1);
    for (a = 0; a < n * n; a++)
        in.F[a] = a % (n + 1) == 0 ? 1 : a % 2 ? 0 : -JL_C(0.0);
    in.F[i * n + k] = JL_REAL_MIN;
    assert_int_equal(set(0), JL_OK);
    assert_int_equal(rig.mode.block, block);
}

static void test_mode_set_finds_blocks(void **state)
{
    int i, k;

    (void)state;
    check_block(1, 0, 0, 1);
    check_block(5, 3, 3, 1);
    check_block(5, 0, 1, 5);            /* 2 does not divide 5 */
    check_block(6, 0, 1, 2);
    check_block(6, 5, 4, 2);
    check_block(6, 1, 2, 3);
    check_block(6, 3, 5, 3);
    check_block(6, 3, 2, 2);
    check_block(6, 1, 3, 6);
    check_block(6, 5, 0, 6);
    check_block(8, 3, 0, 4);
    check_block(8, 3, 4, 8);
    check_block(MAX, MAX - 1, MAX - 2, 2);
    make(&rig, 6, 2, 2);
    make_input(2, 2);                   /* dense */
    assert_int_equal(set(0), JL_OK);
    check_structure(&rig.mode, 6, 0);
    for (i = 0; i < 6; i++)             /* blocks of 4 and 2 */
        for (k = 0; k < 6; k++)
            if (i / 4 != k / 4)
                in.F[i * 6 + k] = 0;
    assert_int_equal(set(0), JL_OK);
    assert_int_equal(rig.mode.block, 6);
    memset(in.F, 0, sizeof in.F);
    assert_int_equal(set(0), JL_OK);
    assert_int_equal(rig.mode.block, 1);
}

/* H [m,n] has only ones, in row a at state at[a]; -1: nowhere. */
static void make_picks(int n, int m, const int *at)
{
    int a;

    make(&rig, n, m, 1);
    make_input(m, 1);
    memset(in.H, 0, sizeof in.H);
    for (a = 0; a < m; a++)
        if (at[a] >= 0)
            in.H[a * n + at[a]] = 1;
}

static void check_picks(int n, int m, int a, int b, int c, int every)
{
    int at[3];

    at[0] = a;
    at[1] = b;
    at[2] = c;
    make_picks(n, m, at);
    assert_int_equal(set(0), JL_OK);
    assert_int_equal(rig.mode.every, every);
}

static void test_mode_set_finds_what_is_picked(void **state)
{
    static const int at[3] = { 0, 2, 4 };
    const jl_real not_one[] = { JL_C(0.5), -1, 1 + JL_EPSILON, 2 };
    int i;

    (void)state;
    check_picks(4, 2, 0, 2, 0, 2);      /* x vx y vy */
    check_picks(4, 2, 0, 1, 0, 1);      /* x y vx vy */
    check_picks(4, 2, 0, 3, 0, 3);
    check_picks(9, 3, 0, 3, 6, 3);
    check_picks(6, 3, 0, 1, 2, 1);
    check_picks(3, 3, 0, 1, 2, 1);      /* all */
    check_picks(1, 1, 0, 0, 0, 1);
    check_picks(4, 1, 0, 0, 0, 4);      /* one: no other is ever picked */
    check_picks(4, 1, 3, 0, 0, 0);
    check_picks(4, 1, -1, 0, 0, 0);     /* a row of zeros */
    check_picks(4, 2, -1, 2, 0, 0);
    check_picks(4, 2, 0, -1, 0, 0);
    check_picks(4, 2, -1, -1, 0, 0);
    check_picks(4, 2, 2, 0, 0, 0);      /* y before x */
    check_picks(4, 2, 1, 3, 0, 0);      /* velocities */
    check_picks(4, 2, 0, 0, 0, 0);      /* x twice */
    check_picks(1, 2, 0, 0, 0, 0);
    check_picks(4, 3, 0, 2, -1, 0);     /* a third would be at no state */
    check_picks(4, 3, 0, 2, 3, 0);
    check_picks(9, 3, 0, 3, 5, 0);
    check_picks(9, 3, 0, 3, 3, 0);
    for (i = 0; i < 3 * 6; i++) {
        int k;

        make_picks(6, 3, at);
        for (k = 0; k < 4; k++) {       /* another number, one more */
            in.H[i] = not_one[k];
            assert_int_equal(set(0), JL_OK);
            assert_int_equal(rig.mode.every, 0);
        }
    }
}

/* Structure is of the present matrices, and of what was refused there is none:
 * a NaN is no zero. */
static void test_mode_structure_is_of_what_is_there(void **state)
{
    static const int at[2] = { 0, 2 };
    const jl_motion motion = motion_of(JL_MOTION_CV, 2, 2, 0);
    int i;

    (void)state;
    make(&rig, 4, 2, 2);
    check_structure(&rig.mode, 4, 0);   /* of anything that may be put there */
    assert_int_equal(jl_mode_motion(&rig.mode, &motion, 1), JL_OK);
    check_structure(&rig.mode, 2, 2);
    make_input(2, 2);
    assert_int_equal(set(0), JL_OK);
    check_structure(&rig.mode, 4, 0);
    make(&rig, 4, 2, 2);
    check_structure(&rig.mode, 4, 0);
    make_picks(4, 2, at);
    for (i = 0; i < 16; i++)
        if (i / 8 != i % 4 / 2)
            in.F[i] = 0;
    assert_int_equal(set(0), JL_OK);
    check_structure(&rig.mode, 2, 2);
    check_poison(in.F, 16, NAN_, JL_ENONFINITE);
    check_poison(in.H, 8, NAN_, JL_ENONFINITE);
    check_structure(&rig.mode, 2, 2);
    assert_int_equal(jl_mode_init(&rig.mode, 4, 2, 2, rig.mem + EDGE,
                                  JL_MODE_MEM(4, 2, 2)), JL_OK);
    check_structure(&rig.mode, 4, 0);
}

/* --- start -------------------------------------------------------------- */

static int start_status(const jl_motion *motion, const jl_real *z, jl_real v,
                        jl_real a)
{
    jl_real x[36], P[36 * 36], x0[36], P0[36 * 36];
    int i, status;

    for (i = 0; i < 36 * 36; i++)
        P[i] = x[i % 36] = rnd();
    memcpy(x0, x, sizeof x);
    memcpy(P0, P, sizeof P);
    status = jl_motion_start(x, P, motion, z, v, a);
    if (status != JL_OK) {
        assert_same_bits(x, x0, sizeof x);
        assert_same_bits(P, P0, sizeof P);
    }
    return status;
}

static void test_start_state(void **state)
{
    static const jl_real z[3] = { 5, -6, 7 };
    static const double variance[3] = { 0.49, 100, 9 };
    jl_real x[10], P[82];
    int order, axes, n, i, j;

    (void)state;
    for (order = 2; order <= 3; order++)
        for (axes = 1; axes <= 3; axes++) {
            jl_motion motion = motion_of(JL_MOTION_CV, axes, order, 0);

            n = axes * order;
            x[n] = P[n * n] = NAN_;
            assert_int_equal(jl_motion_start(x, P, &motion, z, 10, 3), JL_OK);
            assert_true(isnan(x[n]) && isnan(P[n * n]));
            for (i = 0; i < n; i++) {
                assert_true(x[i] == (i % order == 0 ? z[i / order] : 0));
                for (j = 0; j < n; j++)
                    assert_close(P[i * n + j],
                                 i == j ? variance[i % order] : 0, EPS);
            }
        }
}

static void test_start_refuses(void **state)
{
    jl_motion motion = motion_of(JL_MOTION_CA, 2, 3, 0);
    jl_real z[2] = { 1, 2 };
    const jl_real bad[] = { NAN_, INF_, -INF_, JL_LARGE * 2 };
    int k;

    (void)state;
    for (k = 0; k < 4; k++) {
        z[1] = bad[k];
        assert_int_equal(start_status(&motion, z, 1, 1), JL_ENONFINITE);
        z[1] = 2;
        assert_int_equal(start_status(&motion, z, bad[k], 1), JL_ENONFINITE);
        assert_int_equal(start_status(&motion, z, 1, bad[k]), JL_ENONFINITE);
        motion.sigma_z = bad[k];
        assert_int_equal(start_status(&motion, z, 1, 1), JL_ENONFINITE);
        motion.sigma_z = 1;
    }
    for (k = -1; k <= 0; k++) {
        assert_int_equal(start_status(&motion, z, (jl_real)k, 1), JL_ERANGE);
        assert_int_equal(start_status(&motion, z, 1, (jl_real)k), JL_ERANGE);
        motion.sigma_z = (jl_real)k;
        assert_int_equal(start_status(&motion, z, 1, 1), JL_ERANGE);
        motion.sigma_z = 1;
    }
    assert_int_equal(start_status(&motion, z, 1, 1), JL_OK);
    motion.order = 2;
    assert_int_equal(start_status(&motion, z, 1, 1), JL_EDIM);
    motion = motion_of(JL_MOTION_CV, 0, 2, 0);
    assert_int_equal(start_status(&motion, z, 1, 1), JL_EDIM);
    motion = motion_of(JL_MOTION_CV, MAX / 2 + 1, 2, 0);
    assert_int_equal(start_status(&motion, z, 1, 1), JL_EDIM);
    motion = motion_of(JL_MOTION_CV, INT_MAX, 2, 0);
    assert_int_equal(start_status(&motion, z, 1, 1), JL_EDIM);
    motion = motion_of(JL_MOTION_CV, INT_MAX / 3 * 2 + 2, 3, 0);
    assert_int_equal(start_status(&motion, z, 1, 1), JL_EDIM);
    motion = motion_of(JL_MOTION_CT, 1, 2, 0);
    assert_int_equal(start_status(&motion, z, 1, 1), JL_EDIM);
    motion = motion_of(9, 2, 2, 0);
    assert_int_equal(start_status(&motion, z, 1, 1), JL_EDIM);
}

/* --- the chain ---------------------------------------------------------- */

static jl_real Pi[JL_MAX_MODES * JL_MAX_MODES + 1];
static jl_real sojourn[JL_MAX_MODES];

static void check_sojourn(int M, jl_real dt)
{
    long double sum, leave;
    int i, j;

    for (i = 0; i < M; i++)
        sojourn[i] = 20 + 19 * rnd();
    Pi[M * M] = NAN_;
    assert_int_equal(jl_chain_sojourn(Pi, sojourn, M, dt), JL_OK);
    assert_true(isnan(Pi[M * M]));
    for (i = 0; i < M; i++) {
        leave = M == 1 ? 0 : -expm1l(-(long double)dt / sojourn[i]);
        for (sum = 0, j = 0; j < M; j++) {
            assert_true(Pi[i * M + j] >= 0);
            assert_close(Pi[i * M + j], i == j ? 1 - leave : leave / (M - 1),
                         (4 + (double)(dt / sojourn[i])) * EPS);
            if (i != j)                 /* to its own last digits too */
                assert_close(Pi[i * M + j] / leave * (M - 1), 1,
                             (8 + 2 * (double)(dt / sojourn[i])) * EPS);
            sum += Pi[i * M + j];
        }
        assert_close(sum, 1, 4 * EPS);
    }
    assert_int_equal(jl_chain_check(Pi, NULL, M), JL_OK);
}

static void test_chain_sojourn(void **state)
{
    static const jl_real dts[] = { JL_C(1.0e-12), JL_C(0.1), 1, 30, 1000 };
    int M, k, i;

    (void)state;
    for (k = 0; k < 5; k++) {
        for (M = 1; M <= 6; M++)
            check_sojourn(M, dts[k]);
        check_sojourn(JL_MAX_MODES, dts[k]);
    }
    assert_int_equal(jl_chain_sojourn(Pi, sojourn, 5, 0), JL_OK);
    for (i = 0; i < 25; i++)
        assert_true(Pi[i] == (jl_real)(i % 6 == 0));
    sojourn[0] = JL_REAL_MIN;           /* dt / sojourn overflows */
    assert_int_equal(jl_chain_sojourn(Pi, sojourn, 3, JL_LARGE), JL_OK);
    assert_true(Pi[0] == 0 && Pi[1] == JL_C(0.5) && Pi[2] == JL_C(0.5));
}

/* E = A E, or with A NULL E E */
static void times(long double *E, const long double *A, int M)
{
    long double old[36];
    int i, j, k;

    memcpy(old, E, sizeof old);
    for (i = 0; i < M; i++)
        for (j = 0; j < M; j++)
            for (E[i * M + j] = 0, k = 0; k < M; k++)
                E[i * M + j] += (A != NULL ? A : old)[i * M + k]
                    * old[k * M + j];
}

/* exp(dt G) of the rates G, by Taylor's series and squaring. */
static void exponential(long double *E, const jl_real *sojourn_s, int M,
                        long double dt)
{
    long double G[36], h = dt;
    int i, k, squarings = 0;

    for (; h > 0.01L; h /= 2)
        squarings++;
    for (i = 0; i < M * M; i++) {
        G[i] = 1 / (long double)sojourn_s[i / M]
            * (i % (M + 1) == 0 ? -1 : 1.0L / (M - 1));
        E[i] = i % (M + 1) == 0;
    }
    for (k = 12; k > 0; k--) {          /* E = I + h G / k E */
        times(E, G, M);
        for (i = 0; i < M * M; i++)
            E[i] = E[i] * h / k + (i % (M + 1) == 0);
    }
    for (; squarings > 0; squarings--)
        times(E, NULL, M);
}

/* Pi(dt/k)^k for k = 2^doublings. */
static void small_steps(jl_real *to, const jl_real *sojourn_s, int M,
                        jl_real dt, int doublings)
{
    jl_real half[36];

    assert_int_equal(jl_chain_sojourn(to, sojourn_s, M, dt / (jl_real)(
        1 << doublings)), JL_OK);
    for (; doublings > 0; doublings--) {
        memcpy(half, to, sizeof half);
        jl_mat_mul(to, half, half, M, M, M);
    }
}

/* How far from the exponential in its worst element. */
static double off_exponential(const jl_real *sojourn_s, int M, jl_real dt,
                              int doublings)
{
    jl_real steps[36] = { 0 };
    long double E[36] = { 0 }, worst = 0;
    int i;

    exponential(E, sojourn_s, M, dt);
    small_steps(steps, sojourn_s, M, dt, doublings);
    for (i = 0; i < M * M; i++)
        if (fabsl(steps[i] - E[i]) > worst)
            worst = fabsl(steps[i] - E[i]);
    return (double)worst;
}

/* The header's numbers, and what it says of small steps. */
static void test_chain_sojourn_leaves_out_returns(void **state)
{
    static const jl_real chains[3][6] = {
        { 20, 20 }, { 60, 10, 20, 20 }, { 30, 5, 8, 100, 9, 12 }
    };
    static const jl_real dts[] = { 1, 7, 10, 60, 957 };
    static const double stays[][3] = {
        { 1, 0.951, 0.952 }, { 10, 0.607, 0.684 }, { 957, 0, 0.5 }
    };
    long double E[36] = { 0 }, sum = 0;
    jl_real steps[36] = { 0 };
    int c, k, r, i;

    (void)state;
    for (k = 0; k < 3; k++) {
        exponential(E, chains[0], 2, stays[k][0]);
        assert_close(E[0], 0.5 + 0.5 * exp(-stays[k][0] / 10), 1e-14);
        assert_close(E[0], stays[k][2], 0.0005);
        assert_int_equal(jl_chain_sojourn(Pi, chains[0], 2,
                                          (jl_real)stays[k][0]), JL_OK);
        assert_close(Pi[0], stays[k][1], 0.0005);
    }
    for (c = 0; c < 3; c++)
        for (k = 0; k < 5; k++) {
            const int M = 2 + 2 * c;
            const double shortest = c == 0 ? 20 : c == 1 ? 10 : 5;

            for (r = 0; r < 11; r++) {
                const double h = (double)dts[k] / (1 << r) / shortest;

                if (h < 0.125)
                    assert_true(off_exponential(chains[c], M, dts[k], r)
                                < h / 10 + 2 * (1 << r) * EPS);
            }
        }
    for (i = 0; i < 6; i++)             /* to the stationary distribution */
        sum += chains[2][i];
    small_steps(steps, chains[2], 6, 957, 14);
    for (i = 0; i < 36; i++)
        assert_close(steps[i], chains[2][i % 6] / sum,
                     957.0 / 16384 / 5 / 10 + 2 * 16384 * EPS);
}

static int sojourn_status(int M, int which, jl_real value, jl_real dt)
{
    static const jl_real chain[9] = { 9, 8, 7, 6, 5, 4, 3, 2, 1 };
    jl_real out[9], s[3] = { 1, 2, 3 };
    int status;

    memcpy(out, chain, sizeof out);
    s[which] = value;
    status = jl_chain_sojourn(out, s, M, dt);
    if (status != JL_OK)
        assert_same_bits(out, chain, sizeof out);
    return status;
}

static void test_chain_sojourn_refuses(void **state)
{
    int i;

    (void)state;
    assert_int_equal(sojourn_status(0, 0, 1, 1), JL_EDIM);
    assert_int_equal(sojourn_status(-1, 0, 1, 1), JL_EDIM);
    assert_int_equal(sojourn_status(JL_MAX_MODES + 1, 0, 1, 1), JL_EDIM);
    for (i = 0; i < 3; i++) {
        assert_int_equal(sojourn_status(3, i, NAN_, 1), JL_ENONFINITE);
        assert_int_equal(sojourn_status(3, i, INF_, 1), JL_ENONFINITE);
        assert_int_equal(sojourn_status(3, i, -INF_, 1), JL_ENONFINITE);
        assert_int_equal(sojourn_status(3, i, 0, 1), JL_ERANGE);
        assert_int_equal(sojourn_status(3, i, -1, 1), JL_ERANGE);
    }
    assert_int_equal(sojourn_status(3, 0, 1, NAN_), JL_ENONFINITE);
    assert_int_equal(sojourn_status(3, 0, 1, INF_), JL_ENONFINITE);
    assert_int_equal(sojourn_status(3, 0, 1, -JL_REAL_MIN), JL_ETIME);
    assert_int_equal(sojourn_status(1, 0, 0, 1), JL_ERANGE);
    assert_int_equal(sojourn_status(1, 0, NAN_, 1), JL_ENONFINITE);
}

static void test_chain_check(void **state)
{
    static const jl_real good[4] = { JL_C(0.25), JL_C(0.75), 1, 0 };
    const jl_real bad[] = { NAN_, INF_, -INF_ };
    const jl_real off = JL_PROB_TOLERANCE;
    jl_real a[4];
    int i, k;

    (void)state;
    assert_int_equal(jl_chain_check(NULL, NULL, 2), JL_OK);
    assert_int_equal(jl_chain_check(good, NULL, 2), JL_OK);
    assert_int_equal(jl_chain_check(good, good, 2), JL_OK);
    assert_int_equal(jl_chain_check(NULL, good, 2), JL_OK);
    for (i = 0; i < 4; i++) {
        for (k = 0; k < 3; k++) {
            memcpy(a, good, sizeof a);
            a[i] = bad[k];
            assert_int_equal(jl_chain_check(a, NULL, 2), JL_ENONFINITE);
            assert_int_equal(jl_chain_check(NULL, a + i / 2 * 2, 2),
                             JL_ENONFINITE);
        }
        for (k = -1; k <= 1; k += 2) {
            memcpy(a, good, sizeof a);
            a[i / 2 * 2] += (jl_real)k * off / 2;   /* row i/2 */
            assert_int_equal(jl_chain_check(a, NULL, 2), JL_OK);
            a[i / 2 * 2] += (jl_real)k * off;
            assert_int_equal(jl_chain_check(a, NULL, 2), JL_EPROB);
            assert_int_equal(jl_chain_check(NULL, a + i / 2 * 2, 2),
                             JL_EPROB);
            assert_int_equal(jl_chain_check(good, a + i / 2 * 2, 2),
                             JL_EPROB);
        }
        memcpy(a, good, sizeof a);
        a[i] = -JL_REAL_MIN;
        a[i ^ 1] = 1;
        assert_int_equal(jl_chain_check(a, NULL, 2), JL_EPROB);
        assert_int_equal(jl_chain_check(good, a + i / 2 * 2, 2), JL_EPROB);
    }
    a[0] = JL_C(1.5);
    a[1] = JL_C(-0.5);
    assert_int_equal(jl_chain_check(NULL, a, 2), JL_EPROB);
    a[0] = 0;
    assert_int_equal(jl_chain_check(NULL, a, 1), JL_EPROB);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mode_init_refuses),
        cmocka_unit_test(test_mode_init_lays_out),
        cmocka_unit_test(test_mode_set_products),
        cmocka_unit_test(test_mode_set_refuses_nonfinite),
        cmocka_unit_test(test_mode_set_refuses_covariances),
        cmocka_unit_test(test_mode_set_keeps_small_pivots),
        cmocka_unit_test(test_motion_closed_forms),
        cmocka_unit_test(test_motion_forgets_the_former),
        cmocka_unit_test(test_motion_with_another_sensor),
        cmocka_unit_test(test_motion_turn_is_an_arc),
        cmocka_unit_test(test_motion_turns_over_long_gaps),
        cmocka_unit_test(test_motion_turn_keeps_the_speed),
        cmocka_unit_test(test_motion_turn_zero_is_straight),
        cmocka_unit_test(test_motion_composes),
        cmocka_unit_test(test_motion_refuses_sizes),
        cmocka_unit_test(test_motion_refuses_numbers),
        cmocka_unit_test(test_motion_structure),
        cmocka_unit_test(test_mode_set_finds_blocks),
        cmocka_unit_test(test_mode_set_finds_what_is_picked),
        cmocka_unit_test(test_mode_structure_is_of_what_is_there),
        cmocka_unit_test(test_start_state),
        cmocka_unit_test(test_start_refuses),
        cmocka_unit_test(test_chain_sojourn),
        cmocka_unit_test(test_chain_sojourn_leaves_out_returns),
        cmocka_unit_test(test_chain_sojourn_refuses),
        cmocka_unit_test(test_chain_check),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
