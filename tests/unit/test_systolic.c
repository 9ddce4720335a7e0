/* The systolic array: the filter's estimates, the paper's counts, neighbours
 * only, and what it refuses.  (More estimates: tests/golden.) */
#include "close.h"

#include <stdlib.h>

#include "jumplink/mat.h"
#include "jumplink/systolic.h"

#define MAX 8                           /* n and m, each                    */
#define MAX_R 9
#define STEPS 12

#if JL_REAL_FLOAT
#define SAME 2e-4
#else
#define SAME 1e-13
#endif

/* --- a model of any size -------------------------------------------------- */

struct odd {
    jl_mekf_model model;
    int constant;                       /* JL_SYSTOLIC_KNOW_* that holds    */
    int fails;                          /* G does                           */
    const jl_real *f_fails;             /* f does, at this y[0]             */
    int f_calls;                        /* ... so many times                */
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
    struct odd *odd = context;
    int n = odd->model.n, m = odd->model.m, i, j;
    jl_real by_y = odd->constant & JL_SYSTOLIC_KNOW_F ? 0 : JL_C(0.3);

    if (odd->f_fails != NULL && fabs((double)(y[0] - *odd->f_fails)) < 1e-5) {
        odd->f_calls++;
        return JL_ETIME;
    }
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
    const struct odd *odd = context;
    int n = odd->model.n, m = odd->model.m, p1 = odd->model.p1;
    int p2 = odd->model.p2, i, j;
    jl_real by = odd->constant & JL_SYSTOLIC_KNOW_G ? 0 : JL_C(0.2);

    if (odd->fails)
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

/* --- a filter and an array ------------------------------------------------ */

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

/* The largest of v, or at least `least`. */
static double largest(const jl_real *v, int n, double least)
{
    double most = least;
    int i;

    for (i = 0; i < n; i++)
        most = fmax(most, fabs((double)v[i]));
    return most;
}

static void assert_near(const jl_real *a, const jl_real *b, int n, double least)
{
    double unit = largest(b, n, least);
    int i;

    for (i = 0; i < n; i++)
        assert_close(a[i], b[i], SAME * unit);
}

/* --- estimates ------------------------------------------------------------ */

static void assert_same_filter(void)
{
    jl_real P[4 * MAX * MAX], P1[MAX * MAX];
    jl_real want[4 * MAX * MAX], want1[MAX * MAX];
    int n = filter.model->n, N = n + filter.model->m;

    assert_near(array.x, filter.x, N, 1);
    assert_near(array.xhat, filter.xhat, n, 1);
    jl_systolic_cov(&array, P, P1);
    jl_mekf_cov(&filter, want, want1);
    assert_near(P, want, N * N, 0);
    assert_near(P1, want1, n * n, 0);
}

static void compare(struct odd *odd, const jl_systolic_schedule *schedule,
                    jl_mekf_c c, int steps)
{
    jl_real z[MAX_R];
    int k;

    start(odd, c);
    assert_int_equal(start_array(schedule), JL_OK);
    assert_same_filter();
    for (k = 1; k <= steps; k++) {
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
    { 2, 2, 3, 6, 1 }, { 5, 1, 5, 8, 8 }, { 1, 2, 7, 4, 4 }
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
                    compare(&odd, &schedule, (jl_mekf_c)c, STEPS);
                }
            }
}

static uint32_t seed;

static int below(int n)
{
    seed = seed * 1664525u + 1013904223u;
    return (int)((seed >> 8) % (uint32_t)n);
}

/* Whatever the sizes and the order: nothing is fed before it is there, and
 * nothing that is still to be fed is overwritten. */
static void test_systolic_any_schedule(void **state)
{
    int i;

    (void)state;
    seed = 1;
    for (i = 0; i < 3000; i++) {
        jl_systolic_schedule s;
        struct odd odd;
        int n = 1 + below(5), m = 1 + below(5), r = 1 + below(MAX_R);
        int p1 = 1 + below(6), p2 = below(6);

        make(&odd, n, m, r, p1, p2, below(8));
        s.known = below(3) > 0 ? odd.constant : odd.constant & below(8);
        s.y_first = below(2);
        s.noise_first = below(2);
        s.inside = below(2);
        s.products = below(3);
        compare(&odd, &s, (jl_mekf_c)below(3), 4);
    }
}

/* --- counts --------------------------------------------------------------- */

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

/* The paper's table of what a step is: cells of each kind times rows. */
static long paper_work(long n, long m, long r)
{
    long N = n + m;

    return (N + r) * (N + r + 1) / 2 * 2 * N + r * (2 * N + r + 1) / 2
        + N * (N + 1) / 2 * (N + r)
        + (n + r) * (n + r + 1) / 2 * 2 * n + r * (2 * n + r + 1) / 2
        + n * (n + 1) / 2 * (2 * r + n) + n * (n + 2 * r);
}

static const int ALL = JL_SYSTOLIC_KNOW_F + JL_SYSTOLIC_KNOW_C
    + JL_SYSTOLIC_KNOW_G;
static const int C_AND_G = JL_SYSTOLIC_KNOW_C + JL_SYSTOLIC_KNOW_G;

static void test_systolic_counts_of_table(void **state)
{
    static const struct row {
        int n, m, r, cells, paper, percent, best, constant, mixed;
    } rows[] = {
        { 1, 1, 1, 11, 8, 57, 8, 8, 8 }, { 3, 2, 2, 47, 19, 63, 20, 18, 20 },
        { 4, 2, 2, 62, 22, 66, 24, 21, 24 },
        { 2, 4, 1, 37, 20, 73, 23, 22, 22 },
        { 4, 4, 4, 119, 32, 58, 35, 31, 34 },
        { 8, 4, 4, 223, 44, 67, 50, 43, 50 }
    };
    int i;

    (void)state;
    for (i = 0; i < (int)(sizeof rows / sizeof *rows); i++) {
        const struct row *w = rows + i;
        int n = w->n, m = w->m, r = w->r;
        long work, steps = JL_SYSTOLIC_PAPER_TICKS(n, m, r);

        assert_int_equal(JL_SYSTOLIC_CELLS(n, m, r), w->cells);
        assert_int_equal(steps, w->paper);
        assert_int_equal(count(n, m, r, &jl_systolic_paper, ALL, &work),
                         steps + 1);
        assert_int_equal(work, paper_work(n, m, r));
        assert_int_equal((200 * work / (w->cells * steps) + 1) / 2, w->percent);
        assert_int_equal(count(n, m, r, &jl_systolic_best, 0, &work), w->best);
        assert_int_equal(work, paper_work(n, m, r));
        assert_int_equal(count(n, m, r, &jl_systolic_best, C_AND_G, &work),
                         w->constant);
        assert_int_equal(count(n, m, r, &jl_systolic_mixed, 0, &work),
                         w->mixed);
    }
}

static int larger(int a, int b)
{
    return a > b ? a : b;
}

static void test_systolic_counts_of_formulas(void **state)
{
    int n, m, r;

    (void)state;
    for (n = 1; n <= 8; n++)
        for (m = 1; m <= 5; m++)
            for (r = 1; r <= 5; r++) {
                int base = larger(1, m - 1) + 3 * n + 3 * m + r;
                long work;

                assert_int_equal(count(n, m, r, &jl_systolic_naive, 0, &work),
                                 6 * n + 4 * m + 4 * r - 2);
                assert_int_equal(work, paper_work(n, m, r));
                if (r <= n + m)
                    assert_int_equal(count(n, m, r, &jl_systolic_paper, ALL,
                                           &work), 3 * n + 3 * m + 2 * r + 1);
                if (r < n + m && n + m + r > 3)
                    assert_int_equal(count(n, m, r, &jl_systolic_best, 0,
                                           &work),
                                     larger(base + r,
                                            4 * n + 3 * m + 2 * r - 2));
                if (r <= n && r <= m && n <= 2 * m)
                    assert_int_equal(count(n, m, r, &jl_systolic_best, C_AND_G,
                                           &work), base);
            }
}

/* --- cells ---------------------------------------------------------------- */

/* What happened, tick by tick: cells of a mode, the left array's first feed
 * since the last estimate, that estimate. */
struct seen {
    long ticks, modes[JL_SYSTOLIC_MODES], first, last, latency;
    int last_column;
};

static void see(const jl_systolic *a, void *context)
{
    struct seen *seen = context;
    int i;

    seen->ticks++;
    assert_int_equal(a->tick, seen->ticks);
    for (i = 0; i < a->cells; i++) {
        const jl_systolic_cell *c = a->cell + i;

        seen->modes[c->mode]++;
        if (c->part != JL_SYSTOLIC_LEFT)
            continue;
        if (c->column == 0 && c->mode == JL_SYSTOLIC_QR
            && seen->first <= seen->last)
            seen->first = a->tick;
        if (c->row == a->r - 1 && c->column == seen->last_column
            && c->mode == JL_SYSTOLIC_FADDEEV) {
            seen->latency = a->tick - seen->first + 1;
            seen->last = a->tick;
        }
    }
}

static void test_systolic_trace_sees_all(void **state)
{
    int i, k;

    (void)state;
    for (i = 0; i < SIZES; i++) {
        const int *s = sizes[i];
        struct seen seen = { 0 };
        struct odd odd;
        jl_real z[MAX_R];

        make(&odd, s[0], s[1], s[2], s[0], s[1], 0);
        start(&odd, JL_MEKF_PREV);
        assert_int_equal(start_array(&jl_systolic_naive), JL_OK);
        array.trace = see;
        array.context = &seen;
        seen.last_column = s[0] + s[1] + s[2] - 1;
        for (k = 0; k < STEPS; k++) {
            measure(z, s[2], k);
            assert_int_equal(jl_systolic_step(&array, z), JL_OK);
            assert_int_equal(seen.last, array.tick);
            assert_int_equal(seen.latency,
                             3 * s[0] + 3 * s[1] + 2 * s[2] - 1);
        }
        assert_int_equal(seen.ticks, array.tick);
        assert_memory_equal(seen.modes, array.count, sizeof seen.modes);
        assert_int_equal(seen.modes[JL_SYSTOLIC_SUBTRACT], 2 * s[2] * STEPS);
    }
}

/* Every order in which a tick visits the cells gives the same bits. */
static void test_systolic_order_of_visits(void **state)
{
    static int visit[JL_SYSTOLIC_CELLS(8, 4, 4)];
    static jl_systolic_cell kept[JL_SYSTOLIC_CELLS(8, 4, 4)];
    jl_real x[2 * MAX], xhat[MAX], z[MAX_R];
    struct odd odd;
    int way, i, k;

    (void)state;
    make(&odd, 8, 4, 4, 8, 4, 0);
    for (way = 0; way < 12; way++) {
        start(&odd, JL_MEKF_PREV);
        assert_int_equal(start_array(&jl_systolic_best), JL_OK);
        for (i = 0; i < array.cells; i++)
            visit[i] = way == 1 ? array.cells - 1 - i : i;
        srand((unsigned)way);
        for (i = array.cells - 1; i > 0 && way > 1; i--) {
            int j = rand() % (i + 1), other = visit[j];

            visit[j] = visit[i];
            visit[i] = other;
        }
        array.visit = way == 0 ? NULL : visit;
        for (k = 0; k < STEPS; k++) {
            measure(z, 4, k);
            assert_int_equal(jl_systolic_step(&array, z), JL_OK);
        }
        if (way == 0) {
            memcpy(x, array.x, 12 * sizeof *x);
            memcpy(xhat, array.xhat, 8 * sizeof *xhat);
            memcpy(kept, array.cell, sizeof kept);
        }
        assert_same_bits(x, array.x, 12 * sizeof *x);
        assert_same_bits(xhat, array.xhat, 8 * sizeof *xhat);
        for (i = 0; i < array.cells; i++) {
            assert_same_bits(&kept[i].r, &array.cell[i].r, sizeof kept[i].r);
            assert_int_equal(kept[i].mode, array.cell[i].mode);
        }
    }
}

/* --- refusals ------------------------------------------------------------- */

static void test_systolic_init_refuses(void **state)
{
    jl_systolic_schedule s = jl_systolic_best;
    jl_systolic before;
    struct odd odd;
    int n_cells = 2 * JL_SYSTOLIC_CELLS(3, 2, 2);
    int n_mem = JL_SYSTOLIC_STATE(3, 2, 2, 2, 1);
    int *const fields[] = { &s.known, &s.y_first, &s.noise_first, &s.inside,
                            &s.products };
    static const int beyond[] = { 8, 2, 2, 2, 3 };
    int i;

    (void)state;
    make(&odd, 3, 2, 2, 2, 1, 0);
    start(&odd, JL_MEKF_PREV);
    memset(&array, 7, sizeof array);
    before = array;
    assert_int_equal(jl_systolic_init(&array, &filter, &s, cells, n_cells - 1,
                                      mem, n_mem), JL_ENOMEM);
    assert_int_equal(jl_systolic_init(&array, &filter, &s, cells, n_cells, mem,
                                      n_mem - 1), JL_ENOMEM);
    filter.spread = 1;
    assert_int_equal(start_array(&s), JL_ERANGE);
    filter.spread = 0;
    for (i = 0; i < 5; i++) {
        s = jl_systolic_best;
        *fields[i] = beyond[i];
        assert_int_equal(start_array(&s), JL_ERANGE);
        *fields[i] = -1;
        assert_int_equal(start_array(&s), JL_ERANGE);
    }
    s = jl_systolic_best;
    s.known = JL_SYSTOLIC_KNOW_G;
    odd.fails = 1;
    assert_int_equal(start_array(&s), JL_ERANGE);       /* G's code          */
    assert_memory_equal(&array, &before, sizeof array);
    odd.fails = 0;
    assert_int_equal(jl_systolic_init(&array, &filter, &s, cells, n_cells, mem,
                                      n_mem), JL_OK);
}

/* No more memory is touched than is asked for. */
static void test_systolic_memory(void **state)
{
    int i, j, k;

    (void)state;
    for (i = 0; i < SIZES; i++) {
        const int *s = sizes[i];
        int n_cells = 2 * JL_SYSTOLIC_CELLS(s[0], s[1], s[2]);
        int n_mem = JL_SYSTOLIC_STATE(s[0], s[1], s[2], s[3], s[4]);
        jl_systolic_cell *c = malloc((size_t)n_cells * sizeof *c);
        jl_real *v = malloc((size_t)(n_mem + 1) * sizeof *v), z[MAX_R];
        struct odd odd;

        assert_true(c != NULL && v != NULL);
        make(&odd, s[0], s[1], s[2], s[3], s[4], 0);
        start(&odd, JL_MEKF_PREV);
        for (j = 0; j <= n_mem; j++)
            v[j] = 12345;
        assert_int_equal(jl_systolic_init(&array, &filter, &jl_systolic_best, c,
                                          n_cells, v, n_mem), JL_OK);
        for (k = 0; k < 3; k++) {
            measure(z, s[2], k);
            assert_int_equal(jl_systolic_step(&array, z), JL_OK);
            jl_systolic_cov(&array, NULL, NULL);
        }
        assert_true(v[n_mem] == 12345);
        assert_true(v[n_mem - 1] != 12345);
        free(c);
        free(v);
    }
}

static void test_systolic_step_undone(void **state)
{
    static jl_systolic_cell kept_cells[JL_SYSTOLIC_CELLS(3, 2, 2)];
    static jl_real kept[JL_SYSTOLIC_STATE(3, 2, 2, 3, 2)];
    jl_real z[MAX_R], odd_z[MAX_R];
    jl_systolic before;
    struct odd odd;
    int j, k;

    (void)state;
    for (j = 0; j < PAPER; j++) {
        make(&odd, 3, 2, 2, 3, 2, 0);
        start(&odd, JL_MEKF_PREV);
        assert_int_equal(start_array(schedules[j]), JL_OK);
        for (k = 1; k <= STEPS; k++) {
            measure(z, 2, k);
            if (k == 6) {
                before = array;
                memcpy(kept_cells, cells, sizeof kept_cells);
                memcpy(kept, mem, (size_t)array.reals * sizeof *kept);
                assert_int_equal(jl_systolic_step(&array, z), JL_ETIME);
                odd.f_fails = NULL;
                odd.fails = 1;
                assert_int_equal(jl_systolic_step(&array, z), JL_ERANGE);
                odd.fails = 0;
                odd_z[0] = z[0];
                odd_z[1] = (jl_real)NAN;
                assert_int_equal(jl_systolic_step(&array, odd_z),
                                 JL_ENONFINITE);
                odd_z[1] = 2 * JL_LARGE;
                assert_int_equal(jl_systolic_step(&array, odd_z),
                                 JL_ENONFINITE);
                assert_int_equal(jl_systolic_step(&array, NULL), JL_ERANGE);
                assert_memory_equal(&before, &array, sizeof array);
                assert_memory_equal(kept_cells, cells, sizeof kept_cells);
                assert_memory_equal(kept, mem,
                                    (size_t)array.reals * sizeof *kept);
            }
            assert_int_equal(jl_mekf_step(&filter, z, scratch), JL_OK);
            if (k == 5)
                odd.f_fails = filter.x + 3;
            /* What fails for the next step does not fail this one. */
            assert_int_equal(jl_systolic_step(&array, z), JL_OK);
            if (k == 5 && j != NAIVE)
                assert_true(odd.f_calls > 0);
            assert_same_filter();
        }
    }
}

/* r > n + m exact measurements: V is singular. */
static void test_systolic_singular(void **state)
{
    jl_real z[MAX_R], *UR;
    struct odd odd;
    int j, i;

    (void)state;
    for (j = 0; j < PAPER; j++) {
        make(&odd, 1, 1, 4, 1, 1, 0);
        start(&odd, JL_MEKF_PREV);
        UR = filter.UR;
        for (i = 0; i < 16; i++)
            UR[i] = 0;
        assert_int_equal(start_array(schedules[j]), JL_OK);
        measure(z, 4, 1);
        assert_int_equal(jl_mekf_step(&filter, z, scratch), JL_ESINGULAR);
        assert_int_equal(jl_systolic_step(&array, z), JL_ESINGULAR);
        assert_same_filter();
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_systolic_gives_filters_estimates),
        cmocka_unit_test(test_systolic_any_schedule),
        cmocka_unit_test(test_systolic_counts_of_table),
        cmocka_unit_test(test_systolic_counts_of_formulas),
        cmocka_unit_test(test_systolic_trace_sees_all),
        cmocka_unit_test(test_systolic_order_of_visits),
        cmocka_unit_test(test_systolic_init_refuses),
        cmocka_unit_test(test_systolic_memory),
        cmocka_unit_test(test_systolic_step_undone),
        cmocka_unit_test(test_systolic_singular)
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
