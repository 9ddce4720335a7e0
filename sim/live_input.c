#include "live_input.h"

#include <math.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clock.h"
#include "complain.h"
#include "hush.h"
#include "jumplink_measurement.h"

/* --- the record ---------------------------------------------------------- */

static int resize(void *array, long rows, size_t octets)
{
    void *old, *larger;

    memcpy(&old, array, sizeof old);
    larger = reallocarray(old, (size_t)rows, octets);
    if (larger == NULL)
        return -1;
    memcpy(array, &larger, sizeof larger);
    return 0;
}

static int make_room(struct live_input *live)
{
    struct data_file *data = &live->data;
    long rows = live->room == 0 ? 1024 : 2 * live->room;

    if (data->rows < live->room)
        return 0;
    if (resize(&data->time_text, rows, sizeof *data->time_text) != 0
        || resize(&data->time, rows, sizeof *data->time) != 0
        || resize(&data->z, rows, (size_t)data->m * sizeof *data->z) != 0
        || resize(&data->run, rows, sizeof *data->run) != 0
        || resize(&data->line, rows, sizeof *data->line) != 0)
        return -1;
    live->room = rows;
    return 0;
}

/* The shortest text that reads back as the same number. */
static char *number_text(double value)
{
    char text[40];
    int digits;

    for (digits = 15; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, value);
        if (!(strtod(text, NULL) < value || strtod(text, NULL) > value))
            break;
    }
    return strdup(text);
}

/* z [m], or NULL: it did not arrive. */
static void append(struct live_input *live, int64_t seq, double time,
                   int32_t record, const double *z)
{
    struct data_file *data = &live->data;
    long row = data->rows;
    int i;

    if (live->no_memory || make_room(live) != 0
        || (data->time_text[row] = number_text(time)) == NULL) {
        live->no_memory = 1;
        return;
    }
    data->line[row] = (long)seq;
    data->time[row] = time;
    data->run[row] = record;
    for (i = 0; i < data->m; i++)
        data->z[row * data->m + i] = (jl_real)(z != NULL ? z[i] : (double)NAN);
    data->rows++;
}

/* --- what may become a row ----------------------------------------------- */

__attribute__((format(printf, 2, 3)))
static void refuse(struct live_input *live, const char *format, ...)
{
    va_list arguments;

    if (live->count.refused++ > 0)
        return;
    va_start(arguments, format);
    vsnprintf(live->refusal, sizeof live->refusal, format, arguments);
    va_end(arguments);
}

static int usable(const double *z, int m)
{
    int i;

    for (i = 0; i < m; i++)
        if (!(fabs(z[i]) <= (double)JL_LARGE))
            return 0;
    return 1;
}

/* The rows between the last one and this. */
static void fill(struct live_input *live, int64_t lost,
                 const jumplink_measurement *next, int same_record)
{
    double from = live->data.time[live->data.rows - 1];
    int64_t i;

    live->count.lost += (unsigned long)lost;
    for (i = 1; same_record && i <= lost; i++) {
        append(live, live->last + i, from + (next->time - from) * (double)i
               / (double)(lost + 1), next->record, NULL);
        live->count.filled++;
    }
}

static void take(struct live_input *live, const jumplink_measurement *message)
{
    const struct data_file *data = &live->data;
    long before = data->rows - 1;
    int begun = before >= 0;
    int same_record = begun && data->run[before] == message->record;
    double from = begun ? data->time[before] : 0, over = message->time - from;
    long long seq = message->seq;

    if (seq < 0)
        refuse(live, "a number below 0");
    else if (begun && seq <= live->last)
        live->count.late++;
    else if (begun && seq - live->last - 1 > LIVE_GAP_MAX)
        refuse(live, "number %lld is too far from number %lld", seq,
               (long long)live->last);
    else if (!isfinite(message->time))
        refuse(live, "number %lld has a time that is not finite", seq);
    else if (same_record && !(over > 0))
        refuse(live, "number %lld has a time that is not after %g", seq, from);
    else if (same_record && over > (double)JL_LARGE)
        refuse(live, "number %lld has a time that is out of range", seq);
    else if (message->arrived && !usable(message->z, message->m))
        refuse(live, "number %lld is not finite, or out of range", seq);
    else {
        if (begun)
            fill(live, seq - live->last - 1, message, same_record);
        append(live, seq, message->time, message->record,
               message->arrived ? message->z : NULL);
        live->count.received++;
        live->last = seq;
    }
}

/* --- from the network ---------------------------------------------------- */

/* How many components a message says to have, big-endian before the first;
 * -1: it is too short to say.  The decoder that lcm-gen makes believes this
 * number and takes memory for it: look first. */
static int components(const unsigned char *octets, size_t size)
{
    static const jumplink_measurement none;
    size_t head = (size_t)jumplink_measurement_encoded_size(&none);
    const unsigned char *p = octets + head - 4;
    unsigned m;

    if (size < head)
        return -1;
    m = (unsigned)p[0] << 24 | (unsigned)p[1] << 16 | (unsigned)p[2] << 8
        | p[3];
    return m <= 0xffff && size == head + 8 * (size_t)m ? (int)m : -1;
}

static void on_message(const lcm_recv_buf_t *buf, const char *channel,
                       void *context)
{
    struct live_input *live = context;
    jumplink_measurement message;
    int m = components(buf->data, buf->data_size);

    (void)channel;
    memset(&message, 0, sizeof message);
    if (m < 0 || jumplink_measurement_decode(buf->data, 0,
                                             (int)buf->data_size,
                                             &message) < 0)
        refuse(live, "%u octets that are no measurement", buf->data_size);
    else if (message.arrived && m != live->model->m)
        refuse(live, "number %lld has %d measurements, but %s needs %d",
               (long long)message.seq, m, live->model->path, live->model->m);
    else
        take(live, &message);
    jumplink_measurement_decode_cleanup(&message);
}

static int readable(const struct live_input *live, long timeout_us)
{
    struct pollfd fd = { lcm_get_fileno(live->lcm), POLLIN, 0 };

    return poll(&fd, 1, (int)((timeout_us + 999) / 1000)) > 0;
}

int live_row(struct live_input *live, long row, long timeout_us)
{
    if (row < live->data.rows)
        return JL_OK;
    if (live->awaited != row) {
        live->awaited = row;
        live->since_us = clock_us();
    }
    if (live->stop != NULL && live->stop())
        return LIVE_END;
    if (readable(live, timeout_us) && lcm_handle(live->lcm) != 0)
        return JL_EIO;
    if (live->no_memory)
        return JL_ENOMEM;
    if (row < live->data.rows)
        return JL_OK;
    return clock_us() - live->since_us
               < (double)(row == 0 ? live->start_us : live->idle_us)
        ? JL_ETIMEOUT : LIVE_END;
}

/* --- open and close ------------------------------------------------------ */

/* Returns NULL, or why it cannot. */
static const char *subscribe(struct live_input *live, const char *url)
{
    static const char buffer[] = "recv_buf_size=4194304";
    char more[300] = "";
    lcm_subscription_t *sub;

    /* LCM's own buffer loses a burst. */
    if (strstr(url, "recv_buf_size=") == NULL)
        snprintf(more, sizeof more, "%s%c%s", url, strchr(url, '?') != NULL
                 ? '&' : '?', buffer);
    live->lcm = lcm_create(more[0] != '\0' ? more : url);
    if (live->lcm == NULL)
        return "no multicast route (ip route add 224.0.0.0/4 dev lo), or a "
            "bad LCM address";
    sub = lcm_subscribe(live->lcm, live->data.path, on_message, live);
    if (sub == NULL)
        return "LCM does not hear itself: does a firewall drop multicast?";
    lcm_subscription_set_queue_capacity(sub, 0);
    return NULL;
}

static int listen_to(struct live_input *live, const char *url)
{
    int saved = hush_begin();
    const char *why = subscribe(live, url);

    hush_end(saved);
    return why == NULL ? 0
        : complain(url, 0, NULL, "LCM cannot be used: %s", why);
}

int live_open(struct live_input *live, const struct model *model,
              const struct options *options, long idle_us)
{
    char channel[TYPED_CHANNEL_MAX];

    memset(live, 0, sizeof *live);
    typed_channel(channel, options->run, "measurement");
    live->model = model;
    live->start_us = options->start_us;
    live->idle_us = idle_us;
    live->awaited = -1;
    live->data.m = model->m;
    live->data.path = strdup(channel);
    live->data.time_name = strdup("t_s");
    if (live->data.path == NULL || live->data.time_name == NULL
        || make_room(live) != 0)
        complain(channel, 0, NULL, "no memory for its measurements");
    else if (listen_to(live, options->lcm_url) == 0)
        return 0;
    live_close(live);
    return -1;
}

void live_finish(struct live_input *live)
{
    struct data_file *data = &live->data;
    long row;

    if (live->lcm != NULL)
        lcm_destroy(live->lcm);
    live->lcm = NULL;
    for (row = 0; row < data->rows && data->run[row] == 0; row++)
        ;
    if (row == data->rows) {
        free(data->run);
        data->run = NULL;
    }
}

void live_close(struct live_input *live)
{
    if (live->lcm != NULL)
        lcm_destroy(live->lcm);
    live->lcm = NULL;
    data_free(&live->data);
}
