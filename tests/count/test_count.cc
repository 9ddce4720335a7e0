// How many operations a step takes, counted by the library's own sources, which
// are compiled with a jl_real that counts (counted.hh): two modes, one axis.
//
// Not counted: exp and log, comparisons, signs, copies, the unscaling of an
// estimate that is asked for (jl_cgimm_estimate), and in the limit, but not in
// the table, the two additions that only the log-likelihood needs.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
extern "C" {
#include <cmocka.h>
}

#include "jumplink.h"
#include "manoeuvre.h"

struct count counted;

// What base has and nobody counts.
extern "C" {
jl_real jl_exp(jl_real x) { counted.exps++; return exp(x.v); }
jl_real jl_log(jl_real x) { counted.logs++; return log(x.v); }
int jl_sincos(jl_real *s, jl_real *c, jl_real x)
{
    *s = sin(x.v);
    *c = cos(x.v);
    return JL_OK;
}
jl_real jl_atan2(jl_real y, jl_real x) { return atan2(y.v, x.v); }
}

namespace {

enum { MIX, FILTER, WEIGH, COMBINE, STAGES };

struct step {
    struct count stage[STAGES], whole;
};

struct count taken(struct count *since)
{
    struct count now = counted, is = { now.products - since->products,
                                       now.sums - since->sums,
                                       now.exps - since->exps,
                                       now.logs - since->logs };
    *since = now;
    return is;
}

jl_real measured(int k) { return 100.0 * k + 80 * sin(0.7 * k); }

const double start_x[] = { 0, 100, 0, 0, 100, 1 };
const double Pi[] = { 0.98, 0.02, 0.02, 0.98 };

template <int n> const jl_real *reals(jl_real (&to)[n], const double (&from)[n])
{
    for (int i = 0; i < n; i++)
        to[i] = from[i];
    return to;
}

// --- the constant-gain IMM ------------------------------------------------

void open_cgimm(jl_cgimm *cg, jl_cg_gains *gains, jl_real *mem)
{
    jl_real x[6], chain[4];

    assert_int_equal(jl_cg_design(&gains[0], 2, 1, 100, 10000), JL_OK);
    assert_int_equal(jl_cg_design(&gains[1], 3, 1, 4000, 10000), JL_OK);
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < 3; i++)
            gains[j].k[i] = 0;                  // steady
    assert_int_equal(jl_cgimm_init(cg, 2, gains, 1, 1, 10000,
                                   reals(chain, Pi), mem,
                                   JL_CGIMM_STATE(2, 1)), JL_OK);
    assert_int_equal(jl_cgimm_set(cg, reals(x, start_x), NULL), JL_OK);
}

struct step count_cgimm(int k, int by_stage)
{
    static jl_real mem[JL_CGIMM_STATE(2, 1)];
    jl_cg_gains gains[2];
    jl_cgimm cg;
    struct step s = {};
    jl_real z;

    open_cgimm(&cg, gains, mem);
    for (int i = 0; i < k; i++) {
        z = measured(i);
        assert_int_equal(jl_cgimm_step(&cg, &z), JL_OK);
    }
    z = measured(k);
    struct count since = counted;
    if (by_stage) {
        jl_cgimm_foresee(&cg);
        jl_cgimm_mix_mode(&cg, 0);
        jl_cgimm_mix_mode(&cg, 1);
        s.stage[MIX] = taken(&since);
        jl_cgimm_filter_mode(&cg, 0, &z);
        jl_cgimm_filter_mode(&cg, 1, &z);
        s.stage[FILTER] = taken(&since);
        assert_int_equal(jl_cgimm_weigh(&cg, &z), JL_OK);
        s.stage[WEIGH] = taken(&since);
        jl_cgimm_combine(&cg);
        s.stage[COMBINE] = taken(&since);
    } else {
        assert_int_equal(jl_cgimm_step(&cg, &z), JL_OK);
        s.whole = taken(&since);
    }
    return s;
}

// --- the IMM --------------------------------------------------------------

struct step count_imm(const jl_kf_form *form)
{
    static jl_real modes_mem[2][JL_MODE_MEM(3, 1, 1)];
    static jl_real mem[JL_IMM_STATE(2, 3, 1)], scratch[JL_IMM_SCRATCH(2, 3, 1)];
    const jl_motion motions[2] = { { JL_MOTION_CV, 1, 3, 10, 0, 100, 0 },
                                   { JL_MOTION_CA, 1, 3, 63, 0, 100, 0 } };
    jl_mode modes[2];
    jl_imm imm;
    struct step s = {};
    jl_real x[6], P[18], mu[2] = { 0.5, 0.5 }, chain[4], z = 0;

    for (int j = 0; j < 2; j++) {
        assert_int_equal(jl_mode_init(&modes[j], 3, 1, 1, modes_mem[j],
                                      JL_MODE_MEM(3, 1, 1)), JL_OK);
        assert_int_equal(jl_mode_motion(&modes[j], &motions[j], 1), JL_OK);
        assert_int_equal(jl_motion_start(x + 3 * j, P + 9 * j, &motions[j], &z,
                                         100, 10), JL_OK);
    }
    assert_int_equal(jl_imm_init(&imm, 2, modes, form, JL_MIX_GENERAL, mem,
                                 JL_IMM_STATE(2, 3, 1)), JL_OK);
    assert_int_equal(jl_imm_chain(&imm, reals(chain, Pi)), JL_OK);
    assert_int_equal(jl_imm_set(&imm, x, P, mu, scratch), JL_OK);
    for (int k = 0; k < 10; k++) {
        z = measured(k);
        assert_int_equal(jl_imm_step(&imm, &z, scratch), JL_OK);
    }
    struct count since = counted;
    assert_int_equal(jl_imm_mix(&imm, scratch), JL_OK);
    s.stage[MIX] = taken(&since);
    assert_int_equal(jl_imm_filter(&imm, &z, scratch), JL_OK);
    s.stage[FILTER] = taken(&since);
    assert_int_equal(jl_imm_weigh(&imm), JL_OK);
    s.stage[WEIGH] = taken(&since);
    jl_imm_combine(&imm);
    s.stage[COMBINE] = taken(&since);
    return s;
}

struct count sum_of(const struct step &s)
{
    struct count sum = {};

    for (const struct count &c : s.stage) {
        sum.products += c.products;
        sum.sums += c.sums;
        sum.exps += c.exps;
        sum.logs += c.logs;
    }
    return sum;
}

// --- tests ----------------------------------------------------------------

void test_count_cgimm_step_is_cheap(void **)
{
    for (int k = 3; k < 400; k++) {             // gains have settled
        const struct count is = count_cgimm(k, 0).whole;

        assert_in_range(is.products, 1, 24);
        assert_in_range(is.sums, 1, 27);
        assert_in_range(is.exps, 0, 1);
        assert_int_equal(is.logs, 0);
    }
}

void test_count_cgimm_stages_are_the_step(void **)
{
    const struct count by_stage = sum_of(count_cgimm(10, 1));
    const struct count is = count_cgimm(10, 0).whole;

    assert_int_equal(by_stage.products, is.products);
    assert_int_equal(by_stage.sums, is.sums);
}

// The table below, and what `jumplink sim --scenario manoeuvre1d` says.
void test_count_table_is_as_told(void **)
{
    static const long told[3][STAGES][2] = {
        { { 11, 8 }, { 7, 9 }, { 3, 4 }, { 3, 6 } },
        { { 74, 80 }, { 180, 164 }, { 7, 9 }, { 30, 39 } },
        { { 74, 80 }, { 294, 242 }, { 7, 9 }, { 30, 39 } }
    };
    const struct step is[] = { count_cgimm(10, 1), count_imm(&jl_kf_standard),
                               count_imm(&jl_kf_joseph) };
    const struct count cg = sum_of(is[0]), imm = sum_of(is[1]);

    for (int k = 0; k < 3; k++)
        for (int i = 0; i < STAGES; i++) {
            assert_int_equal(is[k].stage[i].products, told[k][i][0]);
            assert_int_equal(is[k].stage[i].sums, told[k][i][1]);
        }
    assert_int_equal(cg.products, MAN_CG_PRODUCTS);
    assert_int_equal(cg.sums, MAN_CG_SUMS);
    assert_int_equal(imm.products, MAN_IMM_PRODUCTS);
    assert_int_equal(imm.sums, MAN_IMM_SUMS);
}

// Against a count by hand: 3 x 2 x 2 times 2 x 2 x 3.
void test_count_counts(void **)
{
    jl_real A[6], B[6], C[9];

    for (int i = 0; i < 6; i++)
        A[i] = B[i] = i;
    struct count since = counted;
    jl_mat_mul(C, A, B, 3, 2, 3);
    const struct count is = taken(&since);
    assert_int_equal(is.products, 18);
    assert_in_range(is.sums, 9, 18);            // from 0, or from a product
}

// The paper's table 1, in its words mixing, filtering and output; its total of
// products, 76, is not the sum of its stages.
void print_table()
{
    static const char *const names[] = { "mix", "filter", "weigh", "combine" };
    const struct step cg = count_cgimm(10, 1);
    const struct step general = count_imm(&jl_kf_standard);
    const struct step joseph = count_imm(&jl_kf_joseph);
    const struct count whole = count_cgimm(10, 0).whole;
    const struct count all[] = { sum_of(cg), sum_of(general), sum_of(joseph) };

    printf("Two modes, one axis: multiplications and divisions, additions and "
           "subtractions\n"
           "%-9s %14s %14s %14s | paper: %9s %9s\n", "", "constant-gain",
           "IMM, standard", "IMM, Joseph", "CG-IMM", "IMM");
    static const char *const paper[] = {
        "               16   9    34  18", "               24  29    80  77",
        "  with combine 19   8    19   8", ""
    };
    for (int i = 0; i < STAGES; i++)
        printf("%-9s %9ld %4ld %9ld %4ld %9ld %4ld | %s\n", names[i],
               cg.stage[i].products, cg.stage[i].sums,
               general.stage[i].products, general.stage[i].sums,
               joseph.stage[i].products, joseph.stage[i].sums, paper[i]);
    printf("%-9s %9ld %4ld %9ld %4ld %9ld %4ld |                59  46   133 "
           "103 (printed: 76 46)\n"
           "exp, log  %9ld %4ld %9ld %4ld %9ld %4ld |\n"
           "in one go %9ld %4ld\n", "all", all[0].products, all[0].sums, all[1].products,
           all[1].sums, all[2].products, all[2].sums, all[0].exps,
           all[0].logs, all[1].exps, all[1].logs, all[2].exps, all[2].logs,
           whole.products, whole.sums);
}

} // namespace

int main()
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_count_counts),
        cmocka_unit_test(test_count_cgimm_step_is_cheap),
        cmocka_unit_test(test_count_cgimm_stages_are_the_step),
        cmocka_unit_test(test_count_table_is_as_told),
    };

    print_table();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
