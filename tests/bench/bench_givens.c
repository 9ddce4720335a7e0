/* What a triangle costs: jl_mat_givens beside Eigen's and LAPACK's Householder
 * reflections, on the same arrays, compiled for this machine.  Before they are
 * timed all must agree.  Writes givens.csv. */
#include "givens.h"

#include <math.h>
#include <string.h>

#include "bench.h"
#include "clock.h"
#include "jumplink.h"
#include "progress.h"

#define ARRAYS 16
#define ROUNDS 20000
#define ROWS 9
#define MOST 9

static jl_givens *fixed_9_6, *fixed_9_9;

static void jumplink(jl_real *R, const jl_real *A, jl_givens *givens, int cols)
{
    jl_real a[ROWS * MOST];

    memcpy(a, A, (size_t)(ROWS * cols) * sizeof *a);
    givens(a, ROWS, cols);
    memcpy(R, a, (size_t)(cols * cols) * sizeof *a);
}

static void fixed_6(jl_real *R, const jl_real *A)
{
    jumplink(R, A, fixed_9_6, 6);
}

static void fixed_9(jl_real *R, const jl_real *A)
{
    jumplink(R, A, fixed_9_9, 9);
}

static void any_6(jl_real *R, const jl_real *A)
{
    jumplink(R, A, jl_mat_givens, 6);
}

static void any_9(jl_real *R, const jl_real *A)
{
    jumplink(R, A, jl_mat_givens, 9);
}

enum { SIZES = 2, WHO = 4 };

static const int cols[SIZES] = { 6, 9 };

static const struct {
    const char *name;
    givens_triangle *triangle[SIZES];
} who[WHO] = {
    { "Eigen HouseholderQR", { givens_eigen_9_6, givens_eigen_9_9 } },
    { "LAPACK dgeqrf", { givens_lapack_9_6, givens_lapack_9_9 } },
    { "jumplink, fixed size", { fixed_6, fixed_9 } },
    { "jumplink, any size", { any_6, any_9 } }
};

static struct samples ns[SIZES][WHO];
static jl_real A[ARRAYS][ROWS * MOST];

static void draw(void)
{
    unsigned r = 1;
    int i, k;

    for (i = 0; i < ARRAYS; i++)
        for (k = 0; k < ROWS * MOST; k++) {
            r = r * 1664525u + 1013904223u;
            A[i][k] = (jl_real)(r >> 8) / (1 << 23) - 1;
        }
}

/* Rows of R up to their signs. */
static void check(int size)
{
    int i, w, a, b, n = cols[size];

    for (i = 0; i < ARRAYS; i++)
        for (w = 0; w < WHO - 1; w++) {
            jl_real ours[MOST * MOST], R[MOST * MOST];

            who[WHO - 1].triangle[size](ours, A[i]);
            who[w].triangle[size](R, A[i]);
            for (a = 0; a < n; a++)
                for (b = a; b < n; b++) {
                    jl_real sign = R[a * n + a] < 0 ? -1 : 1;

                    bench_must(fabs(ours[a * n + b] - sign * R[a * n + b])
                               < 1e-12, who[w].name);
                }
        }
}

static volatile jl_real sink;

static void sample(int size, int w)
{
    jl_real R[MOST * MOST], sum = 0;
    double from = clock_us();
    int i;

    for (i = 0; i < ARRAYS; i++) {
        who[w].triangle[size](R, A[i]);
        sum += R[0] + R[cols[size] * cols[size] - 1];
    }
    samples_add(&ns[size][w], (clock_us() - from) * 1000 / ARRAYS);
    sink = sum;
}

int main(int argc, char **argv)
{
    struct out_file csv;
    int round, size, w;

    fixed_9_6 = jl_mat_givens_fixed(9, 6);
    fixed_9_9 = jl_mat_givens_fixed(9, 9);
    bench_must(fixed_9_6 != jl_mat_givens && fixed_9_9 != jl_mat_givens,
               "code of fixed size");
    draw();
    for (size = 0; size < SIZES; size++)
        check(size);
    progress_begin("time per triangle");
    for (round = 0; round < ROUNDS; round++) {
        for (size = 0; size < SIZES; size++)
            for (w = 0; w < WHO; w++)
                sample(size, w);
        progress(round + 1, ROUNDS);
    }
    progress_begin(NULL);
    bench_open(&csv, argc, argv, "givens.csv");
    printf("A triangle, ns, and in units of Eigen's:\n%-6s %-20s %8s %6s %8s "
           "%6s\n", "array", "by", "least", "", "median", "");
    fprintf(csv.stream, "rows,cols,by,least_ns,median_ns,least_ratio,"
            "median_ratio\n");
    for (size = 0; size < SIZES; size++)
        for (w = 0; w < WHO; w++) {
            double least = samples_least(&ns[size][w]);
            double median = samples_median(&ns[size][w]);
            double least_ratio = least / samples_least(&ns[size][0]);
            double median_ratio = median / samples_median(&ns[size][0]);

            printf("%d x %-2d %-20s %8.1f %6.2f %8.1f %6.2f\n", ROWS,
                   cols[size], who[w].name, least, least_ratio, median,
                   median_ratio);
            fprintf(csv.stream, "%d,%d,\"%s\",%.2f,%.2f,%.3f,%.3f\n", ROWS,
                    cols[size], who[w].name, least, median, least_ratio,
                    median_ratio);
        }
    bench_close(&csv);
    return 0;
}
