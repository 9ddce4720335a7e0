#include "diagnostics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "complain.h"

/* --- the truth ----------------------------------------------------------- */

/* Names into `names`, "a,b", and what they are the truth of. */
static int take_names(struct diagnostics *d, char *list,
                      const struct model *model, const struct options *options)
{
    char *name;
    int i = 0;

    while ((name = strsep(&list, ",")) != NULL) {
        if (name[0] == '\0')
            return misuse(options->command, "--truth %s: an empty name "
                          "(- for a component that is not known)",
                          options->truth);
        if (i < d->n && strcmp(name, "-") != 0) {
            if (d->known > 0)
                strcat(d->truth, ",");
            strcat(d->truth, name);
            d->component[d->known++] = i;
        }
        i++;
    }
    if (i != d->n)
        return misuse(options->command, "--truth names %d components, but %s "
                      "has %d states", i, model->path, d->n);
    if (d->known == 0)
        return misuse(options->command, "--truth %s: no component is known",
                      options->truth);
    return 0;
}

int diagnostics_open(struct diagnostics *d, const struct model *model,
                     const struct options *options)
{
    char *list;
    int status;

    memset(d, 0, sizeof *d);
    d->M = model->M;
    d->m = model->m;
    d->n = model->n;
    if (options->truth == NULL)
        return 0;
    list = strdup(options->truth);
    d->truth = calloc(strlen(options->truth) + 1, 1);
    d->component = calloc((size_t)d->n, sizeof *d->component);
    d->work = calloc((size_t)(d->n * (d->n + 1)), sizeof *d->work);
    status = list == NULL || d->truth == NULL || d->component == NULL
        || d->work == NULL
        ? (complain(model->path, 0, NULL, "out of memory"), 2)
        : take_names(d, list, model, options);
    free(list);
    if (status != 0)
        diagnostics_close(d);
    return status;
}

void diagnostics_close(struct diagnostics *d)
{
    free(d->component);
    free(d->truth);
    free(d->work);
    free(d->v);
    memset(d, 0, sizeof *d);
}

/* e' P^-1 e over the components that are known; NaN if one is missing. */
static double nees(const struct diagnostics *d, long row, const jl_real *x,
                   const jl_real *P)
{
    const double *truth = d->data->extra + row * d->known;
    int i, j, k = d->known, n = d->n;
    jl_real *L = d->work, *e = L + k * k;
    double sum = 0;

    for (i = 0; i < k; i++) {
        int a = d->component[i];

        e[i] = (jl_real)((double)x[a] - truth[i]);
        for (j = 0; j < k; j++)
            L[i * k + j] = P[a * n + d->component[j]];
    }
    if (jl_mat_cholesky(L, L, k) != JL_OK)
        return (double)NAN;
    jl_mat_lower_solve(L, e, k);
    for (i = 0; i < k; i++)
        sum += (double)e[i] * (double)e[i];
    return sum;
}

/* --- rows ---------------------------------------------------------------- */

static int columns(const struct diagnostics *d)
{
    return d->M * (d->m + 2) + 1 + (d->known > 0);
}

int diagnostics_room(struct diagnostics *d, const struct data_file *data)
{
    size_t i, count = (size_t)data->rows * (size_t)columns(d);

    d->data = data;
    d->v = calloc(count, sizeof *d->v);
    if (d->v == NULL)
        return complain(data->path, 0, NULL, "no memory for its diagnostics");
    for (i = 0; i < count; i++)
        d->v[i] = (double)NAN;
    return 0;
}

void diagnostics_note(struct diagnostics *d, long row, const jl_imm *imm)
{
    double *v = d->v + row * columns(d);
    int j, a, measured = imm->verdict != JL_MISSING;

    for (j = 0; j < d->M; j++) {
        for (a = 0; a < d->m; a++, v++)
            if (measured)
                *v = (double)imm->nu[j * d->m + a];
        if (measured)
            *v = (double)imm->nis[j];
        v++;
        if (imm->accepted > 0)
            *v = (double)imm->nis_mean[j];
        v++;
    }
    *v++ = imm->verdict == JL_REJECTED;
    if (d->known > 0)
        *v = nees(d, row, imm->xhat, imm->Phat);
}

void diagnostics_write_names(const struct diagnostics *d, FILE *out)
{
    int j, a;

    for (j = 0; j < d->M; j++) {
        for (a = 0; a < d->m; a++)
            fprintf(out, ",nu%d_%d", j, a);
        fprintf(out, ",nis%d,nis_mean%d", j, j);
    }
    fputs(d->known > 0 ? ",rejected,nees" : ",rejected", out);
}

/* Of a measurement too large to be used the nis is no number either. */
void diagnostics_write(const struct diagnostics *d, long row, FILE *out)
{
    const double *v = d->v + row * columns(d);
    int i;

    for (i = 0; i < columns(d); i++)
        if (isfinite(v[i]))
            fprintf(out, ",%.17g", v[i]);
        else
            fputs(",nan", out);
}
