#include "estimates.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "complain.h"
#include "out_file.h"

/* All NaNs have the same bits, so that files and comparisons agree. */
static jl_real *nans(long count)
{
    jl_real *v = malloc((size_t)count * sizeof *v);
    long i;

    for (i = 0; v != NULL && i < count; i++)
        v[i] = (jl_real)NAN;
    return v;
}

int estimates_open(struct estimates *e, const struct data_file *data,
                   const struct model *model)
{
    long i;

    memset(e, 0, sizeof *e);
    e->rows = data->rows;
    e->n = model->n;
    e->M = model->M;
    e->x = nans(e->rows * e->n);
    e->P = nans(e->rows * e->n * e->n);
    e->mu = nans(e->rows * e->M);
    e->loglik = nans(e->rows);
    e->us = malloc((size_t)e->rows * sizeof *e->us);
    if (e->x == NULL || e->P == NULL || e->mu == NULL || e->loglik == NULL
        || e->us == NULL) {
        estimates_close(e);
        return complain(data->path, 0, NULL, "no memory for its estimates");
    }
    for (i = 0; i < e->rows; i++)
        e->us[i] = (double)NAN;
    return 0;
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

void estimates_note(struct estimates *e, long row, const jl_real *x,
                    const jl_real *P, const jl_real *mu, jl_real loglik,
                    double us)
{
    int n = e->n, M = e->M;

    memcpy(e->x + row * n, x, (size_t)n * sizeof *x);
    memcpy(e->P + row * n * n, P, (size_t)(n * n) * sizeof *P);
    memcpy(e->mu + row * M, mu, (size_t)M * sizeof *mu);
    e->loglik[row] = loglik;
    e->us[row] = us;
    e->done = row + 1;
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
        && same(a->P, b->P, rows * a->n * a->n)
        && same(a->mu, b->mu, rows * a->M)
        && same(a->loglik, b->loglik, rows);
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

void estimates_write(const struct estimates *e, const struct data_file *data,
                     int partial, FILE *out)
{
    int n = e->n, a, b;
    long row, rows = partial ? e->done : e->rows;

    fprintf(out, "%s%s", data->run != NULL ? "run," : "", data->time_name);
    for (a = 0; a < n; a++)
        fprintf(out, ",x%d", a);
    for (a = 0; a < n; a++)
        for (b = a; b < n; b++)
            fprintf(out, n > 10 ? ",P%d_%d" : ",P%d%d", a, b);
    for (a = 0; a < e->M; a++)
        fprintf(out, ",mu%d", a);
    fputs(",loglik\n", out);
    for (row = 0; row < rows; row++) {
        if (data->run != NULL)
            fprintf(out, "%ld,", data->run[row]);
        fputs(data->time_text[row], out);
        for (a = 0; a < n; a++)
            put(out, e->x[row * n + a]);
        for (a = 0; a < n; a++)
            for (b = a; b < n; b++)
                put(out, e->P[(row * n + a) * n + b]);
        for (a = 0; a < e->M; a++)
            put(out, e->mu[row * e->M + a]);
        put(out, e->loglik[row]);
        fputc('\n', out);
    }
    if (partial)
        fprintf(out, "# partial: %ld of %ld rows\n", rows, e->rows);
}

int estimates_save_partial(const struct estimates *e,
                           const struct data_file *data, const char *path)
{
    const char *to = path != NULL ? path : "-";
    struct out_file out;
    struct stat is;
    char *name;
    int status, beside;

    if (e->done == 0)
        return 0;
    beside = strcmp(to, "-") != 0 && (stat(to, &is) != 0
                                      || S_ISREG(is.st_mode));
    if (asprintf(&name, "%s%s", to, beside ? ".partial" : "") < 0)
        return complain(to, 0, NULL, "no memory");
    status = out_open(&out, name);
    if (status == 0) {
        estimates_write(e, data, 1, out.stream);
        status = out_close(&out, 1);
    }
    if (status == 0)
        complain(beside ? name : "output", 0, NULL,
                 "partial: the first %ld of %ld rows", e->done, e->rows);
    free(name);
    return status;
}
