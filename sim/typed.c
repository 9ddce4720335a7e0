#include "typed.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "complain.h"
#include "hush.h"
#include "jumplink/mat.h"
#include "jumplink_estimate.h"
#include "jumplink_measurement.h"

void typed_channel(char *channel, const char *run, const char *kind)
{
    snprintf(channel, TYPED_CHANNEL_MAX, "JL.%.16s.%.12s",
             run != NULL ? run : "jumplink", kind);
}

void typed_open(struct typed *t, const struct model *model,
                const struct data_file *data, const struct options *options)
{
    int saved, n = model->n, room = n + JL_PACKED(n) + model->M + model->m;

    memset(t, 0, sizeof *t);
    if (options->lcm_url == NULL)
        return;
    t->data = data;
    t->m = model->m;
    t->n = n;
    t->M = model->M;
    t->answers_only = options->live != NULL;
    typed_channel(t->measurement, options->run, "measurement");
    typed_channel(t->estimate, options->run, "estimate");
    t->real = calloc((size_t)room, sizeof *t->real);
    saved = hush_begin();
    if (t->real != NULL)
        t->lcm = lcm_create(options->lcm_url);
    hush_end(saved);
    if (t->lcm == NULL)
        complain(options->lcm_url, 0, NULL, "the run goes on without typed "
                 "copies: %s", t->real == NULL ? "no memory"
                 : "LCM cannot be used");
}

void typed_close(struct typed *t)
{
    if (t->failed > 0)
        complain("LCM", 0, NULL, "%lu typed copies could not be sent",
                 t->failed);
    if (t->lcm != NULL)
        lcm_destroy(t->lcm);
    free(t->real);
    memset(t, 0, sizeof *t);
}

/* Rows of a file are counted from 1; those off the network have a number. */
static int64_t seq_of(const struct typed *t, long row)
{
    return t->answers_only ? t->data->line[row] : row + 1;
}

void typed_measurement(struct typed *t, long row, const jl_real *z)
{
    jumplink_measurement message;
    int i;

    if (t->lcm == NULL || t->answers_only)
        return;
    message.seq = seq_of(t, row);
    message.time = t->data->time[row];
    message.record = t->data->run != NULL ? (int32_t)t->data->run[row] : 0;
    message.arrived = z != NULL;
    message.m = t->m;
    message.z = t->real;
    for (i = 0; i < t->m; i++)
        message.z[i] = z != NULL ? (double)z[i] : (double)NAN;
    if (jumplink_measurement_publish(t->lcm, t->measurement, &message) != 0)
        t->failed++;
}

void typed_estimate(struct typed *t, long row, const jl_estimate *answer)
{
    jumplink_estimate message;
    double *to = t->real;
    int i, j, n = answer->status == JL_OK ? t->n : 0;

    if (t->lcm == NULL)
        return;
    message.seq = seq_of(t, row);
    message.time = t->data->time[row];
    message.status = answer->status;
    message.loglik = n > 0 ? (double)answer->loglik : 0;
    message.n = n;
    message.n_P = answer->P != NULL ? JL_PACKED(n) : 0;
    message.M = n > 0 ? t->M : 0;
    message.x = to;
    for (i = 0; i < n; i++)
        *to++ = (double)answer->x[i];
    message.P = to;
    for (i = 0; i < n && message.n_P > 0; i++)
        for (j = i; j < n; j++)
            *to++ = (double)answer->P[i * n + j];
    message.mu = to;
    for (j = 0; j < message.M; j++)
        *to++ = (double)answer->mu[j];
    if (jumplink_estimate_publish(t->lcm, t->estimate, &message) != 0)
        t->failed++;
}
