/* jumplink systolic: the MEKF on its array of cells, tick by tick: what a step
 * costs, what each cell does when. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "command.h"
#include "interrupt.h"
#include "options.h"
#include "out_file.h"
#include "plot.h"
#include "progress.h"
#include "systolic_run.h"

static const char help[] =
    "usage: jumplink systolic [--n N --m M --r R] [--schedule NAME] [-o DIR]\n"
    "       jumplink systolic [--size N,M,R].. [--schedule NAME] [-o DIR]\n"
    "The modified extended Kalman filter on a systolic array of N states, M\n"
    "parameters, R measurements (default: six sizes): cells, ticks of a step\n"
    "with each schedule, utilisation, how far its estimates are from the\n"
    "filter's; and of the first size (of the default ones, of 3,2,2) what\n"
    "every cell does in every tick.\n\n"
    "  --n N --m M --r R  a size; 1 to 16 each\n"
    "  --size N,M,R      the same; may be given several times\n"
    "  --schedule paper|naive|best|mixed  of what is drawn (default best;\n"
    "                    jumplink/systolic.h)\n"
    "  -o, --out DIR     where results go (default build/systolic):\n"
    "                    counts.csv, activity.csv, activity.png\n"
    HELP_HELP;

#define MOST 16
#define SIZES_MAX 32
#define DRAWN 3                         /* steps, from the third on         */

enum { ALL = JL_SYSTOLIC_KNOW_F + JL_SYSTOLIC_KNOW_C + JL_SYSTOLIC_KNOW_G };

/* The last is `best` of systems whose c and Gamma are constant. */
static const struct {
    const char *name;
    const jl_systolic_schedule *schedule;
    int known;
} ways[] = {
    { "paper", &jl_systolic_paper, ALL },
    { "naive", &jl_systolic_naive, 0 },
    { "best", &jl_systolic_best, 0 },
    { "mixed", &jl_systolic_mixed, 0 },
    { "c_and_gamma_known", &jl_systolic_best,
      JL_SYSTOLIC_KNOW_C + JL_SYSTOLIC_KNOW_G }
};
enum { PAPER, NAIVE, BEST, MIXED, CONSTANT, WAYS };

struct size {
    int n, m, r;
    struct systolic_run run[WAYS];
};

static const struct size default_sizes[] = {
    { .n = 1, .m = 1, .r = 1 }, { .n = 3, .m = 2, .r = 2 },
    { .n = 4, .m = 2, .r = 2 }, { .n = 2, .m = 4, .r = 1 },
    { .n = 4, .m = 4, .r = 4 }, { .n = 8, .m = 4, .r = 4 }
};

/* --- counts -------------------------------------------------------------- */

static int count_all(struct size *sizes, int count)
{
    int i, w;

    progress_begin("arrays");
    for (i = 0; i < count; i++)
        for (w = 0; w < WAYS; w++) {
            struct systolic_run *run = &sizes[i].run[w];

            run->n = sizes[i].n;
            run->m = sizes[i].m;
            run->r = sizes[i].r;
            if (interrupted() != NULL
                || systolic_run(run, ways[w].schedule, ways[w].known, NULL,
                                NULL) != 0) {
                progress_begin(NULL);
                return 1;
            }
            progress(i * WAYS + w + 1, count * WAYS);
        }
    progress_begin(NULL);
    return 0;
}

static double used(const struct systolic_run *run)
{
    return (double)run->work / ((double)run->cells * (double)run->ticks);
}

static int write_counts(const char *folder, const struct size *sizes, int count)
{
    struct out_file out;
    int i, w;

    if (out_open_in(&out, folder, "counts.csv") != 0)
        return -1;
    fprintf(out.stream, "n,m,r,cells,schedule,ticks,work,utilisation,apart\n");
    for (i = 0; i < count; i++)
        for (w = 0; w < WAYS; w++) {
            const struct systolic_run *run = &sizes[i].run[w];

            fprintf(out.stream, "%d,%d,%d,%d,%s,%ld,%ld,%.4f,%.3g\n", run->n,
                    run->m, run->r, run->cells, ways[w].name, run->ticks,
                    run->work, used(run), run->apart);
        }
    return out_close(&out, 1);
}

/* The paper's claims beside what was counted. */
static void print_verdicts(const struct size *sizes, int count, FILE *out)
{
    int i, least = 1000, most = -1000, least_best = 1000, most_best = -1000;
    double low = 1, high = 0;

    for (i = 0; i < count; i++) {
        const struct size *s = &sizes[i];
        int formula = JL_SYSTOLIC_PAPER_TICKS(s->n, s->m, s->r);
        int more = (int)s->run[PAPER].ticks - formula;
        int more_best = (int)s->run[BEST].ticks - formula;
        double share = (double)s->run[PAPER].work
            / ((double)s->run[PAPER].cells * formula);

        least = more < least ? more : least;
        most = more > most ? more : most;
        least_best = more_best < least_best ? more_best : least_best;
        most_best = more_best > most_best ? more_best : most_best;
        low = share < low ? share : low;
        high = share > high ? share : high;
    }
    fprintf(out, "\nThe paper: a step in 3n + 3m + 2r ticks, if F, H, c, Gamma "
            "are known ahead\n  %s: counted, %d to %d ticks more\n"
            "  best, with nothing known ahead: %d to %d more\n"
            "The paper: about 60%% of the cells at work\n"
            "  %s: %.0f%% to %.0f%% of its own ticks\n",
            most <= 0 ? "holds" : "DOES NOT HOLD", least, most, least_best,
            most_best, low >= 0.5 ? "holds" : "DOES NOT HOLD", 100 * low,
            100 * high);
}

static void print_counts(const struct size *sizes, int count, FILE *out)
{
    double apart = 0;
    int i, w;

    fprintf(out, "Ticks of a step in the steady state, counted; in brackets "
            "the share of cells at work.\n"
            "c, G known: best, of systems whose c and Gamma are constant.\n\n"
            "  n  m  r  cells  3n+3m+2r        paper        naive         best"
            "        mixed    c, G known\n");
    for (i = 0; i < count; i++) {
        const struct size *s = &sizes[i];

        fprintf(out, "%3d%3d%3d%7d%10d", s->n, s->m, s->r, s->run[0].cells,
                JL_SYSTOLIC_PAPER_TICKS(s->n, s->m, s->r));
        for (w = 0; w < WAYS; w++) {
            fprintf(out, "%7ld (%2.0f%%)", s->run[w].ticks,
                    100 * used(&s->run[w]));
            apart = s->run[w].apart > apart ? s->run[w].apart : apart;
        }
        fputc('\n', out);
    }
    print_verdicts(sizes, count, out);
    fprintf(out, "The array's estimates are the filter's within %.2g, relative."
            "\n", apart);
}

/* --- what every cell does ------------------------------------------------ */

static const char *const modes[JL_SYSTOLIC_MODES] = {
    "idle", "QR", "Faddeev", "multiply", "subtract", "pass"
};
static const char *const parts[] = { "left", "right", "diamond",
                                     "subtractor" };

/* Of steps 3 to 5; a cell's line is its number, from the top. */
static void note(const jl_systolic *array, void *context)
{
    FILE *csv = context;
    int i;

    if (array->step < 2 || array->step >= 2 + DRAWN)
        return;
    for (i = 0; i < array->cells; i++) {
        const jl_systolic_cell *cell = &array->cell[i];

        if (cell->mode != JL_SYSTOLIC_IDLE)
            fprintf(csv, "%ld,%d,%d,%s,%d,%d,%s\n", array->tick,
                    array->step + 1, i, parts[cell->part], cell->row,
                    cell->column, modes[cell->mode]);
    }
}

static int draw(const char *folder, const struct size *size, int way)
{
    struct systolic_run run = { .n = size->n, .m = size->m, .r = size->r };
    struct out_file out;
    char title[160];
    int left = (run.n + run.m + run.r) * (run.n + run.m + run.r + 1) / 2;

    if (out_open_in(&out, folder, "activity.csv") != 0)
        return -1;
    fprintf(out.stream, "tick,step,cell,part,row,column,mode\n");
    if (systolic_run(&run, ways[way].schedule, ways[way].known, note,
                     out.stream) != 0) {
        (void)out_close(&out, 0);
        return -1;
    }
    if (out_close(&out, 1) != 0)
        return -1;
    snprintf(title, sizeof title, "n = %d, m = %d, r = %d, schedule %s: %d "
             "steps, %ld ticks each", run.n, run.m, run.r, ways[way].name,
             DRAWN, run.ticks);
    return plot_cells(folder, "activity", title, "activity.csv", modes + 1,
                      JL_SYSTOLIC_MODES - 1, run.cells, left);
}

/* --- the command --------------------------------------------------------- */

/* "3,2,2".  Returns 0, or -1. */
static int take_size(struct size *size, const char *text)
{
    char end;

    return sscanf(text, "%d,%d,%d%c", &size->n, &size->m, &size->r, &end) == 3
        && size->n >= 1 && size->n <= MOST && size->m >= 1 && size->m <= MOST
        && size->r >= 1 && size->r <= MOST ? 0 : -1;
}

/* One number of --n, --m, --r.  Returns 0, or -1. */
static int take_number(int *number, const char *text)
{
    char end;

    return sscanf(text, "%d%c", number, &end) == 1 && *number >= 1
        && *number <= MOST ? 0 : -1;
}

static int take_schedule(int *way, const char *name)
{
    for (*way = 0; *way < CONSTANT; (*way)++)
        if (strcmp(name, ways[*way].name) == 0)
            return 0;
    return -1;
}

int cmd_systolic(int argc, char **argv)
{
    static const struct option known[] = {
        { "size", required_argument, NULL, 1 },
        { "n", required_argument, NULL, 'n' },
        { "m", required_argument, NULL, 'm' },
        { "r", required_argument, NULL, 'r' },
        { "schedule", required_argument, NULL, 2 },
        { "out", required_argument, NULL, 'o' },
        { "help", no_argument, NULL, 'h' }, { 0 }
    };
    static struct size sizes[SIZES_MAX];
    struct size one = { .n = 0 };
    const struct size *drawn;
    const char *folder = "build/systolic";
    int c, way = BEST, count = 0, status;

    opterr = 0;                         /* said below, in one line */
    while ((c = getopt_long(argc, argv, ":o:h", known, NULL)) != -1)
        switch (c) {
        case 'h':
            fputs(help, stdout);
            return 0;
        case 'o':
            folder = optarg;
            break;
        case 1:
            if (count == SIZES_MAX || take_size(&sizes[count++], optarg) != 0)
                return misuse("systolic", "--size %s: three numbers from 1 to "
                              "%d, at most %d times", optarg, MOST, SIZES_MAX);
            break;
        case 'n':
        case 'm':
        case 'r':
            if (take_number(c == 'n' ? &one.n : c == 'm' ? &one.m : &one.r,
                            optarg) != 0)
                return misuse("systolic", "--%c %s: 1 to %d", c, optarg, MOST);
            break;
        case 2:
            if (take_schedule(&way, optarg) != 0)
                return misuse("systolic", "--schedule %s: paper, naive, best "
                              "or mixed", optarg);
            break;
        case ':':
            return misuse("systolic", "%s needs a value", argv[optind - 1]);
        default:
            return misuse("systolic", "unknown option %s", argv[optind - 1]);
        }
    if (optind < argc)
        return misuse("systolic", "takes no files, but was given %s",
                      argv[optind]);
    if (one.n + one.m + one.r > 0) {
        if (one.n == 0 || one.m == 0 || one.r == 0 || count > 0)
            return misuse("systolic", "--n, --m and --r go together, without "
                          "--size");
        sizes[count++] = one;
    }
    drawn = sizes;
    if (count == 0) {
        drawn = &sizes[1];
        memcpy(sizes, default_sizes, sizeof default_sizes);
        count = (int)(sizeof default_sizes / sizeof *default_sizes);
    }
    if (out_folder(folder) != 0 || count_all(sizes, count) != 0
        || write_counts(folder, sizes, count) != 0)
        return 1;
    print_counts(sizes, count, stdout);
    status = draw(folder, drawn, way);
    if (status < 0)
        return 1;
    printf("\ncounts, activity of every cell in every tick, picture: %s\n",
           folder);
    return 0;
}
