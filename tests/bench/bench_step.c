/* What a step of the parallel IMM costs on 1, 2 and 4 PEs, beside the serial
 * step.  Writes steps.csv. */
#include "bench_filter.h"

#define ROUNDS 5

static const int sizes[] = { 8, 12, 48 }, pes[] = { 1, 2, 4 };
#define SIZES 3
#define WAYS 7                          /* serial, threads, LCM */

/* [served, kind, size, way] */
static struct bench_case cases[2 * BENCH_KINDS * SIZES * WAYS];

static struct bench_case *row_of(int served, int kind, int size)
{
    return cases + ((served * BENCH_KINDS + kind) * SIZES + size) * WAYS;
}

static void fill(int has_lcm)
{
    int served, kind, size, way;

    for (served = 0; served < 2; served++)
        for (kind = 0; kind < BENCH_KINDS; kind++)
            for (size = 0; size < SIZES; size++)
                for (way = 0; way < (has_lcm ? WAYS : 4); way++) {
                    struct bench_case *c = row_of(served, kind, size) + way;

                    c->kind = (enum bench_kind)kind;
                    c->M = sizes[size];
                    c->pes = way == 0 ? 0 : pes[(way - 1) % 3];
                    c->port = way <= 3 ? ON_THREADS : ON_LCM;
                    c->served = served;
                }
}

static void print_row(struct bench_case *row,
                      double (*figure)(struct samples *s), const char *name)
{
    int way;

    printf("%-8s %5d %-6s", bench_kind_names[row->kind], row->M, name);
    for (way = 0; way < WAYS; way++)
        if (row[way].step.count > 0)
            printf(" %8.1f", figure(&row[way].step));
        else
            printf(" %8s", "-");
    putchar('\n');
}

static void print_table(int served)
{
    int kind, size;

    printf("%s, us:\n%-21s %8s %8s %8s %8s %8s %8s %8s\n", served
           ? "From a host's measurement to its estimate"
           : "A step whose measurement is on every PE", "", "", "threads", "",
           "", "LCM", "", "");
    printf("%-8s %5s %6s %8s %8s %8s %8s %8s %8s %8s\n", "chain", "modes", "",
           "serial", "1 PE", "2 PEs", "4 PEs", "1 PE", "2 PEs", "4 PEs");
    for (kind = 0; kind < BENCH_KINDS; kind++)
        for (size = 0; size < SIZES; size++) {
            print_row(row_of(served, kind, size), samples_least, "least");
            print_row(row_of(served, kind, size), samples_median, "median");
        }
}

static void write_csv(FILE *csv)
{
    size_t i;

    fprintf(csv, "served,chain,modes,port,pes,least_us,median_us\n");
    for (i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct bench_case *c = &cases[i];

        if (c->step.count > 0)
            fprintf(csv, "%d,%s,%d,%s,%d,%.2f,%.2f\n", c->served,
                    bench_kind_names[c->kind], c->M, c->pes == 0 ? "serial"
                    : bench_port_names[c->port], c->pes,
                    samples_least(&c->step), samples_median(&c->step));
    }
}

int main(int argc, char **argv)
{
    int has_lcm = bench_network();
    struct out_file csv;

    fill(has_lcm);
    bench_rounds(cases, (int)(sizeof cases / sizeof *cases), ROUNDS,
                 "time per step");
    print_table(0);
    print_table(1);
    bench_open(&csv, argc, argv, "steps.csv");
    write_csv(csv.stream);
    bench_close(&csv);
    return 0;
}
