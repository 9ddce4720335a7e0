#include "pair.h"

#include <stdio.h>
#include <string.h>

#define PATIENCE_US 30000000L
#define LATE_US 3000000L        /* two dozen of the longest repetitions     */
#define AHEAD 4                 /* messages sent before the first is awaited */

const fault_set pair_sets[PAIR_SETS] = {
    { "drop 10%", { 10, 0, 0, 0, 0, 0 }, 1 },
    { "drop 30%", { 30, 0, 0, 0, 0, 0 }, 1 },
    { "repeat 10%", { 0, 10, 0, 0, 0, 0 }, 1 },
    { "repeat 30%", { 0, 30, 0, 0, 0, 0 }, 1 },
    { "reorder 10%", { 0, 0, 10, 0, 0, 0 }, 1 },
    { "reorder 30%", { 0, 0, 30, 0, 0, 0 }, 1 },
    { "cut 10%", { 0, 0, 0, 10, 0, 0 }, 1 },
    { "cut 30%", { 0, 0, 0, 30, 0, 0 }, 1 },
    { "corrupt 10%", { 0, 0, 0, 0, 10, 0 }, 1 },
    { "corrupt 30%", { 0, 0, 0, 0, 30, 0 }, 1 },
    { "delay 10%", { 0, 0, 0, 0, 0, 10 }, 2000 },
    { "delay 30%", { 0, 0, 0, 0, 0, 30 }, 2000 },
    { "all 10%", { 10, 10, 10, 10, 10, 10 }, 2000 },
    { "all 30%", { 30, 30, 30, 30, 30, 30 }, 2000 }
};

/* In thousandths of all, for both directions together. */
static const int share[PAIR_SETS] = {
    80, 8, 297, 260, 80, 40, 80, 8, 80, 8, 30, 20, 8, 1
};

long pair_messages(int set)
{
    return PAIR_ALL / 1000 * share[set];
}

/* Message `number` of a direction: mostly short, at times of several pieces. */
static int fill(unsigned char *msg, int node, long number)
{
    unsigned r = ((unsigned)number * 2U + (unsigned)node + 1U) * 2654435761U;
    int len, i;

    r ^= r >> 15;
    r *= 2246822519U;
    r ^= r >> 13;
    len = (int)(r >> 8) % (r % 16 == 0 ? PAIR_MAX_LEN + 1 : 64);
    for (i = 0; i < len; i++) {
        r = r * 1664525U + 1013904223U;
        msg[i] = (unsigned char)(r >> 24);
    }
    return len;
}

static int send_one(int node, long number, jl_chan *to)
{
    unsigned char msg[PAIR_MAX_LEN];
    int len = fill(msg, node, number);
    int status = jl_chan_send(to, msg, len, PATIENCE_US);

    if (status == JL_OK)
        return 0;
    fprintf(stderr, "node %d cannot send message %ld: %s\n", node, number,
            jl_status_text(status));
    return 1;
}

static int receive_one(int node, long number, jl_chan *from)
{
    unsigned char msg[PAIR_MAX_LEN], want[PAIR_MAX_LEN];
    int expected = fill(want, 1 - node, number);
    int len = jl_chan_recv(from, msg, (int)sizeof msg, PATIENCE_US);

    if (len == expected && memcmp(msg, want, (size_t)len) == 0)
        return 0;
    if (len < 0) {
        fprintf(stderr, "node %d waits in vain for message %ld: %s\n", node,
                number, jl_status_text(len));
        if (len == JL_ETIMEOUT
            && jl_chan_recv(from, msg, (int)sizeof msg, LATE_US) >= 0)
            fprintf(stderr, "node %d: it came later\n", node);
    } else
        fprintf(stderr, "node %d: %d octets came where message %ld of %d is "
                "due\n", node, len, number, expected);
    return 1;
}

int pair_body(int node, long n, jl_chan *to, jl_chan *from)
{
    long sent = 0, got;

    for (got = 0; got < n; got++) {
        for (; sent < n && sent < got + AHEAD; sent++)
            if (send_one(node, sent, to) != 0)
                return 1;
        if (receive_one(node, got, from) != 0)
            return 1;
    }
    return 0;
}

void pair_explain(int node, const jl_link *link, const fault *f, jl_u32 now)
{
    const jl_link_count *c = &link->count;

    fprintf(stderr,
            "node %d: session %08x, the other's %08x, up %d, failed: %s, "
            "heard %u us ago\n"
            "  out_first %u, next %u, high %u, end %u; sent %u us ago, wait %u, "
            "heeded %d\n"
            "  in_next %u, held %d, len %d, gap %d, room_lacked %d\n"
            "  sent %lu, resent %lu, acks %lu, received %lu, doubled %lu, "
            "early %lu, refused %lu, stale %lu\n"
            "  faults: %lu put, %lu got, %lu crowded\n",
            node, (unsigned)link->config.session, (unsigned)link->peer,
            link->up, jl_status_text(link->failed),
            (unsigned)(now - link->heard_at),
            (unsigned)link->out_first, (unsigned)link->out_next,
            (unsigned)link->out_high, (unsigned)link->out_end,
            (unsigned)(now - link->sent_at), (unsigned)link->wait_us,
            link->heeded,
            (unsigned)link->in_next, link->in_held, link->in_len, link->in_gap,
            link->room_lacked,
            c->sent, c->resent, c->acks, c->received, c->doubled, c->early,
            c->refused, c->stale,
            f->put, f->got, f->crowded);
}

void pair_add(struct pair_result *result, const jl_link_count *count,
              const fault *f)
{
    int kind;

    result->sent += count->sent;
    result->resent += count->resent;
    result->put += f->put;
    for (kind = 0; kind < FAULT_KINDS; kind++)
        result->befell[kind] += f->count[kind];
}

int pair_faults_were_real(const fault_set *set,
                          const struct pair_result *result)
{
    int kind;

    for (kind = 0; kind < FAULT_KINDS; kind++)
        if ((set->percent[kind] > 0) != (result->befell[kind] > 0))
            return 0;
    return 1;
}

void pair_print_head(const char *port)
{
    printf("%s\n%-12s %8s %9s %9s %9s %8s %9s\n", port, "faults", "messages",
           "pieces", "resent", "datagrams", "seconds", "msg/s");
}

void pair_print(const fault_set *set, const struct pair_result *result)
{
    printf("%-12s %8ld %9lu %9lu %9lu %8.2f %9.0f\n", set->name,
           result->messages, result->sent, result->resent, result->put,
           result->seconds, (double)result->messages / result->seconds);
    fflush(stdout);
}
