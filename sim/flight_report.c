#include "flight_report.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "complain.h"
#include "out_file.h"
#include "plot.h"

#define WAYS 2                  /* with held positions, of a model at most */

/* --- names --------------------------------------------------------------- */

int flight_fits(const struct model *model)
{
    if ((model->motions != NULL || model->gains != NULL) && model->m == 2)
        return 0;
    return complain(model->path, 0, "axes", "a flight needs motions in 2 axes");
}

int flight_report_open(struct flight_report *report,
                       const struct data_file *data,
                       const struct options *options, int most)
{
    report->data = data;
    report->options = options;
    report->count = 0;
    report->runs = calloc((size_t)most, sizeof *report->runs);
    return report->runs != NULL ? 0
        : complain(data->path, 0, NULL, "no memory for %d runs", most);
}

void flight_report_close(struct flight_report *report)
{
    int i;

    for (i = 0; i < report->count; i++)
        estimates_close(&report->runs[i].e);
    free(report->runs);
}

void flight_model_name(char *name, int size, const struct model *model)
{
    const char *base = strrchr(model->path, '/');

    base = base == NULL ? model->path : base + 1;
    snprintf(name, (size_t)size, "%s", base);
    if (strlen(name) > 5 && strcmp(name + strlen(name) - 5, ".json") == 0)
        name[strlen(name) - 5] = '\0';
    for (; *name != '\0'; name++)       /* it goes into file and column names */
        if (!isalnum((unsigned char)*name) && strchr("_-.", *name) == NULL)
            *name = '_';
}

void flight_run_name(struct flight_run *run, const struct model *model,
                     enum hold hold)
{
    run->source = model;
    flight_model_name(run->model, sizeof run->model, model);
    strcpy(run->positions, hold == HOLD_NONE ? "fresh" : "recognised");
    snprintf(run->name, sizeof run->name, "%s_%s", run->model,
             run->positions);
}

/* --- errors -------------------------------------------------------------- */

/* |v - truth| in a row; NaN where either is missing, and in the row that the
 * filter starts from: its velocity is the start's 0 and no estimate. */
static double velocity_error(const struct flight_run *run,
                             const struct data_file *data, long row)
{
    int n = run->e.n, north = n / 2;
    const jl_real *x = run->e.x + row * n;
    const double *truth = data->extra + row * data->n_extra;

    if (isnan(run->e.us[row]))
        return (double)NAN;
    return hypot((double)x[1] - truth[0], (double)x[north + 1] - truth[1]);
}

static double rms_error(const struct flight_run *run,
                        const struct data_file *data)
{
    double sum = 0;
    long row, count = 0;

    for (row = 0; row < data->rows; row++) {
        double e = velocity_error(run, data, row);

        if (!isnan(e)) {
            sum += e * e;
            count++;
        }
    }
    return sqrt(sum / (double)count);
}

/* --- files --------------------------------------------------------------- */

static int open_in(struct out_file *out, const char *folder, const char *name,
                   const char *ending)
{
    char path[4096];

    snprintf(path, sizeof path, "%s/%s%s", folder, name, ending);
    return out_open(out, path);
}

static int write_estimates(const struct flight_report *r,
                           const struct flight_run *run, const char *folder)
{
    char path[4096];

    snprintf(path, sizeof path, "%s/%s.csv", folder, run->name);
    return run->partial ? estimates_save_partial(&run->e, r->data, path)
        : estimates_save(&run->e, r->data, path);
}

/* Time, what was measured, whether the row repeats the one before, and the
 * velocity error of each run. */
static int write_track(const struct flight_report *r, const char *folder)
{
    const struct data_file *data = r->data;
    struct feed held = { data, 0, HOLD_DETECT, 0, 0 };
    struct out_file out;
    long row;
    int i;

    if (open_in(&out, folder, "track", ".csv") != 0)
        return -1;
    fprintf(out.stream, "%s,east_m,north_m,held", data->time_name);
    for (i = 0; i < r->count; i++)
        fprintf(out.stream, ",%s", r->runs[i].name);
    fputc('\n', out.stream);
    for (row = 0; row < data->rows; row++) {
        fprintf(out.stream, "%s,%.9g,%.9g,%d", data->time_text[row],
                (double)data->z[row * 2], (double)data->z[row * 2 + 1],
                !feed_arrived(&held, row));
        for (i = 0; i < r->count; i++)
            fprintf(out.stream, ",%.9g",
                    velocity_error(&r->runs[i], data, row));
        fputc('\n', out.stream);
    }
    return out_close(&out, 1);
}

/* --- table --------------------------------------------------------------- */

#define HEAD "%-12s %-10s %8s %6s %8s %8s %7s %8s %6s %s%s\n"

/* The form of those filters that have one. */
static const char *form_name(const struct flight_report *r)
{
    int i;

    for (i = 0; i < r->count; i++)
        if (r->runs[i].e.has_P)
            return options_form(r->options);
    return "constant gains";
}

static void print_table(const struct flight_report *r, FILE *out)
{
    int i;

    fprintf(out, "%s: %ld rows, %d PEs over %s, %s%s, %s, %s",
            r->data->path, r->data->rows, r->options->pes,
            r->options->port == PORT_LCM ? "LCM"
                : options_port_name(r->options->port),
            options_topology(r->options),
            r->options->exchange == JL_EXCHANGE_REDUCE ? ", all-reduce" : "",
            form_name(r),
            JL_REAL_FLOAT ? "float" : "double");
    if (r->options->gate > 0)
        fprintf(out, ", gate %.17g", r->options->gate);
    fputc('\n', out);
    fprintf(out, HEAD, "", "held", "velocity", "", "step, us", "", "serial",
            "messages", "", r->options->gate > 0 ? "by gate  " : "",
            "same bits");
    fprintf(out, HEAD, "model", "positions", "rms, m/s", "steps", "median",
            "p99", "median", "sent", "resent",
            r->options->gate > 0 ? "rejected " : "", "as serial");
    for (i = 0; i < r->count; i++) {
        const struct flight_run *run = &r->runs[i];
        double median, p99;
        long steps = estimates_times(&run->e, &median, &p99);
        char same[40], rejected[32] = "";

        if (r->options->gate > 0)
            snprintf(rejected, sizeof rejected, "%8ld ", run->e.rejected);
        snprintf(same, sizeof same, run->same ? "yes"
                 : run->e.has_P ? "NO, %.1e sigma" : "NO", run->apart);
        fprintf(out, "%-12s %-10s %8.2f %6ld %8.1f %8.1f %7.1f %8lu %6lu "
                "%s%s\n", run->model, run->positions,
                rms_error(run, r->data), steps, median, p99, run->serial_us,
                run->traffic.messages, run->traffic.resent, rejected,
                run->partial ? "(partial)" : same);
    }
}

static void print_csv(const struct flight_report *r, FILE *out)
{
    int i;

    fputs("model,positions,velocity_rms_mps,steps,step_median_us,step_p99_us,"
          "serial_median_us,messages,octets,resent,same_bits,apart_sigma,"
          "partial", out);
    fputs(r->options->gate > 0 ? ",rejected\n" : "\n", out);
    for (i = 0; i < r->count; i++) {
        const struct flight_run *run = &r->runs[i];
        double median, p99;
        long steps = estimates_times(&run->e, &median, &p99);

        fprintf(out, "%s,%s,%.6g,%ld,%.6g,%.6g,%.6g,%lu,%lu,%lu,%d,%.3g,%d",
                run->model, run->positions, rms_error(run, r->data), steps,
                median, p99, run->serial_us, run->traffic.messages,
                run->traffic.octets, run->traffic.resent, run->same, run->apart,
                run->partial);
        if (r->options->gate > 0)
            fprintf(out, ",%ld", run->e.rejected);
        fputc('\n', out);
    }
}

static int write_tables(const struct flight_report *r, const char *folder)
{
    struct out_file out;

    if (open_in(&out, folder, "table", ".txt") != 0)
        return -1;
    print_table(r, out.stream);
    if (out_close(&out, 1) != 0
        || open_in(&out, folder, "table", ".csv") != 0)
        return -1;
    print_csv(r, out.stream);
    return out_close(&out, 1);
}

/* --- plots --------------------------------------------------------------- */

static int fresh(const struct flight_run *run)
{
    return strcmp(run->positions, "fresh") == 0;
}

/* The runs of one model, from `first`, in one picture. */
static int plot_model(const struct flight_report *r, int first, int count,
                      const char *folder)
{
    const struct flight_run *runs = r->runs + first;
    const char *time = r->data->time_name;
    struct plot_series track[1 + WAYS], error[1 + WAYS];
    char file[WAYS][128], legend[WAYS][48], north[16], name[128], title[128];
    int i, status;

    snprintf(north, sizeof north, "x%d", runs->e.n / 2);
    track[0] = (struct plot_series){ "track.csv", "east_m", "north_m",
                                     "measured", PLOT_DOTS };
    error[0] = (struct plot_series){ "track.csv", time, "held",
                                     "position held", PLOT_SHADE };
    for (i = 0; i < count; i++) {
        snprintf(file[i], sizeof file[i], "%s.csv", runs[i].name);
        snprintf(legend[i], sizeof legend[i], "held positions %s",
                 fresh(&runs[i]) ? "taken as fresh" : "recognised");
        track[1 + i] = (struct plot_series){ file[i], "x0", north, legend[i],
                                             PLOT_LINE };
        error[1 + i] = (struct plot_series){ "track.csv", time, runs[i].name,
                                             legend[i], PLOT_LINE };
    }
    snprintf(name, sizeof name, "track_%s", runs->model);
    snprintf(title, sizeof title, "Track: %s", runs->model);
    status = plot_track(folder, name, title, track, 1 + count);
    if (status != 0)
        return status;
    snprintf(name, sizeof name, "velocity_error_%s", runs->model);
    snprintf(title, sizeof title, "Velocity error: %s", runs->model);
    return plot_errors(folder, name, title, "velocity error in m/s", error,
                       1 + count);
}

/* Of constant gains alpha tells two of one order apart. */
static void mode_label(char *label, size_t size, const struct model *model,
                       int j)
{
    const jl_motion *motion;

    if (model->gains != NULL) {
        snprintf(label, size, "order %d, alpha %.3g", model->gains[j].order,
                 (double)model->gains[j].steady[0]);
        return;
    }
    motion = &model->motions[j];
    if (motion->kind == JL_MOTION_CT)
        snprintf(label, size, "CT %+g rad/s", (double)motion->turn_rate);
    else if (motion->kind == JL_MOTION_SINGER)
        snprintf(label, size, "Singer %g m/s^2, %g s",
                 (double)motion->accel_std, (double)motion->tau_s);
    else
        snprintf(label, size, "%s %g m/s^2",
                 motion->kind == JL_MOTION_CV ? "CV" : "CA",
                 (double)motion->accel_std);
}

static int plot_run_modes(const struct flight_report *r,
                          const struct flight_run *run, const char *folder)
{
    enum { MOST = 64 };
    char label[MOST][48], file[128], name[128], title[160];
    const char *names[MOST];
    int j, M = run->source->M;

    for (j = 0; j < M && j < MOST; j++) {
        mode_label(label[j], sizeof label[j], run->source, j);
        names[j] = label[j];
    }
    snprintf(file, sizeof file, "%s.csv", run->name);
    snprintf(name, sizeof name, "modes_%s", run->name);
    snprintf(title, sizeof title, "Mode probabilities: %s, held positions %s",
             run->model, fresh(run) ? "taken as fresh" : "recognised");
    return plot_modes(folder, name, title, file, r->data->time_name,
                      M <= MOST ? names : NULL, M);
}

/* --- all ----------------------------------------------------------------- */

int flight_report_write(const struct flight_report *r, const char *folder)
{
    int i, same, bad = 0;

    for (i = 0; i < r->count; i++) {
        bad |= r->runs[i].partial;
        bad |= write_estimates(r, &r->runs[i], folder) != 0;
    }
    bad |= write_track(r, folder) != 0;
    bad |= write_tables(r, folder) != 0;
    for (i = 0; !bad && i < r->count; i += same) {
        for (same = 1; i + same < r->count
             && r->runs[i + same].source == r->runs[i].source; same++)
            ;
        bad |= plot_model(r, i, same, folder) != 0;
    }
    for (i = 0; !bad && i < r->count; i++)
        bad |= plot_run_modes(r, &r->runs[i], folder) != 0;
    print_table(r, stdout);
    printf("%s %s\n", bad ? "incomplete:" : "tables, CSV and plots:", folder);
    for (i = 0; i < r->count; i++)
        bad |= !r->runs[i].same && r->options->exchange == JL_EXCHANGE_GATHER;
    return bad ? 1 : 0;
}
