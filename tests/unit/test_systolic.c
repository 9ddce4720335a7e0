/* The systolic array: the filter's estimates, the paper's counts, neighbours
 * only, and what it refuses.  (More estimates: tests/golden.) */
#include "close.h"

#include <stdlib.h>

#include "jumplink/mat.h"
#include "jumplink/systolic.h"

#define MAX 8                           /* n and m, each                    */
#define MAX_R 5
#define STEPS 12

#if JL_REAL_FLOAT
#define SAME 2e-4
#else
#define SAME 1e-13
#endif

/* --- a model of any size ---------------------------------------------------- */

struct odd {
    jl_mekf_model model;
    int constant;                       /* JL_SYSTOLIC_KNOW_* that holds    */
    int fails;                          /* G's code from its call on        */
    int calls;
};

/* A number in [-1, 1) that depends on i, j, k only. */
static jl_real scatter(int i, int j, int k)
{
    uint32_t h = (uint32_t)(i * 73 + j * 1021 + k * 7919 + 17);

    h = (h ^ h >> 7) * 2654435761u;
    h = (h ^ h >> 13) * 2246822519u;
    return (jl_real)(h >> 9) / 4194304 - 1;
}

static jl_real bent(jl_real x)
{
    return x / (1 + x * x);
}

static jl_real slope(jl_real x)         /* of bent */
{
    return (1 - x * x) / ((1 + x * x) * (1 + x * x));
}

static int odd_f(jl_real *f, const jl_real *y, void *context)
{
    const struct odd *odd = context;
    int n = odd->model.n, m = odd->model.m, i, j;
    jl_real by_y = odd->constant & JL_SYSTOLIC_KNOW_F ? 0 : JL_C(0.3);

    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            f[i * n + j] = (i == j ? JL_C(0.7) : 0)
                + scatter(i, j, 1) * (JL_C(0.2) + by_y * bent(y[(i + j) % m]))
                / (jl_real)n;
    return JL_OK;
}

static int odd_df(jl_real *J, const jl_real *x, const jl_real *y, void *context)
{
    const struct odd *odd = context;
    int n = odd->model.n, m = odd->model.m, i, j;
    jl_real by_y = odd->constant & JL_SYSTOLIC_KNOW_F ? 0 : JL_C(0.3);

    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            J[i * m + (i + j) % m] += scatter(i, j, 1) * by_y
                * slope(y[(i + j) % m]) / (jl_real)n * x[j];
    return JL_OK;
}

static int odd_h(jl_real *y_next, const jl_real *x, const jl_real *y,
                 void *context)
{
    const struct odd *odd = context;
    int n = odd->model.n, m = odd->model.m, i;

    for (i = 0; i < m; i++) {
        y_next[i] = JL_C(0.9) * y[i] + JL_C(0.1) * x[i % n];
        if (!(odd->constant & JL_SYSTOLIC_KNOW_F))
            y_next[i] += JL_C(0.2) * bent(x[i % n] * y[(i + 1) % m]);
    }
    return JL_OK;
}

static int odd_dh(jl_real *J, const jl_real *x, const jl_real *y, void *context)
{
    const struct odd *odd = context;
    int n = odd->model.n, m = odd->model.m, i;

    for (i = 0; i < m; i++) {
        jl_real *row = J + i * (n + m), other = y[(i + 1) % m];
        jl_real d = JL_C(0.2) * slope(x[i % n] * other);

        row[n + i] += JL_C(0.9);
        row[i % n] += JL_C(0.1);
        if (!(odd->constant & JL_SYSTOLIC_KNOW_F)) {
            row[i % n] += d * other;
            row[n + (i + 1) % m] += d * x[i % n];
        }
    }
    return JL_OK;
}

static int odd_c(jl_real *c, const jl_real *x, const jl_real *y, void *context)
{
    const struct odd *odd = context;
    int n = odd->model.n, m = odd->model.m, r = odd->model.r, i, j;
    jl_real by = odd->constant & JL_SYSTOLIC_KNOW_C ? 0 : JL_C(0.3);

    for (i = 0; i < r; i++)
        for (j = 0; j < n; j++)
            c[i * n + j] = (i % n == j ? 1 : 0) + JL_C(0.3) * scatter(i, j, 2)
                + by * bent(x[(i + j) % n] + y[i % m]);
    return JL_OK;
}

static int odd_dc(jl_real *J, const jl_real *x, const jl_real *y, void *context)
{
    const struct odd *odd = context;
    int n = odd->model.n, m = odd->model.m, r = odd->model.r, i, j;
    jl_real by = odd->constant & JL_SYSTOLIC_KNOW_C ? 0 : JL_C(0.3);
    jl_real c[MAX_R * MAX];

    odd_c(c, x, y, context);
    for (i = 0; i < r; i++)
        for (j = 0; j < n; j++) {
            jl_real d = by * slope(x[(i + j) % n] + y[i % m]) * x[j];

            J[i * (n + m) + j] += c[i * n + j];
            J[i * (n + m) + (i + j) % n] += d;
            J[i * (n + m) + n + i % m] += d;
        }
    return JL_OK;
}

static int odd_G(jl_real *G1, jl_real *G2, jl_real *G3, const jl_real *x,
                 const jl_real *y, void *context)
{
    struct odd *odd = context;
    int n = odd->model.n, m = odd->model.m, p1 = odd->model.p1;
    int p2 = odd->model.p2, i, j;
    jl_real by = odd->constant & JL_SYSTOLIC_KNOW_G ? 0 : JL_C(0.2);

    if (odd->fails > 0 && ++odd->calls >= odd->fails)
        return JL_ERANGE;
    for (i = 0; i < n; i++)
        for (j = 0; j < p1; j++)
            G1[i * p1 + j] = (i == j ? 1 : 0) + JL_C(0.2) * scatter(i, j, 3)
                + by * bent(x[i % n] + y[j % m]);
    for (i = 0; i < m; i++)
        for (j = 0; j < p1; j++)
            G2[i * p1 + j] = JL_C(0.2) * scatter(i, j, 4) + by * bent(y[i % m]);
    for (i = 0; i < m; i++)
        for (j = 0; j < p2; j++)
            G3[i * p2 + j] = (i == j ? 1 : 0) + JL_C(0.2) * scatter(i, j, 5);
    return JL_OK;
}

static void make(struct odd *odd, int n, int m, int r, int p1, int p2,
                 int constant)
{
    memset(odd, 0, sizeof *odd);
    odd->constant = constant;
    odd->model.n = n;
    odd->model.m = m;
    odd->model.r = r;
    odd->model.p1 = p1;
    odd->model.p2 = p2;
    odd->model.f = odd_f;
    odd->model.h = odd_h;
    odd->model.c = odd_c;
    odd->model.G = odd_G;
    odd->model.df = odd_df;
    odd->model.dh = odd_dh;
    odd->model.dc = odd_dc;
    odd->model.context = odd;
}

/* --- a filter and an array ---------------------------------------------------- */

static jl_mekf filter;
static jl_real filter_mem[JL_MEKF_STATE(MAX, MAX, MAX_R, MAX, MAX)];
static jl_real scratch[JL_MEKF_SCRATCH(MAX, MAX, MAX_R, MAX, MAX)];
static jl_systolic array;
static jl_systolic_cell cells[2 * JL_SYSTOLIC_CELLS(MAX, MAX, MAX_R)];
static jl_real mem[JL_SYSTOLIC_STATE(MAX, MAX, MAX_R, MAX, MAX)];

static void positive(jl_real *A, int n, jl_real scale)
{
    jl_real B[4 * MAX * MAX];
    int i, j, k;

    for (i = 0; i < n * n; i++)
        B[i] = scatter(i, n, 6);
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            jl_real s = i == j ? 1 : 0;

            for (k = 0; k < n; k++)
                s += B[i * n + k] * B[j * n + k];
            A[i * n + j] = A[j * n + i] = scale * s;
        }
}

static int start_array(const jl_systolic_schedule *schedule)
{
    return jl_systolic_init(&array, &filter, schedule, cells,
                            (int)(sizeof cells / sizeof *cells), mem,
                            (int)(sizeof mem / sizeof *mem));
}

static void start(struct odd *odd, jl_mekf_c c)
{
    jl_real Q[4 * MAX * MAX], R[MAX_R * MAX_R], P[4 * MAX * MAX], x[2 * MAX];
    const jl_mekf_model *model = &odd->model;
    int N = model->n + model->m, i;

    positive(Q, model->p1 + model->p2, JL_C(0.01));
    positive(R, model->r, JL_C(0.05));
    positive(P, N, JL_C(0.1));
    for (i = 0; i < N; i++)
        x[i] = scatter(i, 0, 7);
    assert_int_equal(jl_mekf_init(&filter, model, Q, R, filter_mem,
                                  (int)(sizeof filter_mem / sizeof *filter_mem),
                                  scratch), JL_OK);
    assert_int_equal(jl_mekf_set(&filter, x, P, NULL, scratch), JL_OK);
    filter.c = c;
}

static void measure(jl_real *z, int r, int step)
{
    int i;

    for (i = 0; i < r; i++)
        z[i] = scatter(i, step, 8);
}

static double largest(const jl_real *v, int n)
{
    double most = 1e-300;
    int i;

    for (i = 0; i < n; i++)
        most = fmax(most, fabs((double)v[i]));
    return most;
}

static void assert_near(const jl_real *a, const jl_real *b, int n)
{
    double unit = largest(b, n);
    int i;

    for (i = 0; i < n; i++)
        assert_close(a[i], b[i], SAME * unit);
}

/* --- estimates ------------------------------------------------------------------ */

static void assert_same_filter(void)
{
    jl_real P[4 * MAX * MAX], P1[MAX * MAX];
    jl_real want[4 * MAX * MAX], want1[MAX * MAX];
    int n = filter.model->n, N = n + filter.model->m;

    assert_near(array.x, filter.x, N);
    assert_near(array.xhat, filter.xhat, n);
    jl_systolic_cov(&array, P, P1);
    jl_mekf_cov(&filter, want, want1);
    assert_near(P, want, N * N);
    assert_near(P1, want1, n * n);
}

static void compare(struct odd *odd, const jl_systolic_schedule *schedule,
                    jl_mekf_c c)
{
    jl_real z[MAX_R];
    int k;

    start(odd, c);
    assert_int_equal(start_array(schedule), JL_OK);
    assert_same_filter();
    for (k = 1; k <= STEPS; k++) {
        measure(z, odd->model.r, k);
        assert_int_equal(jl_mekf_step(&filter, z, scratch), JL_OK);
        assert_int_equal(jl_systolic_step(&array, z), JL_OK);
        assert_int_equal(array.step, k);
        assert_same_filter();
    }
}

static const jl_systolic_schedule *const schedules[] = {
    &jl_systolic_naive, &jl_systolic_best, &jl_systolic_mixed,
    &jl_systolic_paper
};
enum { NAIVE, BEST, MIXED, PAPER, SCHEDULES };

static const int sizes[][5] = {         /* n m r p1 p2 */
    { 1, 1, 1, 1, 1 }, { 3, 2, 2, 3, 2 }, { 4, 2, 2, 4, 2 }, { 2, 4, 1, 2, 4 },
    { 4, 4, 4, 4, 4 }, { 8, 4, 4, 8, 4 }, { 4, 1, 3, 2, 1 }, { 1, 3, 2, 1, 0 },
    { 2, 1, 5, 1, 1 }, { 1, 1, 4, 3, 3 }, { 8, 1, 1, 1, 1 }, { 1, 8, 1, 2, 8 },
    { 2, 2, 3, 6, 1 }, { 5, 1, 5, 8, 8 }
};
#define SIZES ((int)(sizeof sizes / sizeof *sizes))

static void test_systolic_gives_filters_estimates(void **state)
{
    struct odd odd;
    int i, j, known;

    (void)state;
    for (i = 0; i < SIZES; i++)
        for (j = 0; j < SCHEDULES; j++)
            for (known = 0; known < 8; known++) {
                const int *s = sizes[i];
                jl_systolic_schedule schedule = *schedules[j];
                int c;

                if (j == PAPER && known != 7)
                    continue;           /* everything known ahead           */
                for (c = JL_MEKF_PREV; c <= JL_MEKF_FILT; c++) {
                    make(&odd, s[0], s[1], s[2], s[3], s[4], known);
                    schedule.known = known;
                    compare(&odd, &schedule, (jl_mekf_c)c);
                }
            }
}

/* --- counts --------------------------------------------------------------------- */

/* Ticks of a step, and cell-ticks of work in it, in the steady state. */
static long ticks_of(struct odd *odd, const jl_systolic_schedule *schedule,
                     long *work)
{
    long last = 0, before = 0, period = 0;
    jl_real z[MAX_R];
    int k;

    start(odd, JL_MEKF_PREV);
    assert_int_equal(start_array(schedule), JL_OK);
    for (k = 1; k <= STEPS; k++) {
        long now;

        measure(z, array.r, k);
        assert_int_equal(jl_systolic_step(&array, z), JL_OK);
        now = array.tick - last;
        if (k > STEPS - 4)
            assert_int_equal(now, period);
        period = now;
        last = array.tick;
        *work = JL_SYSTOLIC_WORK(array.count) - before;
        before = JL_SYSTOLIC_WORK(array.count);
    }
    return period;
}

static long count(int n, int m, int r, const jl_systolic_schedule *preset,
                  int known, long *work)
{
    jl_systolic_schedule schedule = *preset;
    struct odd odd;

    make(&odd, n, m, r, n, m, known);
    schedule.known = known;
    return ticks_of(&odd, &schedule, work);
}

static void test_systolic_prints(void **state)
{
    int i;
    (void)state;
    for (i = 0; i < 6; i++) {
        const int *s = sizes[i];
        long w;
        int j;
        print_message("%d %d %d: cells %d", s[0], s[1], s[2], JL_SYSTOLIC_CELLS(s[0], s[1], s[2]));
        print_message(" paper %ld (%d)", count(s[0], s[1], s[2], &jl_systolic_paper, 7, &w), 3*s[0]+3*s[1]+2*s[2]+1);
        print_message(" util %.3f", (double)w / JL_SYSTOLIC_CELLS(s[0], s[1], s[2]) / (3*s[0]+3*s[1]+2*s[2]));
        print_message(" naive %ld (%d)", count(s[0], s[1], s[2], &jl_systolic_naive, 0, &w), 6*s[0]+4*s[1]+4*s[2]-2);
        for (j = BEST; j <= MIXED; j++)
        print_message(" best %ld const %ld", count(s[0], s[1], s[2], schedules[j], 0, &w), count(s[0], s[1], s[2], schedules[j], 6, &w));
        print_message("\n");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_systolic_prints),
        cmocka_unit_test(test_systolic_gives_filters_estimates)
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
