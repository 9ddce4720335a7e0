#include "estimates.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "complain.h"
#include "diagnostics.h"
#include "out_file.h"

/* From count to more numbers, the new ones NaN.  All NaNs have the same bits,
 * so that files and comparisons agree. */
static int stretch(jl_real **v, long count, long more)
{
    jl_real *larger = reallocarray(*v, (size_t)more, sizeof *larger);

    if (larger == NULL)
        return -1;
    for (*v = larger; count < more; count++)
        larger[count] = (jl_real)NAN;
    return 0;
}

static int make_room(struct estimates *e, long rows)
{
    long had = e->room, n = e->n, M = e->M;
    double *us;

    if (stretch(&e->x, had * n, rows * n) != 0
        || (e->has_P && stretch(&e->P, had * n * n, rows * n * n) != 0)
        || (M > 0 && stretch(&e->mu, had * M, rows * M) != 0)
        || stretch(&e->loglik, had, rows) != 0)
        return -1;
    us = reallocarray(e->us, (size_t)rows, sizeof *us);
    if (us == NULL)
        return -1;
    for (e->us = us; had < rows; had++)
        us[had] = (double)NAN;
    e->room = rows;
    return 0;
}

int estimates_grow(struct estimates *e, long rows)
{
    if (rows > e->room && make_room(e, rows > 2 * e->room ? rows
                                                          : 2 * e->room) != 0)
        return -1;
    if (rows > e->rows)
        e->rows = rows;
    return 0;
}

int estimates_open(struct estimates *e, const struct data_file *data,
                   const struct model *model)
{
    memset(e, 0, sizeof *e);
    e->mekf = model->mekf;
    e->n = model->mekf != NULL ? mekf_filter_columns(model->mekf) : model->n;
    e->M = model->M;
    e->has_P = model->gains == NULL && model->mekf == NULL;
    if (estimates_grow(e, data->rows) == 0)
        return 0;
    estimates_close(e);
    return complain(data->path, 0, NULL, "no memory for its estimates");
}

void estimates_close(struct estimates *e)
{
    free(e->x);
    free(e->P);
    free(e->mu);
    free(e->loglik);
    free(e->us);
    memset(e, 0, sizeof *e);
}

void estimates_note(struct estimates *e, long row, const jl_estimate *estimate,
                    double us)
{
    size_t n = (size_t)e->n, M = (size_t)e->M, at = (size_t)row;

    memcpy(e->x + at * n, estimate->x, n * sizeof *e->x);
    if (e->has_P)
        memcpy(e->P + at * n * n, estimate->P, n * n * sizeof *e->P);
    if (e->M > 0)
        memcpy(e->mu + at * M, estimate->mu, M * sizeof *e->mu);
    e->loglik[row] = estimate->loglik;
    e->us[row] = us;
    e->done = row + 1;
    e->judged += estimate->verdict != JL_MISSING;
    e->rejected += estimate->verdict == JL_REJECTED;
}

static int same(const jl_real *a, const jl_real *b, long count)
{
    return memcmp(a, b, (size_t)count * sizeof *a) == 0;
}

int estimates_same(const struct estimates *a, const struct estimates *b)
{
    long rows = a->rows;

    return rows == b->rows && a->n == b->n && a->M == b->M
        && same(a->x, b->x, rows * a->n)
        && a->has_P == b->has_P
        && (!a->has_P || same(a->P, b->P, rows * a->n * a->n))
        && same(a->mu, b->mu, rows * a->M)
        && same(a->loglik, b->loglik, rows);
}

double estimates_apart(const struct estimates *a, const struct estimates *b)
{
    double most = 0;
    long row;
    int i, n = b->n;

    if (!b->has_P)
        return (double)NAN;
    for (row = 0; row < b->rows; row++)
        for (i = 0; i < n; i++) {
            double x = (double)a->x[row * n + i], y = (double)b->x[row * n + i];
            double apart = fabs(x - y)
                / sqrt((double)b->P[(row * n + i) * n + i]);

            if (isnan(x) != isnan(y))
                return (double)NAN;
            if (apart > most)
                most = apart;
        }
    return most;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

long estimates_times(const struct estimates *e, double *median_us,
                     double *p99_us)
{
    double *sorted = malloc((size_t)e->rows * sizeof *sorted);
    long i, count = 0;

    *median_us = *p99_us = (double)NAN;
    for (i = 0; sorted != NULL && i < e->rows; i++)
        if (!isnan(e->us[i]))
            sorted[count++] = e->us[i];
    if (count > 0) {
        qsort(sorted, (size_t)count, sizeof *sorted, ascending);
        *median_us = sorted[count / 2];
        *p99_us = sorted[(count - 1) * 99 / 100];
    }
    free(sorted);
    return count;
}

static void put(FILE *out, jl_real v)
{
    if (isnan((double)v))
        fputs(",nan", out);
    else
        fprintf(out, ",%.17g", (double)v);
}

static void put_names(const struct estimates *e, FILE *out)
{
    int n = e->n, a, b;

    if (e->mekf != NULL) {
        mekf_filter_names(e->mekf, out);
        return;
    }
    for (a = 0; a < n; a++)
        fprintf(out, ",x%d", a);
    for (a = 0; a < n && e->has_P; a++)
        for (b = a; b < n; b++)
            fprintf(out, n > 10 ? ",P%d_%d" : ",P%d%d", a, b);
    for (a = 0; a < e->M; a++)
        fprintf(out, ",mu%d", a);
    fputs(",loglik", out);
    if (e->diagnostics != NULL)
        diagnostics_write_names(e->diagnostics, out);
}

static void put_row(const struct estimates *e, long row, FILE *out)
{
    int n = e->n, a, b;

    for (a = 0; a < n; a++)
        put(out, e->x[row * n + a]);
    for (a = 0; a < n && e->has_P; a++)
        for (b = a; b < n; b++)
            put(out, e->P[(row * n + a) * n + b]);
    for (a = 0; a < e->M; a++)
        put(out, e->mu[row * e->M + a]);
    if (e->mekf == NULL)
        put(out, e->loglik[row]);
    if (e->diagnostics != NULL)
        diagnostics_write(e->diagnostics, row, out);
}

void estimates_write(const struct estimates *e, const struct data_file *data,
                     int partial, FILE *out)
{
    long row, rows = partial ? e->done : e->rows;

    fprintf(out, "%s%s", data->run != NULL ? "run," : "", data->time_name);
    put_names(e, out);
    fputc('\n', out);
    for (row = 0; row < rows; row++) {
        if (data->run != NULL)
            fprintf(out, "%ld,", data->run[row]);
        fputs(data->time_text[row], out);
        put_row(e, row, out);
        fputc('\n', out);
    }
    if (partial)
        fprintf(out, "# partial: %ld of %ld rows\n", rows, e->rows);
}

/* PATH.partial, or, where that makes no sense, the path itself; NULL: no memory.
 * To be freed. */
static char *partial_name(const char *path)
{
    struct stat is;
    int beside = strcmp(path, "-") != 0 && (stat(path, &is) != 0
                                            || S_ISREG(is.st_mode));
    char *name;

    return asprintf(&name, "%s%s", path, beside ? ".partial" : "") < 0
        ? NULL : name;
}

int estimates_save(const struct estimates *e, const struct data_file *data,
                   const char *path)
{
    char *partial = partial_name(path != NULL ? path : "-");
    struct out_file out;
    int status = out_open(&out, path);

    if (status == 0) {
        estimates_write(e, data, 0, out.stream);
        status = out_close(&out, 1);
    }
    if (status == 0 && path != NULL && partial != NULL
        && strcmp(partial, path) != 0)
        unlink(partial);
    free(partial);
    return status;
}

int estimates_save_partial(const struct estimates *e,
                           const struct data_file *data, const char *path)
{
    char *name = partial_name(path != NULL ? path : "-");
    struct out_file out;
    int status;

    if (name == NULL)
        return complain(path, 0, NULL, "no memory");
    status = e->done > 0 ? out_open(&out, name) : -1;
    if (status == 0) {
        estimates_write(e, data, 1, out.stream);
        status = out_close(&out, 1);
    }
    if (status == 0)
        complain(strcmp(name, "-") != 0 ? name : "output", 0, NULL,
                 "partial: the first %ld of %ld rows", e->done, e->rows);
    free(name);
    return e->done > 0 ? status : 0;
}
