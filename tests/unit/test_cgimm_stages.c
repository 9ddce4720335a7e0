/* The stages of a step of the constant-gain IMM, and the two ways in which it
 * mixes: differences for two modes, sums for any number. */
#include "close.h"

#include "jumplink.h"

#define MOST 3

static jl_cg_gains gains[MOST];
static jl_real mem[2][JL_CGIMM_STATE(MOST, 2)];

/* Modes of orders 2 and 3; of three, the last is like the second. */
static void start(jl_cgimm *cg, int which, int M, const jl_real *Pi)
{
    int j;

    for (j = 0; j < MOST; j++)
        assert_int_equal(jl_cg_design(&gains[j], j == 0 ? 2 : 3, 1,
                                      j == 0 ? 100 : 4000, 1e4), JL_OK);
    assert_int_equal(jl_cgimm_init(cg, M, gains, 2, 1, 1e4, Pi, mem[which],
                                   JL_CGIMM_STATE(MOST, 2)), JL_OK);
}

static const jl_real two[] = { JL_C(0.98), JL_C(0.02), JL_C(0.04),
                               JL_C(0.96) };

/* z of both axes at step k: a start of 80 m/s^2. */
static void measure(jl_real *z, int k)
{
    z[0] = (jl_real)(450 * k + (k > 10 ? 40 * (k - 10) * (k - 10) : 0)
                     + k * 37 % 101);
    z[1] = (jl_real)(-200 * k + k * 53 % 89);
}

/* A third mode that is never entered, and that nobody comes from, changes
 * nothing but the way of mixing. */
static void test_cgimm_two_modes_are_as_any_number(void **state)
{
    static const jl_real three[] = {
        JL_C(0.98), JL_C(0.02), 0, JL_C(0.04), JL_C(0.96), 0, 0, 0, 1
    };
    static const jl_real mu[] = { JL_C(0.5), JL_C(0.5), 0 };
    jl_cgimm a, b;
    jl_real z[2], x[6], y[6], at[MOST * 6];
    double within;
    int i, k;

    (void)state;
    start(&a, 0, 2, two);
    start(&b, 1, 3, three);
    for (i = 0; i < MOST * 6; i++)
        at[i] = (jl_real)(i % 3 == 1 ? 300 : 20 * i);
    assert_int_equal(jl_cgimm_set(&a, at, mu), JL_OK);
    assert_int_equal(jl_cgimm_set(&b, at, mu), JL_OK);
    for (k = 0; k < 40; k++) {
        measure(z, k);
        assert_int_equal(jl_cgimm_step(&a, k % 9 == 5 ? NULL : z), JL_OK);
        assert_int_equal(jl_cgimm_step(&b, k % 9 == 5 ? NULL : z), JL_OK);
        jl_cgimm_estimate(&a, x);
        jl_cgimm_estimate(&b, y);
        within = 64 * (double)JL_EPSILON * (1e3 + fabs((double)x[0]));
        for (i = 0; i < 6; i++)
            assert_close(x[i], y[i], within);
        for (i = 0; i < 2; i++)
            assert_close(a.mu[i], b.mu[i], within / 100);
        assert_true(b.mu[2] == 0);
        assert_close(jl_cgimm_loglik(&a), jl_cgimm_loglik(&b), within / 10);
    }
}

/* Of either way, the mode that moves at constant velocity has none. */
static void test_cgimm_order_2_takes_no_accelerations(void **state)
{
    static const jl_real three[] = {
        JL_C(0.9), JL_C(0.05), JL_C(0.05), JL_C(0.05), JL_C(0.9), JL_C(0.05),
        JL_C(0.05), JL_C(0.05), JL_C(0.9)
    };
    jl_cgimm cg;
    jl_real z[2], at[MOST * 6];
    int M, k, i;

    (void)state;
    for (M = 2; M <= MOST; M++) {
        start(&cg, 0, M, M == 2 ? two : three);
        for (i = 0; i < MOST * 6; i++)
            at[i] = 50;
        assert_int_equal(jl_cgimm_set(&cg, at, NULL), JL_OK);
        for (k = 0; k < 30; k++) {
            measure(z, k);
            assert_int_equal(jl_cgimm_step(&cg, z), JL_OK);
            assert_true(cg.x[2] == 0 && cg.x[5] == 0);
            assert_true(cg.x[8] != 0 && cg.x[11] != 0);
        }
    }
}

static void test_cgimm_stages_have_an_order(void **state)
{
    static jl_real before[JL_CGIMM_STATE(MOST, 2)];
    jl_cgimm cg, serial;
    jl_real z[2], bad[2] = { 0, JL_REAL_MAX };
    int j, k;

    (void)state;
    start(&cg, 0, 2, two);
    start(&serial, 1, 2, two);
    measure(z, 1);
    assert_int_equal(jl_cgimm_weigh(&cg, z), JL_EORDER);
    assert_int_equal(jl_cgimm_filter_mode(&cg, 0, z), JL_EORDER);
    jl_cgimm_foresee(&cg);
    assert_int_equal(jl_cgimm_weigh(&cg, z), JL_EORDER);
    assert_int_equal(jl_cgimm_filter_mode(&cg, 0, bad), JL_ENONFINITE);
    assert_int_equal(jl_cgimm_weigh(&cg, z), JL_EORDER);
    jl_cgimm_restart(&cg, 0);
    assert_int_equal(jl_cgimm_filter_mode(&cg, 0, z), JL_EORDER);
    for (k = 0; k < 20; k++) {
        const jl_real *given = k % 5 == 3 ? NULL : z;

        measure(z, k);
        assert_int_equal(jl_cgimm_step(&serial, given), JL_OK);
        memcpy(before, cg.x, 12 * sizeof *before);
        memcpy(before + 12, cg.w, 6 * sizeof *before);
        jl_cgimm_foresee(&cg);
        for (j = 1; j >= 0; j--) {
            jl_cgimm_mix_mode(&cg, j);
            assert_int_equal(jl_cgimm_filter_mode(&cg, j, given), JL_OK);
        }
        assert_same_bits(cg.x, before, 12 * sizeof *before);
        assert_same_bits(cg.w, before + 12, 6 * sizeof *before);
        assert_int_equal(jl_cgimm_weigh(&cg, given), JL_OK);
        assert_int_equal(jl_cgimm_weigh(&cg, given), JL_EORDER);
        jl_cgimm_combine(&cg);
        assert_same_bits(cg.x, serial.x, 12 * sizeof *before);
        assert_same_bits(cg.w, serial.w, 6 * sizeof *before);
        assert_same_bits(cg.xhat, serial.xhat, 6 * sizeof *before);
        assert_same_bits(cg.mu, serial.mu, 2 * sizeof *before);
    }
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cgimm_two_modes_are_as_any_number),
        cmocka_unit_test(test_cgimm_order_2_takes_no_accelerations),
        cmocka_unit_test(test_cgimm_stages_have_an_order),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
