/* The adaptive alpha-beta filter: the textbook's lag, the level it is at, and
 * what it refuses. */
#include "close.h"

#include "jumplink/cgimm.h"

#define SMALL (JL_REAL_FLOAT ? 1e-4 : 1e-10)

static const jl_real low[2] = { JL_C(0.36), JL_C(0.08) };
static const jl_real high[2] = { JL_C(0.67), JL_C(0.36) };

enum { AXES = 2 };

static jl_real mem[JL_CG_ADAPTIVE_STATE(AXES)];

/* T = 2, R = 100; the low level's S is 156.25. */
static void start(jl_cg_adaptive *f, jl_real c, jl_real up, jl_real down)
{
    assert_int_equal(jl_cg_adaptive_init(f, AXES, 2, 100, low, high, c, up,
                                         down, mem,
                                         JL_CG_ADAPTIVE_STATE(AXES)), JL_OK);
}

/* Without noise and at a level that stays, an acceleration's lag is that of the
 * textbook. */
static void check_lag(int level)
{
    const jl_real *w = level ? high : low;
    double alpha = (double)w[0], beta = (double)w[1], T = 2, a = 3, t = 0;
    jl_cg_adaptive f;
    jl_real z[AXES] = { 0, 0 };
    int k;

    /* The low one is reached by a step without anything to see. */
    start(&f, 1, level ? JL_C(0.0) : JL_LARGE, level ? 0 : JL_LARGE);
    for (k = 0; k < 200; k++) {
        t = T * k;
        z[0] = (jl_real)(a * t * t / 2);
        z[1] = -z[0];
        assert_int_equal(jl_cg_adaptive_step(&f, z), JL_OK);
        assert_int_equal(f.level, level);
    }
    assert_close(a * t * t / 2 - (double)f.x[0], (1 - alpha) * a * T * T / beta,
                 SMALL * a * t * t);
    assert_close(a * t - (double)f.x[1], a * T * (2 * alpha - beta) / (2 * beta),
                 SMALL * a * t);
    assert_close(f.x[2], -f.x[0], 0);
    assert_close(f.x[3], -f.x[1], 0);
}

static void test_cg_adaptive_lags_behind_an_acceleration(void **state)
{
    (void)state;
    check_lag(0);
    check_lag(1);
}

/* By hand: c = 0.5, so d = s^2 3 / S on one axis. */
static void test_cg_adaptive_changes_levels(void **state)
{
    jl_cg_adaptive f;
    jl_real z[AXES] = { 0, 0 };
    double s, x, v;

    (void)state;
    start(&f, JL_C(0.5), 9, 1);
    assert_int_equal(f.level, 1);
    assert_int_equal(jl_cg_adaptive_step(&f, z), JL_OK);
    assert_int_equal(f.level, 0);                       /* d = 0 */
    z[0] = 43;                                          /* d = 8.8752 */
    assert_int_equal(jl_cg_adaptive_step(&f, z), JL_OK);
    assert_int_equal(f.level, 0);
    s = 21.5;
    x = 43 * 0.36;
    v = 43 * 0.04;
    assert_close(f.s[0], s, SMALL);
    assert_close(f.x[0], x, SMALL);
    assert_close(f.x[1], v, SMALL);
    x += 2 * v;
    z[0] = (jl_real)(x + 22.0);                         /* s 21.75, d 9.0828 */
    assert_int_equal(jl_cg_adaptive_step(&f, z), JL_OK);
    assert_int_equal(f.level, 1);
    assert_close(f.x[0], x + 0.67 * 22, SMALL);         /* at once */
    assert_close(f.x[1], v + 0.18 * 22, SMALL);
    x += 0.67 * 22;
    v += 0.18 * 22;
    x += 2 * v;
    z[0] = (jl_real)(x - 7.0);                          /* s 7.375, d .5385 */
    z[1] = 14;                                          /* s 7, d .4851 */
    assert_int_equal(jl_cg_adaptive_step(&f, z), JL_OK);
    assert_int_equal(f.level, 1);                       /* 1.0236 */
    assert_int_equal(jl_cg_adaptive_step(&f, NULL), JL_OK);
    assert_int_equal(f.level, 1);
    assert_close(f.s[0], 7.375, SMALL);
    z[0] = f.x[0] + 2 * f.x[1];
    z[1] = f.x[2] + 2 * f.x[3];
    assert_int_equal(jl_cg_adaptive_step(&f, z), JL_OK);
    assert_int_equal(f.level, 0);
}

static void test_cg_adaptive_set_and_lost(void **state)
{
    static const jl_real x[2 * AXES] = { 1, 2, -3, 4 };
    static const jl_real bad[2 * AXES] = { 1, 2, -3, 2 * JL_LARGE };
    jl_real z[AXES] = { 0, 0 };
    jl_cg_adaptive f;

    (void)state;
    start(&f, JL_C(0.5), 9, 1);
    assert_int_equal(jl_cg_adaptive_step(&f, z), JL_OK);
    assert_int_equal(jl_cg_adaptive_set(&f, x), JL_OK);
    assert_int_equal(f.level, 1);
    assert_int_equal(jl_cg_adaptive_step(&f, NULL), JL_OK);
    assert_close(f.x[0], 5, 0);
    assert_close(f.x[1], 2, 0);
    assert_close(f.x[2], 5, 0);
    assert_int_equal(jl_cg_adaptive_set(&f, bad), JL_ENONFINITE);
    z[1] = bad[3];
    assert_int_equal(jl_cg_adaptive_step(&f, z), JL_ENONFINITE);
    z[1] = JL_REAL_MAX;
    z[1] = z[1] * 2 - z[1] * 2;                         /* NaN */
    assert_int_equal(jl_cg_adaptive_step(&f, z), JL_ENONFINITE);
    assert_close(f.x[0], 5, 0);
    assert_close(f.x[2], 5, 0);
    assert_close(f.s[0], 0, 0);
}

static void test_cg_adaptive_refuses(void **state)
{
    static const jl_real at_one[2] = { 1, 1 }, wild[2] = { JL_C(0.5), 3 };
    const int cap = JL_CG_ADAPTIVE_STATE(AXES);
    jl_cg_adaptive f, before;

    (void)state;
    memset(&f, 7, sizeof f);
    before = f;
#define refused(code, axes, T, R, a, b, c, up, down, cap) \
    assert_int_equal(jl_cg_adaptive_init(&f, axes, T, R, a, b, c, up, down, \
                                         mem, cap), code)
    refused(JL_EDIM, 0, 1, 1, low, high, 1, 9, 1, cap);
    refused(JL_EDIM, JL_MAX_STATES + 1, 1, 1, low, high, 1, 9, 1, cap);
    refused(JL_ENOMEM, AXES, 1, 1, low, high, 1, 9, 1, cap - 1);
    refused(JL_ERANGE, AXES, 0, 1, low, high, 1, 9, 1, cap);
    refused(JL_ERANGE, AXES, 1, 0, low, high, 1, 9, 1, cap);
    refused(JL_ERANGE, AXES, 1, -1, low, high, 1, 9, 1, cap);
    refused(JL_ERANGE, AXES, 1, 1, at_one, high, 1, 9, 1, cap);
    refused(JL_ERANGE, AXES, 1, 1, low, wild, 1, 9, 1, cap);
    refused(JL_ERANGE, AXES, 1, 1, low, high, 0, 9, 1, cap);
    refused(JL_ERANGE, AXES, 1, 1, low, high, JL_C(1.5), 9, 1, cap);
    refused(JL_ERANGE, AXES, 1, 1, low, high, 1, 1, 9, cap);
    refused(JL_ERANGE, AXES, 1, 1, low, high, 1, 9, -1, cap);
#undef refused
    assert_same_bits(&f, &before, sizeof f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cg_adaptive_lags_behind_an_acceleration),
        cmocka_unit_test(test_cg_adaptive_changes_levels),
        cmocka_unit_test(test_cg_adaptive_set_and_lost),
        cmocka_unit_test(test_cg_adaptive_refuses),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
