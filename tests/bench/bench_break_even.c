/* From how many modes on do two PEs pay?  A sweep of sizes, the serial step
 * beside steps on two PEs.  Writes break_even.csv. */
#include "bench_filter.h"

#include <string.h>

#define ROUNDS 5

static const int sizes[] = { 2, 4, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192,
                             JL_MAX_MODES };
#define SIZES ((int)(sizeof sizes / sizeof *sizes))

/* Serial first; the others are compared with it. */
static const struct {
    const char *name;
    enum bench_port port;
    int pes, served;
} ways[] = {
    { "serial", ON_LOOP, 0, 0 },
    { "threads", ON_THREADS, 2, 0 },
    { "threads_host", ON_THREADS, 2, 1 },
    { "lcm", ON_LCM, 2, 0 },
    { "lcm_host", ON_LCM, 2, 1 },
};
#define WAYS ((int)(sizeof ways / sizeof *ways))

static struct bench_case cases[BENCH_KINDS][SIZES][WAYS];

static void fill(int has_lcm)
{
    int kind, size, way;

    for (kind = 0; kind < BENCH_KINDS; kind++)
        for (size = 0; size < SIZES; size++)
            for (way = 0; way < WAYS; way++) {
                struct bench_case *c = &cases[kind][size][way];

                c->kind = (enum bench_kind)kind;
                c->M = ways[way].port == ON_LCM && !has_lcm ? 0 : sizes[size];
                c->pes = ways[way].pes;
                c->port = ways[way].port;
                c->served = ways[way].served;
            }
}

/* Of the times of a step. */
typedef double figure(struct samples *s);

/* The index of the least size from which on, up to the greatest, a step on two
 * PEs takes less than the serial one; SIZES: there is none. */
static int pays_from(int kind, int way, figure *of)
{
    int from = SIZES;

    while (from > 0 && of(&cases[kind][from - 1][way].step)
           < of(&cases[kind][from - 1][0].step))
        from--;
    return from;
}

static void print_verdict(int kind, int way, figure *of, const char *name)
{
    int from = pays_from(kind, way, of);

    printf("%-14s %-7s ", ways[way].name, name);
    if (from == SIZES)
        printf("two PEs do not pay up to %d modes\n", sizes[SIZES - 1]);
    else if (from == 0)
        printf("two PEs pay from %d modes\n", sizes[0]);
    else
        printf("two PEs pay from %d modes (not at %d)\n", sizes[from],
               sizes[from - 1]);
}

static void print_kind(int kind)
{
    int size, way;

    printf("Chain %s, median of a step, us:\n%5s", bench_kind_names[kind],
           "modes");
    for (way = 0; way < WAYS; way++)
        printf(" %12s", ways[way].name);
    putchar('\n');
    for (size = 0; size < SIZES; size++) {
        printf("%5d", sizes[size]);
        for (way = 0; way < WAYS; way++)
            if (cases[kind][size][way].M > 0)
                printf(" %12.1f",
                       samples_median(&cases[kind][size][way].step));
            else
                printf(" %12s", "-");
        putchar('\n');
    }
    for (way = 1; way < WAYS; way++)
        if (cases[kind][0][way].M > 0) {
            print_verdict(kind, way, samples_least, "least:");
            print_verdict(kind, way, samples_median, "median:");
        }
}

/* A column a way, so that a plot finds them by name. */
static void write_csv(FILE *csv)
{
    int kind, size, way;

    fprintf(csv, "chain,modes");
    for (way = 0; way < WAYS; way++)
        fprintf(csv, ",%s_least_us,%s_median_us", ways[way].name,
                ways[way].name);
    putc('\n', csv);
    for (kind = 0; kind < BENCH_KINDS; kind++)
        for (size = 0; size < SIZES; size++) {
            fprintf(csv, "%s,%d", bench_kind_names[kind], sizes[size]);
            for (way = 0; way < WAYS; way++) {
                struct samples *s = &cases[kind][size][way].step;

                if (s->count > 0)
                    fprintf(csv, ",%.2f,%.2f", samples_least(s),
                            samples_median(s));
                else
                    fprintf(csv, ",,");
            }
            putc('\n', csv);
        }
}

int main(int argc, char **argv)
{
    int has_lcm = bench_network(), kind;
    struct out_file csv;

    fill(has_lcm);
    bench_rounds(&cases[0][0][0], BENCH_KINDS * SIZES * WAYS, ROUNDS,
                 "break-even");
    for (kind = 0; kind < BENCH_KINDS; kind++)
        print_kind(kind);
    bench_open(&csv, argc, argv, "break_even.csv");
    write_csv(csv.stream);
    bench_close(&csv);
    return 0;
}
