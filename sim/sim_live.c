#include "sim_live.h"

#include <math.h>
#include <stdio.h>

#include "complain.h"
#include "flight_report.h"
#include "interrupt.h"
#include "live_input.h"
#include "out_file.h"
#include "progress.h"
#include "run.h"

/* --- files --------------------------------------------------------------- */

static const char *path_of(const struct options *options,
                           const struct model *model, const char *what)
{
    static char path[4096];
    char name[64];

    flight_model_name(name, sizeof name, model);
    snprintf(path, sizeof path, "%s/%s_%s.csv", options->out, name, what);
    return path;
}

/* As jumplink filter reads it. */
static void write_record(const struct data_file *data, FILE *out)
{
    long row;
    int i;

    fputs(data->run != NULL ? "run,t_s" : "t_s", out);
    for (i = 0; i < data->m; i++)
        fprintf(out, ",z%d", i);
    fputc('\n', out);
    for (row = 0; row < data->rows; row++) {
        if (data->run != NULL)
            fprintf(out, "%ld,", data->run[row]);
        fputs(data->time_text[row], out);
        for (i = 0; i < data->m; i++)
            if (isnan((double)data->z[row * data->m + i]))
                fputc(',', out);
            else
                fprintf(out, ",%.17g", (double)data->z[row * data->m + i]);
        fputc('\n', out);
    }
}

static int save_record(const struct live_input *live,
                       const struct model *model,
                       const struct options *options)
{
    struct out_file out;

    if (out_open(&out, path_of(options, model, "record")) != 0)
        return 1;
    write_record(&live->data, out.stream);
    return out_close(&out, 1) != 0;
}

static int save_all(const struct estimates *e, const struct live_input *live,
                    const struct model *model, const struct options *options)
{
    return estimates_save(e, &live->data, path_of(options, model, "live")) != 0
        || save_record(live, model, options) != 0;
}

/* --- words --------------------------------------------------------------- */

static void print_report(const struct estimates *e, const struct estimates *one,
                         const struct live_input *live,
                         const struct options *options, int same)
{
    const struct live_count *count = &live->count;
    double median, p99, serial, serial_p99;
    long steps = estimates_times(e, &median, &p99);

    (void)estimates_times(one, &serial, &serial_p99);
    printf("received   %8lu\n", count->received);
    printf("lost       %8lu, predicted through %lu\n", count->lost,
           count->filled);
    printf("late       %8lu, or doubled\n", count->late);
    printf("refused    %8lu%s%s\n", count->refused,
           count->refused > 0 ? ", the first: " : "", live->refusal);
    if (options->gate > 0)
        printf("rejected   %8ld, by the gate\n", e->rejected);
    printf("steps      %8ld, median %.1f us, p99 %.1f us; serial median "
           "%.1f us\n", steps, median, p99, serial);
    if (same)
        puts("same bits as serial: yes");
    else if (e->has_P)
        printf("same bits as serial: NO, %.1e sigma\n",
               estimates_apart(e, one));
    else
        puts("same bits as serial: NO");
}

static int nothing_came(const struct live_input *live,
                        const struct options *options)
{
    if (live->count.refused > 0)
        complain(live->data.path, 0, NULL, "no measurement that %s can use: "
                 "%lu refused, the first: %s", live->model->path,
                 live->count.refused, live->refusal);
    else if (interrupted() != NULL)
        complain(interrupted(), 0, NULL, "no measurement on %s so far",
                 options->lcm_url);
    else
        complain(live->data.path, 0, NULL, "no measurement on %s within "
                 "%.6g s", options->lcm_url, (double)options->start_us * 1e-6);
    return 1;
}

/* --- the run ------------------------------------------------------------- */

/* The same record through the serial filter. */
static int compare(const struct estimates *e, const struct live_input *live,
                   const struct model *model, const struct options *options)
{
    struct estimates serial;
    int status = 1, same;

    if (estimates_open(&serial, &live->data, model) != 0)
        return 1;
    if (run_serial(&serial, model, &live->data, options) == 0) {
        same = estimates_same(&serial, e);
        print_report(e, &serial, live, options, same);
        status = save_all(e, live, model, options);
        if (status == 0)
            printf("estimates and record: %s\n", options->out);
        if (!same && options->exchange == JL_EXCHANGE_GATHER)
            status = 1;
    }
    estimates_close(&serial);
    return status;
}

static int run_live(struct live_input *live, const struct model *model,
                    const struct options *options)
{
    struct estimates e;
    struct traffic traffic;
    int status;

    if (estimates_open(&e, &live->data, model) != 0)
        return 1;
    printf("listening to %s on %s\n", live->data.path, options->lcm_url);
    fflush(stdout);
    progress_begin(live->data.path);
    status = run(&e, &traffic, model, &live->data, options);
    progress_begin(NULL);
    live_finish(live);
    if (status == 0)
        status = live->data.rows == 0 ? nothing_came(live, options)
            : compare(&e, live, model, options);
    else if (e.done > 0) {
        (void)estimates_save_partial(&e, &live->data,
                                     path_of(options, model, "live"));
        (void)save_record(live, model, options);
    }
    estimates_close(&e);
    return status;
}

static int is_interrupted(void)
{
    return interrupted() != NULL;
}

int sim_live(const char *model_path, struct options *options, long idle_us)
{
    struct model model;
    struct live_input live;
    int status;

    if (model_read(&model, model_path) != 0)
        return 2;
    status = run_pick_mode(&model, options);
    if (status == 0 && out_folder(options->out) != 0)
        status = 1;
    if (status == 0 && live_open(&live, &model, options, idle_us) != 0)
        status = 1;
    else if (status == 0) {
        live.stop = is_interrupted;     /* the way to end such a run */
        options->live = &live;
        status = run_live(&live, &model, options);
        options->live = NULL;
        live_close(&live);
    }
    model_free(&model);
    return status;
}
