/* What the runs of manoeuvre1d gave: table, verdicts, CSV, plots. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "jumplink/base.h"
#include "manoeuvre.h"
#include "out_file.h"
#include "plot.h"

static const char *const names[MAN_FILTERS] = {
    "IMM", "CG-IMM", "adaptive alpha-beta"
};
static const char *const columns[MAN_FILTERS] = { "imm", "cgimm", "adaptive" };
static const char *const states[MAN_STATES] = {
    "position", "velocity", "acceleration"
};
static const char *const units[MAN_STATES] = { "m", "m/s", "m/s2" };
static const char *const unit_columns[MAN_STATES] = { "m", "mps", "mps2" };

static int has(int filter, int state)
{
    return filter != MAN_ADAPTIVE || state != MAN_ACCELERATION;
}

/* --- table --------------------------------------------------------------- */

static void print_filter(const struct manoeuvre *m, int f, int p, FILE *out)
{
    int i;

    fprintf(out, "  %-20s", names[f]);
    for (i = 0; i < MAN_STATES; i++)
        if (has(f, i))
            fprintf(out, " %8.1f %8.1f", manoeuvre_phase_mean(m, f, i, p).value,
                    manoeuvre_phase_rms(m, f, i, p));
        else
            fprintf(out, " %8s %8s", "-", "-");
    fprintf(out, " %8.2f\n",
            manoeuvre_phase_rms(m, f, MAN_POSITION, p) / MAN_SIGMA);
}

static void print_ratio(const struct manoeuvre *m, int p, FILE *out)
{
    int i;

    fprintf(out, "  %-20s", "CG-IMM / IMM");
    for (i = 0; i < MAN_STATES; i++) {
        struct man_figure ratio = manoeuvre_ratio(m, i, p);

        fprintf(out, "    %5.3f +- %5.3f", ratio.value, ratio.error);
    }
    fputc('\n', out);
}

static void print_table(const struct manoeuvre *m, FILE *out)
{
    int i, p, f;

    fprintf(out, "manoeuvre1d: %ld runs, seed %llu, %s\n"
            "Errors are estimate less truth.  compress: rms of the position "
            "by that of\nits measurements, %g m.  +-: standard error over the "
            "runs.\n\n%22s", m->runs,
            (unsigned long long)m->seed, JL_REAL_FLOAT ? "float" : "double",
            MAN_SIGMA, "");
    for (i = 0; i < MAN_STATES; i++) {
        char head[40];

        snprintf(head, sizeof head, "%s, %s", states[i], units[i]);
        fprintf(out, "  %-16s", head);
    }
    fprintf(out, "\n%22s", "");
    for (i = 0; i < MAN_STATES; i++)
        fprintf(out, " %8s %8s", "mean", "rms");
    fprintf(out, " compress\n");
    for (p = 0; p < MAN_PHASES; p++) {
        fprintf(out, "%s, %d to %d s\n", man_phases[p].name,
                man_phases[p].from, man_phases[p].to);
        for (f = 0; f < MAN_FILTERS; f++)
            print_filter(m, f, p, out);
        print_ratio(m, p, out);
    }
}

/* --- what the paper says -------------------------------------------------- */

/* As good: an rms not more than so much larger, and by more than two standard
 * errors not so good. */
#define AS_GOOD 1.05

enum { TURN = 2 };              /* the phase in which nothing changes */

static void print_accuracy(const struct manoeuvre *m, int state, FILE *out)
{
    struct man_figure all = manoeuvre_ratio(m, state, MAN_PHASES - 1);
    int p, failed = 0, unsure = 0;

    fprintf(out, "  %s: ", states[state]);
    for (p = 0; p < MAN_PHASES; p++) {
        struct man_figure r = manoeuvre_ratio(m, state, p);

        if (r.value - 2 * r.error > AS_GOOD)
            fprintf(out, "%s %d to %d s (%.2f +- %.2f)",
                    failed++ == 0 ? "DOES NOT HOLD in" : ",",
                    man_phases[p].from, man_phases[p].to, r.value, r.error);
        else
            unsure += r.value + 2 * r.error > AS_GOOD;
    }
    fprintf(out, "%s; over all %.3f +- %.3f\n", failed > 0 ? ""
            : unsure ? "too few runs to say" : "holds in every phase",
            all.value, all.error);
}

/* No bias: less than a tenth of the adaptive filter's. */
static const char *bias_verdict(struct man_figure cg, struct man_figure other)
{
    double mean = fabs(cg.value), tenth = fabs(other.value) / 10;
    double doubt = 2 * cg.error + other.error / 5;

    return mean + doubt < tenth ? "holds, less than a tenth"
        : mean - doubt > tenth ? "DOES NOT HOLD" : "too few runs to say";
}

static void print_bias(const struct manoeuvre *m, FILE *out)
{
    int i;

    for (i = 0; i < 2; i++) {
        struct man_figure cg = manoeuvre_phase_mean(m, MAN_CGIMM, i, TURN);
        struct man_figure a = manoeuvre_phase_mean(m, MAN_ADAPTIVE, i, TURN);

        fprintf(out, "  %s: %s: %.1f +- %.1f %s, the adaptive filter "
                "%.1f +- %.1f\n", states[i], bias_verdict(cg, a), cg.value,
                cg.error, units[i], a.value, a.error);
    }
}

/* Whoever writes the IMM out for these two modes needs less than matrices do,
 * the paper 133 and 103. */
static void print_cost(FILE *out)
{
    double ratio = (double)(MAN_CG_PRODUCTS + MAN_CG_SUMS)
        / (MAN_IMM_PRODUCTS + MAN_IMM_SUMS);

    fprintf(out, "The paper: about half the IMM's computation, 76 products and "
            "46 sums a step to\n133 and 103 (here, by matrices, gains steady: "
            "tests/count)\n  %s: %d and %d to %d and %d, %.2f of them\n",
            ratio <= 0.5 ? "holds" : "DOES NOT HOLD", MAN_CG_PRODUCTS,
            MAN_CG_SUMS, MAN_IMM_PRODUCTS, MAN_IMM_SUMS, ratio);
}

static void print_verdicts(const struct manoeuvre *m, FILE *out)
{
    int i;

    fprintf(out, "\nThe paper: as accurate as the IMM (here: rms at most %g "
            "times the IMM's)\n", AS_GOOD);
    for (i = 0; i < MAN_STATES; i++)
        print_accuracy(m, i, out);
    fprintf(out, "The paper: no bias, as one filter of constant gains has it "
            "(here: mean errors,\n%d to %d s)\n", man_phases[TURN].from, man_phases[TURN].to);
    print_bias(m, out);
    print_cost(out);
}

/* --- files --------------------------------------------------------------- */

static void put_table(const struct manoeuvre *m, FILE *out)
{
    int p, f, i;

    fputs("phase,from_s,to_s,filter", out);
    for (i = 0; i < MAN_STATES; i++)
        fprintf(out, ",%s_mean_%s,%s_mean_error,%s_rms_%s,%s_ratio,"
                "%s_ratio_error", states[i], unit_columns[i], states[i],
                states[i], unit_columns[i], states[i], states[i]);
    fputs(",compression\n", out);
    for (p = 0; p < MAN_PHASES; p++)
        for (f = 0; f < MAN_FILTERS; f++) {
            fprintf(out, "%s,%d,%d,%s", man_phases[p].name, man_phases[p].from,
                    man_phases[p].to, columns[f]);
            for (i = 0; i < MAN_STATES; i++) {
                struct man_figure mean = manoeuvre_phase_mean(m, f, i, p);
                struct man_figure ratio = manoeuvre_ratio(m, i, p);

                if (has(f, i))
                    fprintf(out, ",%.9g,%.3g,%.9g", mean.value, mean.error,
                            manoeuvre_phase_rms(m, f, i, p));
                else
                    fputs(",nan,nan,nan", out);
                if (f == MAN_CGIMM)
                    fprintf(out, ",%.9g,%.3g", ratio.value, ratio.error);
                else
                    fputs(",nan,nan", out);
            }
            fprintf(out, ",%.9g\n",
                    manoeuvre_phase_rms(m, f, MAN_POSITION, p) / MAN_SIGMA);
        }
}

static void put_curves(const struct manoeuvre *m, FILE *out)
{
    int f, i, k;

    fputs("t_s,acceleration_mps2", out);
    for (f = 0; f < MAN_FILTERS; f++) {
        for (i = 0; i < MAN_STATES; i++)
            if (has(f, i))
                fprintf(out, ",%s_mean_%s,%s_rms_%s", columns[f], states[i],
                        columns[f], states[i]);
        fprintf(out, ",%s_compression", columns[f]);
        if (has(f, MAN_ACCELERATION))
            fprintf(out, ",%s_estimated_acceleration", columns[f]);
    }
    fputc('\n', out);
    for (k = 0; k < MAN_STEPS; k++) {
        fprintf(out, "%d,%g", k + 1, m->acceleration[k]);
        for (f = 0; f < MAN_FILTERS; f++) {
            for (i = 0; i < MAN_STATES; i++)
                if (has(f, i))
                    fprintf(out, ",%.9g,%.9g", manoeuvre_mean(m, f, i, k),
                            manoeuvre_rms(m, f, i, k));
            fprintf(out, ",%.9g",
                    manoeuvre_rms(m, f, MAN_POSITION, k) / MAN_SIGMA);
            if (has(f, MAN_ACCELERATION))
                fprintf(out, ",%.9g", m->acceleration[k]
                        + manoeuvre_mean(m, f, MAN_ACCELERATION, k));
        }
        fputc('\n', out);
    }
}

static void put_words(const struct manoeuvre *m, FILE *out)
{
    print_table(m, out);
    print_verdicts(m, out);
}

static int write_file(const struct manoeuvre *m, const char *folder,
                      const char *name,
                      void (*put)(const struct manoeuvre *m, FILE *out))
{
    struct out_file out;

    if (out_open_in(&out, folder, name) != 0)
        return -1;
    put(m, out.stream);
    return out_close(&out, 1);
}

/* --- plots --------------------------------------------------------------- */

static int plot(const char *folder, const char *name, const char *title,
                const char *y_label, const char *column, int filters,
                const char *truth)
{
    struct plot_series series[MAN_FILTERS + 1];
    char column_of[MAN_FILTERS][64];
    int f, count = 0;

    if (truth != NULL)
        series[count++] = (struct plot_series){ "curves.csv", "t_s", truth,
                                                "truth", PLOT_TRUTH };
    for (f = 0; f < filters; f++) {
        snprintf(column_of[f], sizeof column_of[f], "%s_%s", columns[f],
                 column);
        series[count++] = (struct plot_series){ "curves.csv", "t_s",
                                                column_of[f], names[f],
                                                PLOT_LINE };
    }
    return plot_curves(folder, name, title, y_label, series, count);
}

/* The paper's figures 1 to 4. */
static int plot_all(const char *folder)
{
    int bad = plot(folder, "position_error", "Mean error of the position",
                   "mean error in m", "mean_position", MAN_FILTERS, NULL);

    bad |= plot(folder, "velocity_error", "Mean error of the velocity",
                "mean error in m/s", "mean_velocity", MAN_FILTERS, NULL);
    bad |= plot(folder, "compression", "Noise compression of the position",
                "rms error / deviation of the measurements", "compression",
                MAN_FILTERS, NULL);
    bad |= plot(folder, "acceleration", "Mean estimate of the acceleration",
                "acceleration in m/s^2", "estimated_acceleration",
                MAN_ADAPTIVE, "acceleration_mps2");
    return bad;
}

int manoeuvre_report(const struct manoeuvre *m, const char *folder)
{
    int bad = write_file(m, folder, "table.txt", put_words) != 0
        || write_file(m, folder, "table.csv", put_table) != 0
        || write_file(m, folder, "curves.csv", put_curves) != 0
        || plot_all(folder) != 0;

    put_words(m, stdout);
    printf("\n%s %s\n", bad ? "incomplete:" : "tables, CSV and plots:", folder);
    return bad;
}
