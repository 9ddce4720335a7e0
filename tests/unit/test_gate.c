/* Gates: what is rejected, what that changes and what it does not, in one
 * filter and in many together; and measurements too large to be used. */
#include "close.h"

#include "jumplink/imm.h"

#define EPS ((double)JL_EPSILON)
#define NAN_ ((jl_real)NAN)
#define INF_ ((jl_real)INFINITY)
#define GATE JL_C(10.83)        /* 0.999 for m = 1 */

enum { N = 2, M = 3 };

static const jl_kf_form *const forms[] = { &jl_kf_joseph, &jl_kf_standard,
                                           &jl_kf_sqrt };

#define FORMS ((int)(sizeof forms / sizeof *forms))

static const jl_real absurd[] = { JL_LARGE, -JL_LARGE, JL_REAL_MAX,
                                  -JL_REAL_MAX, JL_LARGE * 2 };

#define ABSURD ((int)(sizeof absurd / sizeof *absurd))

static jl_real scratch[JL_IMM_SCRATCH(M, N, 1) + JL_MODE_SCRATCH(N, 1, 1)];

/* NaN wherever the filter may work. */
static jl_real *spoilt(void)
{
    size_t i;

    for (i = 0; i < sizeof scratch / sizeof *scratch; i++)
        scratch[i] = NAN_;
    return scratch;
}

/* --- one filter ---------------------------------------------------------- */

struct one {
    jl_mode mode;
    jl_kf kf;
    jl_real loglik;
    jl_real mode_mem[JL_MODE_MEM(N, 1, 1)], mem[JL_KF_STATE(N, 1)];
};

static struct one rig, twin, before;

/* A CV mode, started at 0. */
static void make(struct one *o, const jl_kf_form *form)
{
    const jl_motion motion = { JL_MOTION_CV, 1, 2, JL_C(0.5), 0, 3, 0 };
    const jl_real zero = 0;
    jl_real x[N], P[N * N];

    memset(o, 0, sizeof *o);
    assert_int_equal(jl_mode_init(&o->mode, N, 1, 1, o->mode_mem,
                                  JL_MODE_MEM(N, 1, 1)), JL_OK);
    assert_int_equal(jl_mode_motion(&o->mode, &motion, 1), JL_OK);
    assert_int_equal(jl_kf_init(&o->kf, &o->mode, form, o->mem,
                                JL_KF_STATE(N, 1)), JL_OK);
    jl_motion_start(x, P, &motion, &zero, 5, 1);
    assert_int_equal(jl_kf_set(&o->kf, x, P, spoilt()), JL_OK);
}

/* n = m = 1: F = 1, W = q, H = h, R = r, from x = 0 and P. */
static void make_scalar(struct one *o, const jl_kf_form *form, jl_real q,
                        jl_real h, jl_real r, jl_real P)
{
    const jl_real one = 1, x = 0;

    memset(o, 0, sizeof *o);
    assert_int_equal(jl_mode_init(&o->mode, 1, 1, 1, o->mode_mem,
                                  JL_MODE_MEM(1, 1, 1)), JL_OK);
    assert_int_equal(jl_mode_set(&o->mode, &one, &one, &q, NULL, &h, &r,
                                 scratch), JL_OK);
    assert_int_equal(jl_kf_init(&o->kf, &o->mode, form, o->mem,
                                JL_KF_STATE(1, 1)), JL_OK);
    assert_int_equal(jl_kf_set(&o->kf, &x, &P, spoilt()), JL_OK);
}

static void step(struct one *o, const jl_real *z)
{
    assert_int_equal(jl_kf_step(&o->kf, &o->loglik, z, spoilt()), JL_OK);
}

static void step_fails(struct one *o, const jl_real *z, int code)
{
    before = *o;
    assert_int_equal(jl_kf_step(&o->kf, &o->loglik, z, spoilt()), code);
    assert_int_equal(jl_kf_update(&o->kf, &o->loglik, z, spoilt()), code);
    assert_same_bits(o, &before, sizeof before);
}

static void check_counts(const struct one *o, int verdict, int run,
                         unsigned long rejected, unsigned long accepted)
{
    assert_int_equal(o->kf.verdict, verdict);
    assert_int_equal(o->kf.run, run);
    assert_int_equal(o->kf.rejected, rejected);
    assert_int_equal(o->kf.accepted, accepted);
}

static void check_same(const struct one *a, const struct one *b)
{
    int n = a->mode.n;

    assert_same_bits(a->kf.x, b->kf.x, (size_t)n * sizeof(jl_real));
    assert_same_bits(a->kf.P, b->kf.P, (size_t)(n * n) * sizeof(jl_real));
    assert_same_bits(&a->loglik, &b->loglik, sizeof a->loglik);
}

/* A z whose innovation at the next step is so many sqrt(S): by hand, for CV
 * with H = [1 0]. */
static jl_real at_sigmas(const struct one *o, jl_real sigmas)
{
    const jl_real *x = o->kf.x;
    jl_real P[N * N], S;

    jl_kf_cov(&o->kf, P);
    S = P[0] + P[1] + P[2] + P[3] + o->mode.W[0] + o->mode.R[0];
    return x[0] + x[1] + sigmas * (jl_real)sqrt((double)S);
}

static void test_kf_gate_refuses(void **state)
{
    const jl_real bad[] = { -1, -JL_REAL_MIN, NAN_, INF_, -INF_ };
    int i;

    (void)state;
    make(&rig, &jl_kf_joseph);
    assert_int_equal(jl_kf_gate(&rig.kf, 9, 2), JL_OK);
    before = rig;
    for (i = 0; i < 5; i++)
        assert_int_equal(jl_kf_gate(&rig.kf, bad[i], 5), JL_ERANGE);
    assert_int_equal(jl_kf_gate(&rig.kf, 9, -1), JL_ERANGE);
    assert_same_bits(&rig, &before, sizeof rig);
    assert_int_equal(jl_kf_gate(&rig.kf, 0, 0), JL_OK);
    assert_int_equal(jl_kf_gate(&rig.kf, JL_REAL_MAX, INT_MAX), JL_OK);
}

/* Just above the limit it is as if the measurement were missing, just below as
 * if there were no gate. */
static void test_kf_gate_at_its_limit(void **state)
{
    const jl_real edge = (jl_real)sqrt((double)GATE);
    jl_real z;
    int f, side, k;

    (void)state;
    for (f = 0; f < FORMS; f++)
        for (side = -1; side <= 1; side += 2) {
            make(&rig, forms[f]);
            make(&twin, forms[f]);
            assert_int_equal(jl_kf_gate(&rig.kf, GATE, JL_GATE_MOST), JL_OK);
            for (k = 0; k < 5; k++) {
                z = at_sigmas(&rig, (jl_real)side * edge * JL_C(0.999));
                step(&rig, &z);
                step(&twin, &z);
                check_same(&rig, &twin);
                check_counts(&rig, JL_ACCEPTED, 0, (unsigned)k,
                             (unsigned)k + 1);
                assert_close(rig.kf.innovation.nis,
                             GATE * JL_C(0.999) * JL_C(0.999), 1000 * EPS);
                z = at_sigmas(&rig, (jl_real)side * edge * JL_C(1.001));
                step(&rig, &z);
                step(&twin, NULL);
                check_same(&rig, &twin);
                assert_true(rig.loglik == 0);
                check_counts(&rig, JL_REJECTED, 1, (unsigned)k + 1,
                             (unsigned)k + 1);
                assert_close(rig.kf.innovation.nis,
                             GATE * JL_C(1.001) * JL_C(1.001), 1000 * EPS);
                assert_close(rig.kf.innovation.nu[0], z - rig.kf.x[0],
                             1000 * EPS);
            }
        }
}

/* Update by itself: a rejected measurement leaves the estimate alone. */
static void test_kf_gate_of_update_alone(void **state)
{
    jl_real z = 1000, x[N], P[N * N];
    int f, k;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make(&rig, forms[f]);
        make(&twin, forms[f]);
        jl_kf_gate(&rig.kf, GATE, 2);
        memcpy(x, rig.kf.x, sizeof x);
        memcpy(P, rig.kf.P, sizeof P);
        for (k = 1; k <= 2; k++) {
            rig.loglik = 7;
            assert_int_equal(jl_kf_update(&rig.kf, &rig.loglik, &z, spoilt()),
                             JL_OK);
            assert_true(rig.loglik == 0);
            assert_same_bits(rig.kf.x, x, sizeof x);
            assert_same_bits(rig.kf.P, P, sizeof P);
            check_counts(&rig, JL_REJECTED, k, (unsigned)k, 0);
        }
        assert_int_equal(jl_kf_update(&rig.kf, NULL, &z, spoilt()), JL_OK);
        assert_int_equal(jl_kf_update(&twin.kf, &twin.loglik, &z, spoilt()),
                         JL_OK);
        rig.loglik = twin.loglik;
        check_same(&rig, &twin);
        check_counts(&rig, JL_ACCEPTED, 0, 2, 1);
    }
}

/* After so many rejections in a row the next is accepted, as without a gate;
 * and then the count begins anew. */
static void test_kf_gate_gives_in(void **state)
{
    static const int most[] = { 0, 1, JL_GATE_MOST, 9 };
    jl_real z;
    int f, i, k, round;

    (void)state;
    for (f = 0; f < FORMS; f++)
        for (i = 0; i < 4; i++) {
            make(&rig, forms[f]);
            make(&twin, forms[f]);
            jl_kf_gate(&rig.kf, GATE, most[i]);
            for (round = 0; round < 3; round++)
                for (k = 0; k <= most[i]; k++) {
                    z = at_sigmas(&rig, 50);
                    step(&rig, &z);
                    step(&twin, k < most[i] ? NULL : &z);
                    check_same(&rig, &twin);
                    check_counts(&rig, k < most[i] ? JL_REJECTED
                                                   : JL_ACCEPTED,
                                 k < most[i] ? k + 1 : 0,
                                 (unsigned)(round * most[i] + k
                                            + (k < most[i])),
                                 (unsigned)(round + (k == most[i])));
                }
        }
}

/* A good one ends the row, a missing one does not. */
static void test_kf_gate_row_of_rejections(void **state)
{
    jl_real z;

    (void)state;
    make(&rig, &jl_kf_joseph);
    jl_kf_gate(&rig.kf, GATE, 2);
    z = at_sigmas(&rig, 30);
    step(&rig, &z);
    check_counts(&rig, JL_REJECTED, 1, 1, 0);
    z = at_sigmas(&rig, 1);
    step(&rig, &z);
    check_counts(&rig, JL_ACCEPTED, 0, 1, 1);
    z = at_sigmas(&rig, 30);
    step(&rig, &z);
    step(&rig, NULL);
    check_counts(&rig, JL_MISSING, 1, 2, 1);
    z = at_sigmas(&rig, 30);
    step(&rig, &z);
    check_counts(&rig, JL_REJECTED, 2, 3, 1);
    step(&rig, NULL);
    step(&rig, NULL);
    z = at_sigmas(&rig, 30);
    step(&rig, &z);
    check_counts(&rig, JL_ACCEPTED, 0, 3, 2);
}

/* Without a gate, and with one that nothing exceeds: the same bits, whatever
 * comes; also after a gate was there. */
static void test_kf_gate_of_nothing(void **state)
{
    static const jl_real sigmas[] = { 1, -3, 40, 0, -1000, 2 };
    jl_real z;
    int f, k, wide;

    (void)state;
    for (f = 0; f < FORMS; f++)
        for (wide = 0; wide < 2; wide++) {
            make(&rig, forms[f]);
            make(&twin, forms[f]);
            jl_kf_gate(&rig.kf, 1, 3);
            jl_kf_gate(&rig.kf, wide ? JL_REAL_MAX : 0, wide ? 5 : 0);
            for (k = 0; k < 60; k++) {
                z = at_sigmas(&rig, sigmas[k % 6]);
                step(&rig, k % 7 == 4 ? NULL : &z);
                step(&twin, k % 7 == 4 ? NULL : &z);
                check_same(&rig, &twin);
                assert_int_equal(rig.kf.rejected, 0);
            }
        }
}

/* nis is nu^2 / S, and its mean that of the accepted ones since set. */
static void test_kf_nis_and_its_mean(void **state)
{
    static const jl_real sigmas[] = { 1, JL_C(-0.5), 20, 2, 0, -20 };
    const jl_real x[N] = { 0, 0 }, P[N * N] = { 1, 0, 0, 1 };
    double sum = 0;
    jl_real z;
    int k, accepted = 0;

    (void)state;
    make(&rig, &jl_kf_joseph);
    jl_kf_gate(&rig.kf, GATE, 100);
    for (k = 0; k < 30; k++) {
        double s = (double)sigmas[k % 6];

        z = at_sigmas(&rig, sigmas[k % 6]);
        step(&rig, &z);
        assert_close(rig.kf.innovation.nis, s * s, 200 * EPS * (1 + s * s));
        if (s * s < (double)GATE) {
            sum += s * s;
            accepted++;
        }
        assert_close(rig.kf.nis_mean, sum / accepted, 1000 * EPS);
    }
    assert_int_equal(rig.kf.accepted, accepted);
    assert_int_equal(rig.kf.rejected, 10);
    assert_int_equal(jl_kf_set(&rig.kf, x, P, spoilt()), JL_OK);
    check_counts(&rig, JL_MISSING, 0, 0, 0);
    assert_true(rig.kf.nis_mean == 0 && rig.kf.innovation.nis == 0);
    assert_true(rig.kf.gate == GATE);   /* set is of the estimate */
}

/* A step that fails changes nothing, counters neither. */
static void test_kf_gate_and_failures(void **state)
{
    const jl_real bad[] = { NAN_, INF_, -INF_ };
    jl_real z = 1000;
    int f, i;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make(&rig, forms[f]);
        jl_kf_gate(&rig.kf, GATE, 3);
        step(&rig, &z);
        for (i = 0; i < 3; i++)
            step_fails(&rig, &bad[i], JL_ENONFINITE);
        rig.mode.R[0] = rig.mode.V[0] = JL_C(-1.0e9);
        step_fails(&rig, &z, JL_ESINGULAR);
        rig.mode.F[0] = JL_REAL_MAX;
        assert_int_equal(jl_kf_step(&rig.kf, NULL, &z, spoilt()),
                         JL_ENONFINITE);
        check_counts(&rig, JL_REJECTED, 1, 1, 0);
    }
}

/* --- measurements that cannot be used ------------------------------------ */

/* With a gate they are rejected, however often, and nothing is left of them. */
static void test_kf_gate_and_absurd_measurements(void **state)
{
    jl_real z;
    int f, k;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make_scalar(&rig, forms[f], JL_REAL_MIN, 1, JL_REAL_MIN * 4, 0);
        make_scalar(&twin, forms[f], JL_REAL_MIN, 1, JL_REAL_MIN * 4, 0);
        jl_kf_gate(&rig.kf, GATE, 2);
        for (k = 0; k < 20; k++) {
            step(&rig, &absurd[k % ABSURD]);
            step(&twin, NULL);
            check_same(&rig, &twin);
            check_counts(&rig, JL_REJECTED, k + 1, (unsigned)k + 1, 0);
            assert_true(rig.kf.innovation.nis > JL_REAL_MAX);
            assert_true(rig.kf.innovation.loglik < -JL_REAL_MAX);
            assert_true(rig.kf.innovation.nu[0] == absurd[k % ABSURD]);
        }
        z = JL_REAL_MIN;
        step(&rig, &z);
        step(&twin, &z);
        check_same(&rig, &twin);
        check_counts(&rig, JL_ACCEPTED, 0, 20, 1);
        assert_close(rig.kf.nis_mean, twin.kf.nis_mean, 0);
    }
}

/* On the way to the sum, infinities may meet: 0 times one, or two of them. */
static void test_kf_gate_where_nis_is_no_number(void **state)
{
    static jl_mode mode;
    static jl_real mode_mem[JL_MODE_MEM(2, 2, 1)], mem[JL_KF_STATE(2, 2)];
    static jl_real work[JL_KF_SCRATCH(2, 2) + JL_MODE_SCRATCH(2, 2, 1)];
    const jl_real eye[4] = { 1, 0, 0, 1 }, G[2] = { 1, 1 }, x[2] = { 0, 0 };
    const jl_real q = JL_REAL_MIN, P[4] = { 0, 0, 0, 0 };
    const jl_real z[2] = { JL_LARGE, JL_LARGE };
    jl_real R[4] = { 0, 0, 0, 0 };
    jl_kf kf;
    int f;

    (void)state;
    R[0] = R[3] = 4 * JL_REAL_MIN;
    for (f = 0; f < FORMS; f++) {
        jl_mode_init(&mode, 2, 2, 1, mode_mem, JL_MODE_MEM(2, 2, 1));
        assert_int_equal(jl_mode_set(&mode, eye, G, &q, NULL, eye, R, work),
                         JL_OK);
        assert_int_equal(jl_kf_init(&kf, &mode, forms[f], mem,
                                    JL_KF_STATE(2, 2)), JL_OK);
        assert_int_equal(jl_kf_set(&kf, x, P, work), JL_OK);
        assert_int_equal(jl_kf_step(&kf, NULL, z, work), JL_ENONFINITE);
        jl_kf_gate(&kf, GATE, 5);
        assert_int_equal(jl_kf_step(&kf, NULL, z, work), JL_OK);
        assert_int_equal(kf.verdict, JL_REJECTED);
        assert_true(kf.innovation.nis > JL_REAL_MAX);
        assert_true(kf.innovation.loglik < -JL_REAL_MAX);
        assert_true(kf.x[0] == 0);
    }
    mode.V[3] = -1;             /* sqrt: after the first component is beyond */
    assert_int_equal(jl_kf_step(&kf, NULL, z, work), JL_ESINGULAR);
}

/* A mode's function that has no value, say. */
static int no_value(jl_real *y, const jl_real *x, void *context)
{
    (void)y, (void)x, (void)context;
    return JL_ENONFINITE;
}

/* That is not the measurement's fault: an error, gate or no gate. */
static void test_kf_gate_and_updates_without_nis(void **state)
{
    static jl_nonlinear blind;
    jl_real z = 1000;
    int f;

    (void)state;
    blind.h = no_value;
    for (f = 0; f < FORMS; f++) {
        make(&rig, forms[f]);
        jl_kf_gate(&rig.kf, GATE, 5);
        step(&rig, &z);
        check_counts(&rig, JL_REJECTED, 1, 1, 0);
        assert_int_equal(jl_mode_nonlinear(&rig.mode, &blind), JL_OK);
        step_fails(&rig, &z, JL_ENONFINITE);
    }
}

/* Without a gate they are an error, or ruin the filter if they can be used. */
static void test_kf_absurd_measurements_without_a_gate(void **state)
{
    int f, k;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make(&rig, forms[f]);
        for (k = 2; k < ABSURD; k++)
            step_fails(&rig, &absurd[k], JL_ENONFINITE);
        step(&rig, &absurd[0]);         /* JL_LARGE itself can be used */
        assert_true(rig.kf.x[0] > JL_LARGE / 2);
        assert_int_equal(jl_kf_step(&rig.kf, NULL, NULL, spoilt()),
                         JL_ENONFINITE);
    }
}

/* The nis is a number, but x would be beyond JL_LARGE: rejected, until the gate
 * gives in; then it fails, as without one. */
static void test_kf_gate_and_estimates_beyond_large(void **state)
{
    const jl_real z = JL_LARGE, good = 1;
    int f;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        make_scalar(&rig, forms[f], 1, JL_C(0.25), 1, JL_LARGE);
        step_fails(&rig, &z, JL_ENONFINITE);
        jl_kf_gate(&rig.kf, GATE, 1);
        step(&rig, &z);
        check_counts(&rig, JL_REJECTED, 1, 1, 0);
        assert_true(rig.kf.innovation.nis <= JL_REAL_MAX);
        assert_true(rig.kf.x[0] == 0);
        step_fails(&rig, &z, JL_ENONFINITE);
        step(&rig, &good);
        check_counts(&rig, JL_ACCEPTED, 0, 1, 1);
    }
}

/* --- many filters -------------------------------------------------------- */

struct many {
    jl_mode modes[M];
    jl_imm imm;
    jl_real mode_mem[M][JL_MODE_MEM(N, 1, 1)], mem[JL_IMM_STATE(M, N, 1)];
};

static struct many bank, other, was;

static const jl_real accel_std[M] = { JL_C(0.1), 2, 10 };
static const jl_real general[M * M] = {
    JL_C(0.9), JL_C(0.06), JL_C(0.04), JL_C(0.1), JL_C(0.8), JL_C(0.1),
    JL_C(0.2), JL_C(0.1), JL_C(0.7)
}, sticky[M * M] = {
    JL_C(0.9), JL_C(0.05), JL_C(0.05), JL_C(0.05), JL_C(0.9), JL_C(0.05),
    JL_C(0.05), JL_C(0.05), JL_C(0.9)
}, closed[M * M] = {            /* nobody enters mode 2 */
    JL_C(0.9), JL_C(0.1), 0, JL_C(0.1), JL_C(0.9), 0, JL_C(0.5), JL_C(0.5), 0
};

/* M CV modes of more and more acceleration. */
static void gather(struct many *b, const jl_kf_form *form, const jl_real *Pi)
{
    static const jl_real mu[M] = { JL_C(0.5), JL_C(0.25), JL_C(0.25) };
    jl_real x[M * N], P[M * N * N], zero = 0;
    int j;

    memset(b, 0, sizeof *b);
    for (j = 0; j < M; j++) {
        jl_motion motion = { JL_MOTION_CV, 1, 2, 0, 0, 1, 0 };

        motion.accel_std = accel_std[j];
        assert_int_equal(jl_mode_init(&b->modes[j], N, 1, 1, b->mode_mem[j],
                                      JL_MODE_MEM(N, 1, 1)), JL_OK);
        assert_int_equal(jl_mode_motion(&b->modes[j], &motion, 1), JL_OK);
        jl_motion_start(x + j * N, P + j * N * N, &motion, &zero, 2, 1);
    }
    assert_int_equal(jl_imm_init(&b->imm, M, b->modes, form, JL_MIX_AUTO,
                                 b->mem, JL_IMM_STATE(M, N, 1)), JL_OK);
    assert_int_equal(jl_imm_chain(&b->imm, Pi), JL_OK);
    assert_int_equal(jl_imm_set(&b->imm, x, P, mu, spoilt()), JL_OK);
}

static void walk(struct many *b, const jl_real *z)
{
    assert_int_equal(jl_imm_step(&b->imm, z, spoilt()), JL_OK);
}

static void check_tally(const struct many *b, int verdict, int run,
                        unsigned long rejected, unsigned long accepted)
{
    assert_int_equal(b->imm.verdict, verdict);
    assert_int_equal(b->imm.run, run);
    assert_int_equal(b->imm.rejected, rejected);
    assert_int_equal(b->imm.accepted, accepted);
}

/* State and results. */
static void check_alike(const struct many *a, const struct many *b)
{
    size_t real = sizeof(jl_real);

    assert_same_bits(a->imm.x, b->imm.x, M * N * real);
    assert_same_bits(a->imm.P, b->imm.P, M * N * N * real);
    assert_same_bits(a->imm.logmu, b->imm.logmu, M * real);
    assert_same_bits(a->imm.mu, b->imm.mu, M * real);
    assert_same_bits(a->imm.xhat, b->imm.xhat, N * real);
    assert_same_bits(a->imm.Phat, b->imm.Phat, N * N * real);
    assert_same_bits(&a->imm.loglik, &b->imm.loglik, real);
}

/* A z at so many sqrt(S) of mode j: found by trying 0 on a copy. */
static jl_real sigmas_of(const struct many *b, int j, jl_real sigmas)
{
    static struct many copy;
    const jl_real zero = 0;
    ptrdiff_t by = (char *)&copy - (const char *)b;
    jl_imm *imm = &copy.imm;
    jl_real nu, P[N * N];

    copy = *b;                          /* pointers, too, into the copy */
#define MOVE(p) (p) = (void *)((char *)(p) + by)
    MOVE(imm->x), MOVE(imm->P), MOVE(imm->logmu), MOVE(imm->mu);
    MOVE(imm->xhat), MOVE(imm->Phat), MOVE(imm->Shat), MOVE(imm->nis_mean);
    MOVE(imm->xw), MOVE(imm->Pw), MOVE(imm->logc), MOVE(imm->c);
    MOVE(imm->l), MOVE(imm->nis), MOVE(imm->nu), MOVE(imm->e);
    MOVE(imm->d), MOVE(imm->Pi), MOVE(imm->lambda), MOVE(imm->v);
#undef MOVE
    imm->modes = copy.modes;
    jl_imm_gate(imm, 0, 0);
    jl_imm_mix(imm, spoilt());
    jl_imm_predict_mode(imm, j, spoilt());
    imm->form->cov->give(P, imm->Pw + j * N * N, N);
    nu = zero - imm->xw[j * N];
    return sigmas * (jl_real)sqrt((double)(P[0] + copy.modes[j].R[0])) - nu;
}

static void test_imm_gate_refuses(void **state)
{
    const jl_real bad[] = { -1, -JL_REAL_MIN, NAN_, INF_, -INF_ };
    int i;

    (void)state;
    gather(&bank, &jl_kf_joseph, general);
    assert_int_equal(jl_imm_gate(&bank.imm, 9, 2), JL_OK);
    was = bank;
    for (i = 0; i < 5; i++)
        assert_int_equal(jl_imm_gate(&bank.imm, bad[i], 5), JL_ERANGE);
    assert_int_equal(jl_imm_gate(&bank.imm, 9, -1), JL_ERANGE);
    assert_same_bits(&bank, &was, sizeof bank);
    assert_int_equal(jl_imm_gate(&bank.imm, 0, 0), JL_OK);
    assert_int_equal(jl_imm_gate(&bank.imm, JL_REAL_MAX, INT_MAX), JL_OK);
}

/* Or modes would be judged by a gate that they were not updated by. */
static void test_imm_gate_ends_the_step(void **state)
{
    const jl_real z = 1000;

    (void)state;
    gather(&bank, &jl_kf_joseph, general);
    jl_imm_mix(&bank.imm, spoilt());
    assert_int_equal(jl_imm_filter(&bank.imm, &z, spoilt()), JL_OK);
    jl_imm_gate(&bank.imm, GATE, 5);
    assert_int_equal(jl_imm_judge(&bank.imm, &z, spoilt()), JL_EORDER);
    assert_int_equal(jl_imm_weigh(&bank.imm), JL_EORDER);
}

/* What the boldest mode accepts changes all modes as without a gate; what it
 * rejects, none: mu is c. */
static void check_joint(const jl_kf_form *form, const jl_real *Pi)
{
    const jl_real edge = (jl_real)sqrt((double)GATE);
    jl_real z, c[M];
    int j, k;

    gather(&bank, form, Pi);
    gather(&other, form, Pi);
    jl_imm_gate(&bank.imm, GATE, JL_GATE_MOST);
    for (k = 0; k < 8; k++) {
        z = sigmas_of(&bank, 2, edge * JL_C(0.99));
        walk(&bank, &z);
        walk(&other, &z);
        assert_true(bank.imm.nis[0] > GATE && bank.imm.nis[2] < GATE);
        check_alike(&bank, &other);
        assert_same_bits(bank.imm.l, other.imm.l, sizeof c);
        assert_same_bits(bank.imm.nis, other.imm.nis, sizeof c);
        assert_same_bits(bank.imm.nis_mean, other.imm.nis_mean, sizeof c);
        check_tally(&bank, JL_ACCEPTED, 0, (unsigned)k, (unsigned)k + 1);

        z = sigmas_of(&bank, 2, edge * JL_C(1.01));
        jl_imm_foresee(&bank.imm);
        memcpy(c, bank.imm.c, sizeof c);
        walk(&bank, &z);
        walk(&other, NULL);
        check_alike(&bank, &other);
        assert_true(bank.imm.loglik == 0);
        for (j = 0; j < M; j++) {
            assert_close(bank.imm.mu[j], c[j], 8 * EPS);
            assert_true(bank.imm.nis[j] > GATE);
        }
        assert_same_bits(bank.imm.nis_mean, other.imm.nis_mean, sizeof c);
        check_tally(&bank, JL_REJECTED, 1, (unsigned)k + 1, (unsigned)k + 1);
    }
}

static void test_imm_gate_is_joint(void **state)
{
    int f;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        check_joint(forms[f], general);
        check_joint(forms[f], sticky);
    }
}

/* A mode that cannot be entered has no voice; but it is updated, too. */
static void test_imm_gate_asks_only_possible_modes(void **state)
{
    jl_real z;

    (void)state;
    gather(&bank, &jl_kf_joseph, closed);
    gather(&other, &jl_kf_joseph, closed);
    jl_imm_gate(&bank.imm, GATE, JL_GATE_MOST);
    z = sigmas_of(&bank, 1, 4);
    walk(&bank, &z);
    walk(&other, NULL);
    assert_true(bank.imm.nis[2] < GATE);        /* it would */
    check_alike(&bank, &other);
    check_tally(&bank, JL_REJECTED, 1, 1, 0);
    z = sigmas_of(&bank, 1, 3);
    walk(&bank, &z);
    walk(&other, &z);
    check_alike(&bank, &other);
    check_tally(&bank, JL_ACCEPTED, 0, 1, 1);
}

static void test_imm_gate_gives_in(void **state)
{
    static const int most[] = { 0, 1, JL_GATE_MOST, 9 };
    jl_real z;
    int f, i, k, round;

    (void)state;
    for (f = 0; f < FORMS; f++)
        for (i = 0; i < 4; i++) {
            gather(&bank, forms[f], i % 2 ? general : sticky);
            gather(&other, forms[f], i % 2 ? general : sticky);
            jl_imm_gate(&bank.imm, GATE, most[i]);
            for (round = 0; round < 3; round++)
                for (k = 0; k <= most[i]; k++) {
                    z = sigmas_of(&bank, 2, 50);
                    walk(&bank, &z);
                    walk(&other, k < most[i] ? NULL : &z);
                    check_alike(&bank, &other);
                    check_tally(&bank, k < most[i] ? JL_REJECTED : JL_ACCEPTED,
                                k < most[i] ? k + 1 : 0,
                                (unsigned)(round * most[i] + k
                                           + (k < most[i])),
                                (unsigned)(round + (k == most[i])));
                }
        }
}

static void test_imm_gate_row_of_rejections(void **state)
{
    jl_real z;

    (void)state;
    gather(&bank, &jl_kf_joseph, general);
    jl_imm_gate(&bank.imm, GATE, 2);
    z = sigmas_of(&bank, 2, 30);
    walk(&bank, &z);
    walk(&bank, NULL);
    check_tally(&bank, JL_MISSING, 1, 1, 0);
    assert_true(bank.imm.nis[0] == 0 && bank.imm.nis[2] == 0);
    z = sigmas_of(&bank, 0, 1);
    walk(&bank, &z);
    check_tally(&bank, JL_ACCEPTED, 0, 1, 1);
    z = sigmas_of(&bank, 2, 30);
    walk(&bank, &z);
    walk(&bank, NULL);
    z = sigmas_of(&bank, 2, 30);
    walk(&bank, &z);
    walk(&bank, NULL);
    check_tally(&bank, JL_MISSING, 2, 3, 1);
    z = sigmas_of(&bank, 2, 30);
    walk(&bank, &z);
    check_tally(&bank, JL_ACCEPTED, 0, 3, 2);
}

static void test_imm_gate_of_nothing(void **state)
{
    static const jl_real sigmas[] = { 1, -3, 40, 0, -1000, 2 };
    jl_real z;
    int f, k, wide;

    (void)state;
    for (f = 0; f < FORMS; f++)
        for (wide = 0; wide < 2; wide++) {
            gather(&bank, forms[f], general);
            gather(&other, forms[f], general);
            jl_imm_gate(&bank.imm, 1, 3);
            jl_imm_gate(&bank.imm, wide ? JL_REAL_MAX : 0, wide ? 5 : 0);
            for (k = 0; k < 60; k++) {
                z = sigmas_of(&bank, 1, sigmas[k % 6]);
                walk(&bank, k % 7 == 4 ? NULL : &z);
                walk(&other, k % 7 == 4 ? NULL : &z);
                check_alike(&bank, &other);
                assert_int_equal(bank.imm.rejected, 0);
            }
        }
}

/* The mean of every mode's nis over what was accepted. */
static void test_imm_nis_and_its_mean(void **state)
{
    static const jl_real sigmas[] = { 1, -2, 25, JL_C(0.5), 3 };
    double sum[M] = { 0, 0, 0 };
    jl_real z;
    int j, k, accepted = 0;

    (void)state;
    gather(&bank, &jl_kf_joseph, general);
    jl_imm_gate(&bank.imm, GATE, 100);
    for (k = 0; k < 30; k++) {
        double s = (double)sigmas[k % 5];

        z = sigmas_of(&bank, k % M, sigmas[k % 5]);
        walk(&bank, &z);
        assert_close(bank.imm.nis[k % M], s * s, 1000 * EPS * (1 + s * s));
        if (bank.imm.verdict == JL_ACCEPTED) {
            accepted++;
            for (j = 0; j < M; j++)
                sum[j] += (double)bank.imm.nis[j];
        }
        for (j = 0; j < M; j++)
            assert_close(bank.imm.nis_mean[j], sum[j] / accepted,
                         1000 * EPS * (1 + sum[j]));
    }
    assert_true(accepted > 20 && bank.imm.rejected > 3);
    assert_int_equal(bank.imm.accepted, accepted);

    z = sigmas_of(&bank, 2, 25);
    walk(&bank, &z);
    check_tally(&bank, JL_REJECTED, 1, (unsigned)(31 - accepted),
                (unsigned)accepted);
    gather(&other, &jl_kf_joseph, general);     /* for its estimates */
    assert_int_equal(jl_imm_set(&bank.imm, other.imm.x, other.imm.P,
                                other.imm.mu, spoilt()), JL_OK);
    check_tally(&bank, JL_MISSING, 0, 0, 0);
    assert_true(bank.imm.nis_mean[0] == 0 && bank.imm.nis[1] == 0);
    assert_true(bank.imm.gate == GATE);
}

/* --- an update that fails although a mode accepts ------------------------- */

/* n = m = 1: mode 0 cannot use z = JL_LARGE (its nis is infinite, or its x
 * beyond), mode 1 has an R that finds it likely, mode 2 is like mode 1. */
static void gather_unlike(struct many *b, int infinite)
{
    const jl_real one = 1, q = 1, mu[M] = { JL_C(0.5), JL_C(0.25),
                                            JL_C(0.25) };
    const jl_real x[M] = { 0, 0, 0 };
    jl_real P[M] = { 1, 1, 1 };
    int j;

    memset(b, 0, sizeof *b);
    P[0] = infinite ? 0 : JL_LARGE;
    for (j = 0; j < M; j++) {
        jl_real h = j == 0 && !infinite ? JL_C(0.25) : 1;
        jl_real r = j > 0 ? JL_LARGE * JL_LARGE
            : infinite ? JL_REAL_MIN * 4 : 1;

        jl_mode_init(&b->modes[j], 1, 1, 1, b->mode_mem[j],
                     JL_MODE_MEM(1, 1, 1));
        assert_int_equal(jl_mode_set(&b->modes[j], &one, &one, &q, NULL, &h,
                                     &r, scratch), JL_OK);
        if (infinite)
            b->modes[j].W[0] = JL_REAL_MIN;
    }
    assert_int_equal(jl_imm_init(&b->imm, M, b->modes, &jl_kf_joseph,
                                 JL_MIX_AUTO, b->mem, JL_IMM_STATE(M, 1, 1)),
                     JL_OK);
    assert_int_equal(jl_imm_set(&b->imm, x, P, mu, spoilt()), JL_OK);
}

static void check_kept(const struct many *a, const struct many *b)
{
    assert_same_bits(a->imm.x, b->imm.x, M * sizeof(jl_real));
    assert_same_bits(a->imm.P, b->imm.P, M * sizeof(jl_real));
    assert_same_bits(a->imm.mu, b->imm.mu, M * sizeof(jl_real));
    assert_same_bits(a->imm.logmu, b->imm.logmu, M * sizeof(jl_real));
    assert_same_bits(a->imm.nis_mean, b->imm.nis_mean, M * sizeof(jl_real));
    check_tally(a, a->imm.verdict, b->imm.run, b->imm.rejected,
                b->imm.accepted);
}

static void test_imm_gate_and_an_update_that_fails_late(void **state)
{
    const jl_real z = JL_LARGE, good = 1, outside = JL_LARGE * 2;
    int infinite, j;

    (void)state;
    for (infinite = 0; infinite < 2; infinite++) {
        gather_unlike(&bank, infinite);
        gather_unlike(&other, infinite);
        assert_int_equal(jl_imm_step(&bank.imm, &z, spoilt()), JL_ENONFINITE);
        jl_imm_gate(&bank.imm, GATE, 5);
        walk(&bank, &outside);          /* counters that are not 0 */
        jl_imm_gate(&other.imm, GATE, 5);
        walk(&other, &outside);
        check_tally(&bank, JL_REJECTED, 1, 1, 0);

        assert_int_equal(jl_imm_step(&bank.imm, &z, spoilt()), JL_ENONFINITE);
        check_kept(&bank, &other);
        assert_int_equal(jl_imm_weigh(&bank.imm), JL_EORDER);
        jl_imm_foresee(&bank.imm);
        for (j = 0; j < M; j++) {
            jl_imm_mix_mode(&bank.imm, j, spoilt());
            jl_imm_predict_mode(&bank.imm, j, spoilt());
            assert_int_equal(jl_imm_update_mode(&bank.imm, j, &z, spoilt()),
                             JL_OK);
        }
        assert_true(bank.imm.nis[0] > GATE && bank.imm.nis[1] < GATE);
        assert_int_equal(bank.imm.nis[0] > JL_REAL_MAX, infinite);
        assert_int_equal(jl_imm_judge(&bank.imm, &z, spoilt()),
                         JL_ENONFINITE);
        assert_int_equal(jl_imm_judge(&bank.imm, &z, spoilt()), JL_EORDER);
        assert_int_equal(jl_imm_weigh(&bank.imm), JL_EORDER);
        check_kept(&bank, &other);
        walk(&bank, &good);             /* and it goes on */
        walk(&other, &good);
        check_kept(&bank, &other);
        check_tally(&bank, JL_ACCEPTED, 0, 1, 1);
    }
}

static void test_imm_gate_and_absurd_measurements(void **state)
{
    jl_real z;
    int f, k, i;

    (void)state;
    for (f = 0; f < FORMS; f++) {
        gather(&bank, forms[f], general);
        gather(&other, forms[f], general);
        for (i = 2; i < ABSURD; i++)            /* beyond JL_LARGE */
            assert_int_equal(jl_imm_step(&bank.imm, &absurd[i], spoilt()),
                             JL_ENONFINITE);
        jl_imm_gate(&bank.imm, GATE, 2);
        for (k = 0; k < 12; k++) {
            walk(&bank, &absurd[2 + k % (ABSURD - 2)]);
            walk(&other, NULL);
            check_alike(&bank, &other);
            check_tally(&bank, JL_REJECTED, k + 1, (unsigned)k + 1, 0);
        }
        z = sigmas_of(&bank, 0, 1);
        walk(&bank, &z);
        walk(&other, &z);
        check_alike(&bank, &other);
        check_tally(&bank, JL_ACCEPTED, 0, 12, 1);
        walk(&bank, &absurd[0]);                /* can be used: rejected ... */
        walk(&bank, &absurd[1]);
        check_tally(&bank, JL_REJECTED, 2, 14, 1);
        walk(&bank, &absurd[0]);                /* ... but not for ever */
        check_tally(&bank, JL_ACCEPTED, 0, 14, 2);
    }
}

/* --- why the gate is joint ----------------------------------------------- */

/* A step in which each mode has a gate of its own: one that rejects is as if it
 * had no measurement, and its likelihood is that of none, 1. */
static void walk_apart(struct many *b, const jl_real *z)
{
    jl_imm *imm = &b->imm;
    int j;

    jl_imm_mix(imm, spoilt());
    for (j = 0; j < M; j++) {
        jl_imm_predict_mode(imm, j, spoilt());
        jl_imm_update_mode(imm, j, z, spoilt());
        if (imm->nis[j] > GATE)
            imm->l[j] = imm->nis[j] = 0;
    }
    assert_int_equal(jl_imm_judge(imm, z, spoilt()), JL_OK);
    jl_imm_weigh(imm);
    jl_imm_combine(imm);
}

/* A target turns off with 12 m/s^2 for 5 s: the calm mode rejects what it
 * cannot explain, which costs it nothing, and wins although it is wrong. */
static void test_imm_gate_of_each_mode_is_wrong(void **state)
{
    jl_real z, apart = 0, joint = 0;
    int k;

    (void)state;
    gather(&bank, &jl_kf_joseph, sticky);
    gather(&other, &jl_kf_joseph, sticky);
    jl_imm_gate(&bank.imm, GATE, JL_GATE_MOST);
    jl_imm_gate(&other.imm, GATE, JL_GATE_MOST);
    for (k = 1; k <= 25; k++) {
        jl_real t = (jl_real)(k - 20), off = t > 0 ? 6 * t * t : 0;

        z = (jl_real)(3 * k) + off;
        walk(&bank, &z);
        walk_apart(&other, &z);
        if (k == 21) {
            assert_int_equal(bank.imm.verdict, JL_ACCEPTED);
            assert_true(bank.imm.nis[0] > GATE && bank.imm.nis[2] < GATE);
            assert_true(bank.imm.mu[0] < JL_C(0.01));
            assert_true(other.imm.mu[0] > JL_C(0.99));
        }
        if (k > 20) {
            joint += (bank.imm.xhat[0] - z) * (bank.imm.xhat[0] - z);
            apart += (other.imm.xhat[0] - z) * (other.imm.xhat[0] - z);
        }
    }
    assert_true(apart > 100 * joint);
    assert_int_equal(bank.imm.rejected, 0);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kf_gate_refuses),
        cmocka_unit_test(test_kf_gate_at_its_limit),
        cmocka_unit_test(test_kf_gate_of_update_alone),
        cmocka_unit_test(test_kf_gate_gives_in),
        cmocka_unit_test(test_kf_gate_row_of_rejections),
        cmocka_unit_test(test_kf_gate_of_nothing),
        cmocka_unit_test(test_kf_nis_and_its_mean),
        cmocka_unit_test(test_kf_gate_and_failures),
        cmocka_unit_test(test_kf_gate_and_absurd_measurements),
        cmocka_unit_test(test_kf_gate_where_nis_is_no_number),
        cmocka_unit_test(test_kf_gate_and_updates_without_nis),
        cmocka_unit_test(test_kf_absurd_measurements_without_a_gate),
        cmocka_unit_test(test_kf_gate_and_estimates_beyond_large),
        cmocka_unit_test(test_imm_gate_refuses),
        cmocka_unit_test(test_imm_gate_ends_the_step),
        cmocka_unit_test(test_imm_gate_is_joint),
        cmocka_unit_test(test_imm_gate_asks_only_possible_modes),
        cmocka_unit_test(test_imm_gate_gives_in),
        cmocka_unit_test(test_imm_gate_row_of_rejections),
        cmocka_unit_test(test_imm_gate_of_nothing),
        cmocka_unit_test(test_imm_nis_and_its_mean),
        cmocka_unit_test(test_imm_gate_and_an_update_that_fails_late),
        cmocka_unit_test(test_imm_gate_and_absurd_measurements),
        cmocka_unit_test(test_imm_gate_of_each_mode_is_wrong),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
