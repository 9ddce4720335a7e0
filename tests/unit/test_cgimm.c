/* The constant-gain IMM against the same equations in long double, written down
 * plainly; its stages, restarts, outliers, and what it refuses. */
#include "close.h"

#include "jumplink/cgimm.h"

#define EPS ((double)JL_EPSILON)
#define MODES 5
#define AXES 3
#define CAP JL_CGIMM_STATE(MODES, AXES)

/* Of positions in sqrt(R), v T and a T^2 alike, of mu and of loglik by 1 + its
 * size.  Measured: 5e-12 and 5e-3, where modes that are never left gather up
 * the rounding of their log-likelihoods; positions are up to 300 sqrt(R). */
#if JL_REAL_FLOAT
#define NEAR 2e-2
#else
#define NEAR 5e-11
#endif

/* Below it a foreseen probability may be 0, or not; above it none
 * may vanish, but for float, where e^l already does at l = -87. */
#define LEAST ((real)JL_REAL_MIN * 1024)

typedef long double real;

/* --- the textbook -------------------------------------------------------- */

struct textbook {
    int M, axes, order;
    real T, R, Pi[MODES][MODES], mu[MODES], loglik;
    real x[MODES][AXES][3], w[MODES][3], xhat[AXES][3];     /* p, v, a */
    const jl_cg_gains *gains;
    int vague;                          /* 1: a mode may be lost for good */
};

static void restart(struct textbook *b, int j)
{
    int i;

    for (i = 0; i < 3; i++)
        b->w[j][i] = i < b->gains[j].order ? (real)b->gains[j].start[i] : 0;
}

static void combine(struct textbook *b)
{
    int j, a, i;

    memset(b->xhat, 0, sizeof b->xhat);
    for (j = 0; j < b->M; j++)
        for (a = 0; a < b->axes; a++)
            for (i = 0; i < 3; i++)
                b->xhat[a][i] += b->mu[j] * b->x[j][a][i];
}

/* Mode t from x0 to x; returns its log-likelihood. */
static real filter(struct textbook *b, int t, real x0[AXES][3],
                   const jl_real *z)
{
    const jl_cg_gains *g = &b->gains[t];
    const real T = b->T;
    real l = 0;
    int a, i;

    for (i = 0; z != NULL && i < g->order; i++) {
        const real rate = g->k[i] > 0 ? -expm1l(-1 / (real)g->k[i]) : 1;

        b->w[t][i] += rate * ((real)g->steady[i] - b->w[t][i]);
    }
    for (a = 0; a < b->axes; a++) {
        real *x = b->x[t][a], acc = g->order == 3 ? x0[a][2] : 0;
        const real S = b->R / (1 - b->w[t][0]);
        real nu;

        x[0] = x0[a][0] + T * x0[a][1] + T * T / 2 * acc;
        x[1] = x0[a][1] + T * acc;
        x[2] = acc;
        if (z == NULL)
            continue;
        nu = (real)z[a] - x[0];
        x[0] += b->w[t][0] * nu;
        x[1] += b->w[t][1] / T * nu;
        x[2] += b->w[t][2] / (T * T) * nu;
        l -= (logl(2 * 3.14159265358979323846L * S) + nu * nu / S) / 2;
    }
    return l;
}

static void step(struct textbook *b, const jl_real *z)
{
    real x0[MODES][AXES][3] = { { { 0 } } }, c[MODES] = { 0 }, l[MODES];
    real best = -INFINITY, sum = 0;
    int s, t, a, i;

    for (t = 0; t < b->M; t++) {
        for (s = 0; s < b->M; s++)
            c[t] += b->Pi[s][t] * b->mu[s];
        b->vague |= c[t] > 0 && c[t] < LEAST;
        for (a = 0; a < b->axes; a++)
            for (i = 0; i < 3; i++) {
                for (s = 0; s < b->M && c[t] > 0; s++)
                    x0[t][a][i] += b->Pi[s][t] * b->mu[s] / c[t]
                        * b->x[s][a][i];
                if (!(c[t] > 0))
                    x0[t][a][i] = b->x[t][a][i];
            }
    }
    for (t = 0; t < b->M; t++) {
        l[t] = filter(b, t, x0[t], z);
        if (c[t] > 0 && l[t] > best)
            best = l[t];
    }
    for (t = 0; t < b->M; t++)
        sum += b->mu[t] = c[t] > 0 ? c[t] * expl(l[t] - best) : 0;
    for (t = 0; t < b->M; t++)
        b->mu[t] /= sum;
    b->loglik = z != NULL ? best + logl(sum) : 0;
    combine(b);
}

/* --- a filter and its textbook ------------------------------------------- */

struct setting {
    int M, axes;
    int order[MODES];
    double T, sigma;
    const double *Pi, *mu;              /* mu NULL: uniform */
};

static struct rig {
    jl_cgimm cg;
    jl_cg_gains gains[MODES];
    jl_real mem[CAP];
    struct textbook book;
} rig;

/* Modes of less and more noise, tracking indices .05 and up. */
static void make_gains(jl_cg_gains *gains, const struct setting *s)
{
    const double R = s->sigma * s->sigma;
    int j;

    for (j = 0; j < s->M; j++) {
        const double lambda = 0.05 * (1 << (2 * (s->M == 2 ? 2 * j : j)));

        assert_int_equal(jl_cg_design(&gains[j], s->order[j], (jl_real)s->T,
                                      (jl_real)(lambda * lambda * R
                                                / pow(s->T, 4)), (jl_real)R),
                         JL_OK);
    }
}

static void open_rig(struct rig *r, const struct setting *s)
{
    struct textbook *b = &r->book;
    jl_real Pi[MODES * MODES], x[MODES * AXES * 3], mu[MODES], *p = x;
    int M = s->M, i, j, a, order = 2;

    memset(r, 0, sizeof *r);
    make_gains(r->gains, s);
    for (i = 0; i < M * M; i++)
        b->Pi[i / M][i % M] = Pi[i] = (jl_real)s->Pi[i];
    for (i = 0; i < M; i++)
        b->mu[i] = mu[i] = s->mu != NULL ? (jl_real)s->mu[i]
            : 1 / (jl_real)M;
    for (j = 0; j < M; j++)
        if (s->order[j] > order)
            order = s->order[j];
    b->M = M;
    b->axes = s->axes;
    b->order = order;
    b->T = (jl_real)s->T;
    b->R = (jl_real)(s->sigma * s->sigma);
    b->gains = r->gains;
    assert_int_equal(jl_cgimm_init(&r->cg, M, r->gains, s->axes,
                                   (jl_real)s->T, (jl_real)b->R, Pi, r->mem,
                                   JL_CGIMM_STATE(M, s->axes)), JL_OK);
    assert_int_equal(r->cg.order, order);
    for (j = 0; j < M; j++)
        for (a = 0; a < s->axes; a++)
            for (i = 0; i < order; i++, p++) {
                const double unit = s->sigma / pow(s->T, i);

                *p = (jl_real)(unit * (1 + j - 2 * a + i));
                b->x[j][a][i] = i < s->order[j] ? (real)*p : 0;
            }
    assert_int_equal(jl_cgimm_set(&r->cg, x, s->mu != NULL ? mu : NULL), JL_OK);
    for (j = 0; j < M; j++)
        restart(b, j);
    combine(b);
}

/* Straight, a turn, straight; noise; every ninth is missing, and a stretch. */
static const jl_real *measured(jl_real z[AXES], const struct setting *s, int k)
{
    const double bend = k < 30 ? 0 : k < 50 ? k - 30 : 20;
    int a;

    for (a = 0; a < AXES; a++)
        z[a] = (jl_real)(s->sigma * (3 + a + (a - 1.5) * k + 0.4 * bend * bend
                                     + sin(5.0 * k + a) + cos(3.3 * k * a)));
    return k % 9 == 8 || (k >= 60 && k < 64) ? NULL : z;
}

static void check(const struct rig *r, const struct setting *s)
{
    const struct textbook *b = &r->book;
    jl_real x[AXES * 3], sum = 0;
    int a, i, j;

    jl_cgimm_estimate(&r->cg, x);
    for (a = 0; a < b->axes; a++)
        for (i = 0; i < b->order; i++) {
            const double unit = s->sigma / pow(s->T, i);

            assert_close((double)x[a * b->order + i] / unit,
                         (double)b->xhat[a][i] / unit, NEAR);
        }
    for (j = 0; j < b->M; j++) {
        assert_close(r->cg.mu[j], b->mu[j], NEAR);
        assert_true(r->cg.mu[j] > 0 || b->mu[j] < (JL_REAL_FLOAT ? 1 : LEAST));
        assert_true(r->cg.mu[j] >= 0);
        sum += r->cg.mu[j];
    }
    assert_close(sum, 1, 8 * EPS);
    assert_close(((double)jl_cgimm_loglik(&r->cg) - (double)b->loglik)
                 / (1 + fabs((double)b->loglik)), 0, NEAR);
}

static void run(const struct setting *s)
{
    jl_real z[AXES];
    int k;

    open_rig(&rig, s);
    check(&rig, s);
    for (k = 0; k < 80 && !rig.book.vague; k++) {
        const jl_real *z_k = measured(z, s, k);

        if (k == 40) {
            jl_cgimm_restart(&rig.cg, s->M - 1);
            restart(&rig.book, s->M - 1);
        }
        assert_int_equal(jl_cgimm_step(&rig.cg, z_k), JL_OK);
        step(&rig.book, z_k);
        if (!rig.book.vague)
            check(&rig, s);
    }
}

/* --- chains -------------------------------------------------------------- */

static const double one[] = { 1 };
static const double two[] = { 0.98, 0.02, 0.05, 0.95 };
static const double leaves[] = { 0.1, 0.9, 0.75, 0.25 };
static const double apart[] = { 1, 0, 0, 1 };           /* never left */
static const double trap[] = { 1, 0, 0.25, 0.75 };
static const double trap_too[] = { 0.75, 0.25, 0, 1 };
static const double turns[] = { 0, 1, 1, 0 };
static const double three[] = { 0.9, 0.05, 0.05, 0.1, 0.8, 0.1, 0, 0.25, 0.75 };
static const double closed[] = { 0.9, 0.1, 0, 0.2, 0.8, 0, 0.5, 0, 0.5 };
static const double held[] = { 1, 0, 0, 0, 1, 0, 0.125, 0.125, 0.75 };
static const double five[] = {
    0.8, 0.05, 0.05, 0.05, 0.05, 0.1, 0.9, 0, 0, 0, 0, 0.1, 0.8, 0.1, 0,
    0.02, 0.03, 0.05, 0.7, 0.2, 0, 0, 0, 0.5, 0.5
};

static const double first[] = { 1, 0 }, second[] = { 0, 1 };
static const double uneven[] = { 0.7, 0.3 };
static const double not_third[] = { 0.25, 0.75, 0 };
static const double third[] = { 0, 0, 1 };

static const struct {
    int M;
    const double *Pi, *mu;
} chains[] = {
    { 1, one, NULL }, { 2, two, NULL }, { 2, two, first }, { 2, two, second },
    { 2, leaves, uneven }, { 2, apart, uneven }, { 2, apart, first },
    { 2, apart, second }, { 2, trap, uneven }, { 2, trap_too, uneven },
    { 2, trap, second }, { 2, turns, uneven }, { 2, turns, first },
    { 3, three, NULL }, { 3, closed, not_third }, { 3, closed, third },
    { 3, held, NULL }, { 3, three, third }, { 5, five, NULL }
};
#define CHAINS ((int)(sizeof chains / sizeof *chains))

/* --- tests --------------------------------------------------------------- */

/* All arrangements of orders, 1 to 3 axes, at T = 1. */
static void test_cgimm_meets_textbook(void **state)
{
    struct setting s = { 0, 0, { 0 }, 1, 50, NULL, NULL };
    int c, arrangement, j;

    (void)state;
    for (c = 0; c < CHAINS; c++) {
        s.M = chains[c].M;
        s.Pi = chains[c].Pi;
        s.mu = chains[c].mu;
        for (s.axes = 1; s.axes <= AXES; s.axes++)
            for (arrangement = 0; arrangement < 1 << s.M; arrangement++) {
                for (j = 0; j < s.M; j++)
                    s.order[j] = 2 + (arrangement >> j & 1);
                run(&s);
            }
    }
}

static void test_cgimm_takes_any_period(void **state)
{
    static const double times[] = { 0.01, 0.5, 100 }, sigmas[] = { 0.1, 3000 };
    struct setting s = { 2, 2, { 2, 3 }, 0, 0, two, NULL };
    int t, i;

    (void)state;
    for (t = 0; t < 3; t++)
        for (i = 0; i < 2; i++) {
            s.T = times[t];
            s.sigma = sigmas[i];
            run(&s);
        }
}

/* Two modes, and the same two with a third that cannot be entered. */
static void test_cgimm_two_modes_are_two_of_three(void **state)
{
    const double chain[] = { 0.98, 0.02, 0, 0.05, 0.95, 0, 0, 0, 1 };
    const double mu[] = { 0.5, 0.5, 0 };
    const struct setting s = { 2, 2, { 2, 3 }, 1, 50, two, NULL };
    static struct rig more;
    jl_real z[AXES], x[AXES * 3], x_more[AXES * 3];
    jl_real Pi[9], mu_more[3], state_more[18];
    int k, i;

    (void)state;
    open_rig(&rig, &s);
    memset(&more, 0, sizeof more);
    memcpy(more.gains, rig.gains, sizeof more.gains);
    more.gains[2] = rig.gains[1];
    for (i = 0; i < 9; i++)
        Pi[i] = (jl_real)chain[i];
    for (i = 0; i < 3; i++)
        mu_more[i] = (jl_real)mu[i];
    assert_int_equal(jl_cgimm_init(&more.cg, 3, more.gains, 2, 1, 2500, Pi,
                                   more.mem, CAP), JL_OK);
    for (i = 0; i < 18; i++)
        state_more[i] = i < 12 ? (jl_real)rig.book.x[i / 6][i / 3 % 2][i % 3]
            : 0;
    assert_int_equal(jl_cgimm_set(&more.cg, state_more, mu_more), JL_OK);
    for (k = 0; k < 80; k++) {
        const jl_real *z_k = measured(z, &s, k);

        assert_int_equal(jl_cgimm_step(&rig.cg, z_k), JL_OK);
        assert_int_equal(jl_cgimm_step(&more.cg, z_k), JL_OK);
        jl_cgimm_estimate(&rig.cg, x);
        jl_cgimm_estimate(&more.cg, x_more);
        for (i = 0; i < 6; i++)
            assert_close(x[i] / 50, x_more[i] / 50, NEAR);
        for (i = 0; i < 2; i++)
            assert_close(rig.cg.mu[i], more.cg.mu[i], NEAR);
        assert_close(more.cg.mu[2], 0, 0);
        assert_close(jl_cgimm_loglik(&rig.cg),
                     jl_cgimm_loglik(&more.cg), NEAR);
    }
}

/* Bit by bit: what one processor does, and several do together. */
static void test_cgimm_step_is_its_stages(void **state)
{
    static struct rig other;
    struct setting s = { 0, 0, { 2, 3, 2, 3, 3 }, 1, 50, NULL, NULL };
    jl_real z[AXES];
    int c, k, j;

    (void)state;
    for (c = 0; c < CHAINS; c++)
        for (s.axes = 1; s.axes <= AXES; s.axes++) {
            s.M = chains[c].M;
            s.Pi = chains[c].Pi;
            s.mu = chains[c].mu;
            open_rig(&rig, &s);
            open_rig(&other, &s);
            for (k = 0; k < 300; k++) {
                const jl_real *z_k = measured(z, &s, k);
                int size = s.M * s.axes * 3;

                assert_int_equal(jl_cgimm_step(&rig.cg, z_k), JL_OK);
                jl_cgimm_foresee(&other.cg);
                for (j = s.M - 1; j >= 0; j--) {
                    jl_cgimm_mix_mode(&other.cg, j);
                    assert_int_equal(jl_cgimm_filter_mode(&other.cg, j, z_k),
                                     JL_OK);
                }
                assert_int_equal(jl_cgimm_weigh(&other.cg, z_k), JL_OK);
                jl_cgimm_combine(&other.cg);
                assert_same_bits(rig.cg.x, other.cg.x,
                                 (size_t)size * sizeof(jl_real));
                assert_same_bits(rig.cg.mu, other.cg.mu,
                                 (size_t)s.M * sizeof(jl_real));
                assert_same_bits(rig.cg.xhat, other.cg.xhat,
                                 (size_t)(s.axes * 3) * sizeof(jl_real));
                assert_true(jl_cgimm_loglik(&rig.cg)
                            == jl_cgimm_loglik(&other.cg));
            }
        }
}

static void test_cgimm_survives_outliers(void **state)
{
    static const jl_real far[] = { JL_C(5e6), JL_LARGE, -JL_LARGE, JL_LARGE };
    struct setting s = { 0, 2, { 2, 3, 3, 2, 3 }, 1, 0, NULL, NULL };
    jl_real z[AXES], x[AXES * 3];
    int c, f, k, i;

    (void)state;
    for (c = 0; c < CHAINS; c++)
        for (f = 0; f < 6; f++) {
            s.sigma = f < 3 ? 50 : 1e-6;        /* (far / 1e-6)^2 overflows */
            s.M = chains[c].M;
            s.Pi = chains[c].Pi;
            s.mu = chains[c].mu;
            open_rig(&rig, &s);
            for (k = 0; k < 60; k++) {
                jl_real sum = 0;

                (void)measured(z, &s, k);
                if (k % 10 == 5)
                    z[0] = far[f % 3];
                if (k % 10 == 5 && f % 3 > 0)
                    z[1] = far[f % 3 + k / 10 % 2];
                assert_int_equal(jl_cgimm_step(&rig.cg, z), JL_OK);
                jl_cgimm_estimate(&rig.cg, x);
                for (i = 0; i < 2 * rig.cg.order; i++)
                    assert_true(isfinite((double)x[i]));
                assert_true(isfinite((double)jl_cgimm_loglik(&rig.cg)));
                for (i = 0; i < s.M; i++) {
                    assert_true(rig.cg.mu[i] >= 0);
                    sum += rig.cg.mu[i];
                }
                assert_close(sum, 1, 8 * EPS);
            }
        }
}

/* Where one measurement in twelve comes modes of order 3 diverge, and what they
 * are mixed into with them; all is finite until that is told, and after. */
static void test_cgimm_tells_that_it_diverges(void **state)
{
    static struct rig before;
    struct setting s = { 0, 2, { 2, 3, 3 }, 1, 50, NULL, NULL };
    jl_real z[AXES], x[AXES * 3], again[MODES * AXES * 3] = { 0 };
    int M, k, i, status;

    (void)state;
    for (M = 1; M <= 3; M++) {
        s.M = M;
        s.order[0] = M == 1 ? 3 : 2;
        s.Pi = M == 1 ? one : M == 2 ? two : three;
        open_rig(&rig, &s);
        for (k = 0, status = JL_OK; status == JL_OK && k < 100000; k++) {
            before = rig;
            status = jl_cgimm_step(&rig.cg, k % 12 == 0 ? measured(z, &s, 0)
                                   : NULL);
            jl_cgimm_estimate(&rig.cg, x);
            for (i = 0; i < 6; i++)
                assert_true(isfinite((double)x[i]));
            for (i = 0; i < M; i++)
                assert_true(rig.cg.mu[i] >= 0 && rig.cg.mu[i] <= 1);
        }
        assert_int_equal(status, JL_ENONFINITE);
        assert_same_bits(&rig.cg, &before.cg, sizeof rig.cg);
        assert_same_bits(rig.mem, before.mem, sizeof rig.mem);
        assert_int_equal(jl_cgimm_step(&rig.cg, NULL), JL_ENONFINITE);
        jl_cgimm_foresee(&rig.cg);
        assert_int_equal(jl_cgimm_filter_mode(&rig.cg, 0, z), JL_ENONFINITE);
        assert_int_equal(jl_cgimm_set(&rig.cg, again, NULL), JL_OK);
        assert_int_equal(jl_cgimm_step(&rig.cg, z), JL_OK);
    }
}

/* 1 / c_t overflows. */
static void test_cgimm_survives_the_least_probabilities(void **state)
{
    const double least = (double)JL_REAL_MIN / 16;
    const double mu[] = { 1, least, 0 };
    struct setting s = { 0, 1, { 2, 3, 3 }, 1, 50, NULL, mu };
    jl_real z[AXES];
    int M, k, i;

    (void)state;
    for (M = 2; M <= 3; M++) {
        s.M = M;
        s.Pi = M == 2 ? apart : held;
        open_rig(&rig, &s);
        for (k = 0; k < 8; k++) {
            assert_int_equal(jl_cgimm_step(&rig.cg, measured(z, &s, k)), JL_OK);
            for (i = 0; i < 3; i++)
                assert_true(isfinite((double)rig.cg.xhat[i]));
            assert_close(rig.cg.mu[0], 1, 8 * EPS);
        }
    }
}

/* Rows of Pi may add up to a little more than 1, or less, for any time. */
static void test_cgimm_weights_keep_their_sum(void **state)
{
    static const double off[] = { 0.8, -0.8 };
    jl_cg_gains gains[MODES];
    struct setting s = { 0, 1, { 2, 3, 3 }, 1, 50, NULL, NULL };
    jl_real mem[CAP], z = 0;
    jl_cgimm cg;
    int M, i, k, j;

    (void)state;
    for (M = 1; M <= 3; M++)
        for (i = 0; i < 4; i++) {
            const jl_real more = (jl_real)off[i / 2] * (JL_REAL_FLOAT
                ? JL_C(1e-5) : JL_C(1e-9));
            jl_real Pi[9], sum;

            s.M = M;
            make_gains(gains, &s);
            gains[M - 1] = gains[0];
            for (j = 0; j < M * M; j++)
                Pi[j] = (1 + more) / (jl_real)M;
            assert_int_equal(jl_cgimm_init(&cg, M, gains, 1, 1, 2500, Pi, mem,
                                           CAP), JL_OK);
            for (k = 0; k < 1000000; k++)
                assert_int_equal(jl_cgimm_step(&cg, i % 2 == 0 ? NULL : &z),
                                 JL_OK);
            for (j = 0, sum = 0; j < M; j++)
                sum += cg.weight[j];
            assert_in_range((int)(1024 * sum), 1, 2048);
        }
}

/* --- memory and refusals ------------------------------------------------- */

#define NAN_ ((jl_real)NAN)

/* As much as the header says, and nothing beside it. */
static void test_cgimm_keeps_to_its_memory(void **state)
{
    static jl_real mem[CAP + 2], all_nan[CAP + 2];
    jl_cg_gains gains[MODES];
    struct setting s = { 0, 0, { 2, 3, 2, 3, 3 }, 1, 50, NULL, NULL };
    jl_real Pi[MODES * MODES], z[AXES], x[MODES * AXES * 3] = { 0 };
    jl_cgimm cg, before;
    int c, i, k;

    (void)state;
    memset(&before, 3, sizeof before);
    for (c = 0; c < CHAINS; c++)
        for (s.axes = 1; s.axes <= AXES; s.axes++) {
            int cap = JL_CGIMM_STATE(chains[c].M, s.axes);

            s.M = chains[c].M;
            make_gains(gains, &s);
            for (i = 0; i < s.M * s.M; i++)
                Pi[i] = (jl_real)chains[c].Pi[i];
            for (i = 0; i < CAP + 2; i++)
                mem[i] = all_nan[i] = NAN_;
            cg = before;
            assert_int_equal(jl_cgimm_init(&cg, s.M, gains, s.axes, 1, 2500, Pi,
                                           mem + 1, cap - 1), JL_ENOMEM);
            assert_same_bits(&cg, &before, sizeof cg);
            assert_same_bits(mem, all_nan, sizeof mem);
            assert_int_equal(jl_cgimm_init(&cg, s.M, gains, s.axes, 1, 2500, Pi,
                                           mem + 1, cap), JL_OK);
            assert_int_equal(jl_cgimm_set(&cg, x, NULL), JL_OK);
            for (k = 0; k < 40; k++)
                assert_int_equal(jl_cgimm_step(&cg, measured(z, &s, k)), JL_OK);
            assert_same_bits(mem, all_nan, sizeof *mem);
            assert_same_bits(mem + 1 + cap, all_nan,
                             (size_t)(CAP + 1 - cap) * sizeof *mem);
            for (i = 0; i < cap; i++)
                assert_true(isfinite((double)mem[1 + i]));
        }
}

static void test_cgimm_init_refuses(void **state)
{
    static jl_real mem[CAP], same[CAP];
    const struct setting s = { 2, 1, { 2, 3 }, 1, 50, two, NULL };
    jl_cg_gains good[2], bad[2];
    jl_real Pi[4] = { JL_C(0.5), JL_C(0.5), JL_C(0.25), JL_C(0.75) };
    const jl_real uneven_rows[4] = { JL_C(0.5), JL_C(0.25), 0, 1 };
    const jl_real below[4] = { JL_C(1.5), JL_C(-0.5), 0, 1 };
    jl_cgimm cg, before;
    int i;

    (void)state;
    make_gains(good, &s);
    memset(&cg, 3, sizeof cg);
    before = cg;
    for (i = 0; i < CAP; i++)
        mem[i] = same[i] = NAN_;
#define REFUSED(code, M, gains, axes, T, R, Pi) \
    do { \
        assert_int_equal(jl_cgimm_init(&cg, M, gains, axes, T, R, Pi, mem, \
                                       CAP), code); \
        assert_same_bits(&cg, &before, sizeof cg); \
        assert_same_bits(mem, same, sizeof mem); \
    } while (0)
#define REFUSED_GAINS(code, change) \
    do { \
        memcpy(bad, good, sizeof bad); \
        change; \
        REFUSED(code, 2, bad, 1, 1, 1, Pi); \
    } while (0)
    REFUSED(JL_EDIM, 0, good, 1, 1, 1, Pi);
    REFUSED(JL_EDIM, JL_MAX_MODES + 1, good, 1, 1, 1, Pi);
    REFUSED(JL_EDIM, 2, good, 0, 1, 1, Pi);
    REFUSED(JL_EDIM, 2, good, 65, 1, 1, Pi);
    REFUSED(JL_ERANGE, 2, good, 1, 0, 1, Pi);
    REFUSED(JL_ERANGE, 2, good, 1, -1, 1, Pi);
    REFUSED(JL_ERANGE, 2, good, 1, 1, 0, Pi);
    REFUSED(JL_ERANGE, 2, good, 1, 1, -1, Pi);
    REFUSED(JL_ENONFINITE, 2, good, 1, NAN_, 1, Pi);
    REFUSED(JL_ENONFINITE, 2, good, 1, 1, (jl_real)INFINITY, Pi);
    REFUSED(JL_EPROB, 2, good, 1, 1, 1, uneven_rows);
    REFUSED(JL_EPROB, 2, good, 1, 1, 1, below);
    REFUSED_GAINS(JL_EDIM, bad[0].order = 1);
    REFUSED_GAINS(JL_EDIM, bad[1].order = 4);
    REFUSED_GAINS(JL_ERANGE, bad[0].steady[0] = 1);
    REFUSED_GAINS(JL_ERANGE, bad[0].steady[0] = 0);
    REFUSED_GAINS(JL_ERANGE, bad[1].steady[0] = JL_C(-0.1));
    REFUSED_GAINS(JL_ERANGE, bad[0].steady[0] = 1 - JL_EPSILON);
    REFUSED_GAINS(JL_ERANGE, (bad[0].steady[0] = 1 - 8 * JL_EPSILON,
                              bad[0].k[0] = 100));      /* alpha stays 1 */
    REFUSED_GAINS(JL_ERANGE, bad[0].steady[1] = 4);
    REFUSED_GAINS(JL_ERANGE, bad[0].steady[1] = 0);
    REFUSED_GAINS(JL_ERANGE, bad[1].steady[2] = 2);
    REFUSED_GAINS(JL_ERANGE, bad[1].steady[2] = 0);
    REFUSED_GAINS(JL_ERANGE, bad[0].start[0] = JL_C(1.5));
    REFUSED_GAINS(JL_ERANGE, bad[0].start[0] = 0);
    REFUSED_GAINS(JL_ERANGE, bad[1].start[1] = -1);
    REFUSED_GAINS(JL_ERANGE, bad[1].k[2] = -1);
    REFUSED_GAINS(JL_ERANGE, bad[1].k[0] = JL_C(1.0e7));
    REFUSED_GAINS(JL_ENONFINITE, bad[0].steady[0] = NAN_);
    REFUSED_GAINS(JL_ENONFINITE, bad[1].start[2] = NAN_);
    REFUSED_GAINS(JL_ENONFINITE, bad[0].k[1] = (jl_real)INFINITY);
#undef REFUSED
#undef REFUSED_GAINS
    assert_int_equal(jl_cgimm_init(&cg, 2, good, 1, 1, 1, Pi, mem, CAP), JL_OK);
}

static void check_untouched(const struct rig *before)
{
    assert_same_bits(&rig.cg, &before->cg, sizeof rig.cg);
    assert_same_bits(rig.mem, before->mem, sizeof rig.mem);
}

static void test_cgimm_refuses_what_is_not_finite(void **state)
{
    static struct rig before;
    const struct setting s = { 2, 2, { 2, 3 }, 1, 50, two, NULL };
    const jl_real bad[] = { NAN_, (jl_real)INFINITY, -(jl_real)INFINITY,
                            JL_LARGE * 2 };
    jl_real z[AXES], x[12] = { 0 };
    const jl_real short_mu[2] = { JL_C(0.5), JL_C(0.25) };
    const jl_real low_mu[2] = { JL_C(1.5), JL_C(-0.5) };
    int i, at;

    (void)state;
    open_rig(&rig, &s);
    assert_int_equal(jl_cgimm_step(&rig.cg, measured(z, &s, 0)), JL_OK);
    before = rig;
    for (i = 0; i < 4; i++) {
        for (at = 0; at < 2; at++) {
            (void)measured(z, &s, 1);
            z[at] = bad[i];
            assert_int_equal(jl_cgimm_step(&rig.cg, z), JL_ENONFINITE);
            check_untouched(&before);
        }
        for (at = 0; at < 12; at += 11) {
            x[at] = bad[i];
            assert_int_equal(jl_cgimm_set(&rig.cg, x, NULL), JL_ENONFINITE);
            check_untouched(&before);
            x[at] = 0;
        }
    }
    rig.cg.T = 8;               /* fits as it is given, not times T^2 / 2 */
    before = rig;
    x[11] = JL_LARGE / 8;
    assert_int_equal(jl_cgimm_set(&rig.cg, x, NULL), JL_ENONFINITE);
    check_untouched(&before);
    x[11] = 0;
    assert_int_equal(jl_cgimm_set(&rig.cg, x, short_mu), JL_EPROB);
    check_untouched(&before);
    assert_int_equal(jl_cgimm_set(&rig.cg, x, low_mu), JL_EPROB);
    check_untouched(&before);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cgimm_meets_textbook),
        cmocka_unit_test(test_cgimm_takes_any_period),
        cmocka_unit_test(test_cgimm_two_modes_are_two_of_three),
        cmocka_unit_test(test_cgimm_step_is_its_stages),
        cmocka_unit_test(test_cgimm_survives_outliers),
        cmocka_unit_test(test_cgimm_tells_that_it_diverges),
        cmocka_unit_test(test_cgimm_survives_the_least_probabilities),
        cmocka_unit_test(test_cgimm_weights_keep_their_sum),
        cmocka_unit_test(test_cgimm_keeps_to_its_memory),
        cmocka_unit_test(test_cgimm_init_refuses),
        cmocka_unit_test(test_cgimm_refuses_what_is_not_finite),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
