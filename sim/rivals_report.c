/* What the runs of ar1, spring2 or turn gave: table, verdicts, CSV, plots. */
#include <stdio.h>

#include "out_file.h"
#include "plot.h"
#include "rivals.h"

static const char *const names[RIVALS] = { "EKF", "MEKF", "MEKF, spread" };
static const char *const columns[RIVALS] = { "ekf", "mekf", "spread" };
static const char *const quantities[QUANTITIES] = { "state", "parameter" };
static const char *const situations[SITUATIONS] = {
    "as_modelled", "too_sure", "too_noisy"
};
static const char *const told[SITUATIONS] = {
    "as modelled: the filters are told all variances as they are",
    "too sure: a hundredth of the parameter's variance at the start",
    "too noisy: a hundred times the variance of the states' noise"
};

/* --- table --------------------------------------------------------------- */

static void print_figure(struct rivals_figure figure, FILE *out)
{
    fprintf(out, " %9.3g +- %-7.2g", figure.value, figure.error);
}

static void print_filter(const struct rivals *r, int s, int f, int q, FILE *out)
{
    struct rivals_figure ratio = rivals_ratio(r, s, f, q);
    long nearer = rivals_nearer(r, s, f, q);

    fprintf(out, "  %-12s", names[f]);
    print_figure(rivals_rms(r, s, f, q, 0), out);
    print_figure(rivals_rms(r, s, f, q, 1), out);
    print_figure(rivals_mean(r, s, f, q), out);
    if (f != RIVAL_EKF)
        fprintf(out, " %6.3f +- %.3f   %3.0f%%  %s", ratio.value, ratio.error,
                100 * (double)nearer / (double)r->runs, rivals_verdict(ratio));
    fputc('\n', out);
}

static void print_head(const struct rivals *r, FILE *out)
{
    const struct rivals_scenario *c = r->scenario;

    fprintf(out, "%s: %ld runs of %d steps, seed %llu, %s\n"
            "%s:\ntruly %g at the start, where the filters take it for %g.\n"
            "Errors are estimate less truth; the MEKF's %s is xhat.  rms: over "
            "all steps and runs;\nfinal: at the last step; mean: of a run%s; "
            "+-: standard error over the runs.  Beside the\nEKF: a run's rms "
            "by the EKF's in it, geometric mean; nearer: in how many runs it "
            "is\nsmaller; better, worse: by two standard errors more than 1%% "
            "off.\n", c->name, r->runs, c->steps,
            (unsigned long long)r->seed, JL_REAL_FLOAT ? "float" : "double",
            c->what, c->y, c->y0, c->quantity[OF_STATE],
            c->states > 1 ? ", to the east" : "");
}

static void put_words(const struct rivals *r, FILE *out)
{
    const struct rivals_scenario *c = r->scenario;
    int s, f, q;

    print_head(r, out);
    for (s = 0; s < SITUATIONS; s++) {
        fprintf(out, "\n%s\n", told[s]);
        for (q = QUANTITIES - 1; q >= 0; q--) {
            char head[60];

            snprintf(head, sizeof head, "%s%s%s", c->quantity[q],
                     c->unit[q][0] != '\0' ? ", " : "", c->unit[q]);
            fprintf(out, "  %-19s%-21s%-21s%-17s%-16s nearer  is\n", head,
                    "rms", "final", "mean", "beside the EKF");
            for (f = 0; f < RIVALS; f++)
                print_filter(r, s, f, q, out);
        }
    }
}

/* --- files --------------------------------------------------------------- */

static void put_table(const struct rivals *r, FILE *out)
{
    int s, f, q;

    fputs("situation,filter,quantity,rms,rms_error,final,final_error,mean,"
          "mean_error,ratio,ratio_error,nearer,verdict\n", out);
    for (s = 0; s < SITUATIONS; s++)
        for (f = 0; f < RIVALS; f++)
            for (q = 0; q < QUANTITIES; q++) {
                struct rivals_figure rms = rivals_rms(r, s, f, q, 0);
                struct rivals_figure final = rivals_rms(r, s, f, q, 1);
                struct rivals_figure mean = rivals_mean(r, s, f, q);
                struct rivals_figure ratio = rivals_ratio(r, s, f, q);

                fprintf(out, "%s,%s,%s,%.9g,%.3g,%.9g,%.3g,%.9g,%.3g,",
                        situations[s], columns[f], quantities[q], rms.value,
                        rms.error, final.value, final.error, mean.value,
                        mean.error);
                if (f == RIVAL_EKF)
                    fputs("nan,nan,nan,\n", out);
                else
                    fprintf(out, "%.9g,%.3g,%ld,%s\n", ratio.value,
                            ratio.error, rivals_nearer(r, s, f, q),
                            rivals_verdict(ratio));
            }
}

static void put_columns(FILE *out, const char *const *endings, int count)
{
    int f, q, i;

    for (f = 0; f < RIVALS; f++)
        for (q = 0; q < QUANTITIES; q++)
            for (i = 0; i < count; i++)
                fprintf(out, ",%s_%s_%s", columns[f], quantities[q],
                        endings[i]);
    fputc('\n', out);
}

/* situation: its number, from 0. */
static void put_runs(const struct rivals *r, FILE *out)
{
    static const char *const endings[] = { "rms", "final", "mean" };
    int s, f, q;
    long i;

    fputs("situation,run", out);
    put_columns(out, endings, 3);
    for (s = 0; s < SITUATIONS; s++)
        for (i = 0; i < r->runs; i++) {
            fprintf(out, "%d,%ld", s, i);
            for (f = 0; f < RIVALS; f++)
                for (q = 0; q < QUANTITIES; q++) {
                    const struct rivals_error *e = &r->run[i].of[s][f][q];

                    fprintf(out, ",%.17g,%.17g,%.17g", e->rms, e->final,
                            e->mean);
                }
            fputc('\n', out);
        }
}

static void put_curves(const struct rivals *r, int s, FILE *out)
{
    static const char *const endings[] = { "rms" };
    double T = (double)r->scenario->zoo.T;
    int f, q, k;

    fputs("t_s", out);
    put_columns(out, endings, 1);
    for (k = 0; k < r->scenario->steps; k++) {
        fprintf(out, "%.9g", (k + 1) * T);
        for (f = 0; f < RIVALS; f++)
            for (q = 0; q < QUANTITIES; q++)
                fprintf(out, ",%.9g", rivals_step(r, s, f, q, k));
        fputc('\n', out);
    }
}

static int write_file(const struct rivals *r, const char *folder,
                      const char *name,
                      void (*put)(const struct rivals *r, FILE *out))
{
    struct out_file out;

    if (out_open_in(&out, folder, name) != 0)
        return -1;
    put(r, out.stream);
    return out_close(&out, 1);
}

/* --- a situation's curves and plots --------------------------------------- */

static int plot(const struct rivals *r, const char *folder, const char *file,
                int s, int q)
{
    const struct rivals_scenario *c = r->scenario;
    struct plot_series series[RIVALS];
    char column[RIVALS][40], name[60], title[160], label[80];
    int f;

    for (f = 0; f < RIVALS; f++) {
        snprintf(column[f], sizeof column[f], "%s_%s_rms", columns[f],
                 quantities[q]);
        series[f] = (struct plot_series){ file, "t_s", column[f], names[f],
                                          f == RIVAL_SPREAD ? PLOT_DASHES
                                                            : PLOT_LINE };
    }
    snprintf(name, sizeof name, "%s_%s", quantities[q], situations[s]);
    snprintf(title, sizeof title, "%s, error of the %s, %s", c->name,
             c->quantity[q], told[s]);
    snprintf(label, sizeof label, "rms error of the %s%s%s", c->quantity[q],
             c->unit[q][0] != '\0' ? " in " : "", c->unit[q]);
    return (q == OF_STATE ? plot_curves : plot_errors)(folder, name, title,
                                                       label, series, RIVALS);
}

static int draw(const struct rivals *r, const char *folder, int s)
{
    struct out_file out;
    char file[60];
    int q, bad = 0;

    snprintf(file, sizeof file, "curves_%s.csv", situations[s]);
    if (out_open_in(&out, folder, file) != 0)
        return -1;
    put_curves(r, s, out.stream);
    if (out_close(&out, 1) != 0)
        return -1;
    for (q = 0; q < QUANTITIES; q++)
        bad |= plot(r, folder, file, s, q);
    return bad;
}

int rivals_report(const struct rivals *r, const char *folder)
{
    int bad = write_file(r, folder, "table.txt", put_words) != 0
        || write_file(r, folder, "table.csv", put_table) != 0
        || write_file(r, folder, "runs.csv", put_runs) != 0;
    int s;

    for (s = 0; s < SITUATIONS && !bad; s++)
        bad = draw(r, folder, s) != 0;
    put_words(r, stdout);
    printf("\n%s %s\n", bad ? "incomplete:" : "tables, CSV and plots:", folder);
    return bad;
}
