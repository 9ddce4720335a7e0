#include "conform.h"

#include <stdatomic.h>
#include <stdio.h>

#define MAX_LEN 4096
#define NO_DATA (-1)

const conform_port *port;
static atomic_int failures;            /* PEs may be threads */

void conform_fail(const char *file, int line, const char *what, long value)
{
    fprintf(stderr, "%s:%d: not %s: it is %ld\n", file, line, what, value);
    atomic_fetch_add(&failures, 1);
}

int conform_failures(void)
{
    return atomic_load(&failures);
}

void conform_fill(unsigned char *msg, int len, unsigned number)
{
    int i;

    for (i = 0; i < len; i++)
        msg[i] = (unsigned char)((number * 2654435761U + (unsigned)i * 40503U)
                                 >> 11);
}

int conform_same(const unsigned char *msg, int len, unsigned number)
{
    unsigned char want[MAX_LEN];
    int i;

    conform_fill(want, len, number);
    for (i = 0; i < len; i++)
        if (msg[i] != want[i])
            return 0;
    return 1;
}

unsigned conform_random(unsigned *state)
{
    *state = *state * 1664525U + 1013904223U;
    return *state >> 8;
}

/* --- what the bodies are made of ----------------------------------------- */

static int send_number(int from, int to, int len, unsigned number,
                       long timeout_us)
{
    unsigned char msg[MAX_LEN];

    conform_fill(msg, len, number);
    return jl_chan_send(port->tx(from, to), msg, len, timeout_us);
}

/* Receive a message and look into it.
 * Returns its length, recv's error, or NO_DATA - 1000 for wrong contents. */
static int recv_number(int from, int to, unsigned number, long timeout_us)
{
    unsigned char msg[MAX_LEN + 1];
    int len;

    msg[port->max_len] = 0xa5;
    len = jl_chan_recv(port->rx(from, to), msg, port->max_len, timeout_us);
    if (len >= 0 && !conform_same(msg, len, number))
        return NO_DATA - 1000;
    if (msg[port->max_len] != 0xa5)
        return NO_DATA - 1001;
    return len;
}

/* A step that `from` has reached and `to` waits for. */
static int signal_to(int from, int to)
{
    return jl_chan_send(port->tx(from, to), NULL, 0, LONG_US);
}

static int await(int from, int to)
{
    return jl_chan_recv(port->rx(from, to), NULL, 0, LONG_US);
}

/* Let at least us microseconds of the port's time pass: nothing is ever sent
 * from PE 2 to PE `me` in a case that uses this. */
static int let_pass(int me, long us)
{
    return jl_chan_recv(port->rx(2, me), NULL, 0, us);
}

/* Keep PE 2 until the others are done, so that its channels stay open. */
static void stay(void)
{
    jl_chan *from[2];
    int i, n = 2;

    from[0] = port->rx(0, 2);
    from[1] = port->rx(1, 2);
    while (n > 0) {
        i = jl_chan_wait(from, n, LONG_US);
        EXPECT(i, >=, 0);
        EXPECT(jl_chan_recv(from[i], NULL, 0, 0), ==, JL_ECLOSED);
        from[i] = from[--n];
    }
}

/* --- points 1 and 2: order, wholeness, lengths --------------------------- */

static void all_lengths(int pe)
{
    int len;
    unsigned number = 0;

    for (len = 0; len <= port->max_len; len += port->step, number++) {
        if (pe == 0)
            EXPECT(send_number(0, 1, len, number, LONG_US), ==, JL_OK);
        else
            EXPECT(recv_number(0, 1, number, LONG_US), ==, len);
    }
    if (pe == 0)
        EXPECT(send_number(0, 1, port->max_len, number, LONG_US), ==, JL_OK);
    else
        EXPECT(recv_number(0, 1, number, LONG_US), ==, port->max_len);
}

static void order(int pe)
{
    unsigned i, state = 7;

    for (i = 0; i < 20U * (unsigned)port->rounds; i++) {
        int len = (int)(conform_random(&state)
                        % ((unsigned)port->max_len + 1));

        if (pe == 0)
            EXPECT(send_number(0, 1, len, i, LONG_US), ==, JL_OK);
        else
            EXPECT(recv_number(0, 1, i, LONG_US), ==, len);
    }
}

static void forever(int pe)
{
    if (pe == 0) {
        EXPECT(let_pass(0, SHORT_US), ==, JL_ETIMEOUT);
        EXPECT(send_number(0, 1, 3, 1, JL_FOREVER), ==, JL_OK);
        EXPECT(recv_number(1, 0, 2, JL_FOREVER), ==, 0);
    } else if (pe == 1) {
        jl_chan *from = port->rx(0, 1);

        EXPECT(jl_chan_wait(&from, 1, JL_FOREVER), ==, 0);
        EXPECT(recv_number(0, 1, 1, JL_FOREVER), ==, 3);
        EXPECT(send_number(1, 0, 0, 2, JL_FOREVER), ==, JL_OK);
    } else {
        stay();
    }
}

/* --- point 2: too long --------------------------------------------------- */

static void too_long(int pe)
{
    unsigned char msg[MAX_LEN + 1];
    int len = port->max_len;

    if (pe == 0) {
        EXPECT(jl_chan_send(port->tx(0, 1), msg, len + 1, 0), ==, JL_ETOOLONG);
        EXPECT(send_number(0, 1, len, 1, LONG_US), ==, JL_OK);
        EXPECT(send_number(0, 1, 1, 2, LONG_US), ==, JL_OK);
    } else {
        jl_chan *from = port->rx(0, 1);

        EXPECT(jl_chan_recv(from, msg, len - 1, LONG_US), ==, JL_ETOOLONG);
        EXPECT(jl_chan_recv(from, NULL, 0, 0), ==, JL_ETOOLONG);
        EXPECT(jl_chan_wait(&from, 1, 0), ==, 0);
        EXPECT(recv_number(0, 1, 1, 0), ==, len);
        EXPECT(jl_chan_recv(from, NULL, 0, LONG_US), ==, JL_ETOOLONG);
        EXPECT(recv_number(0, 1, 2, LONG_US), ==, 1);
    }
}

/* --- point 3: timeouts --------------------------------------------------- */

static void recv_timeout(int pe)
{
    jl_chan *from;

    if (pe == 0) {
        EXPECT(await(1, 0), ==, 0);
        EXPECT(send_number(0, 1, 5, 1, LONG_US), ==, JL_OK);
        EXPECT(await(1, 0), ==, 0);
        return;
    }
    from = port->rx(0, 1);
    EXPECT(recv_number(0, 1, 1, 0), ==, JL_ETIMEOUT);
    EXPECT(recv_number(0, 1, 1, SHORT_US), ==, JL_ETIMEOUT);
    EXPECT(jl_chan_wait(&from, 1, 0), ==, JL_ETIMEOUT);
    EXPECT(jl_chan_wait(&from, 1, SHORT_US), ==, JL_ETIMEOUT);
    EXPECT(signal_to(1, 0), ==, JL_OK);
    EXPECT(recv_number(0, 1, 1, LONG_US), ==, 5);
    EXPECT(recv_number(0, 1, 1, 0), ==, JL_ETIMEOUT);
    EXPECT(signal_to(1, 0), ==, JL_OK);
}

/* Send until no more is taken while the receiver waits for a word from us on
 * a channel of its own; then every message that was taken must come, and none
 * that was not. */
static void send_timeout(int pe)
{
    int taken = 0, i, status;

    if (pe == 0) {
        for (;;) {
            status = send_number(0, 1, port->max_len, (unsigned)taken,
                                 taken % 2 ? 0 : SHORT_US);
            if (status != JL_OK)
                break;
            taken++;
            EXPECT(taken, <=, 1000);
        }
        EXPECT(status, ==, JL_ETIMEOUT);
        EXPECT(taken, >=, port->slots);
        EXPECT(signal_to(0, 2), ==, JL_OK);
        for (i = 0; i < 3; i++)
            EXPECT(send_number(0, 1, port->max_len, (unsigned)(taken + i),
                               LONG_US), ==, JL_OK);
    } else if (pe == 1) {
        EXPECT(await(2, 1), ==, 0);
        for (i = 0;; i++) {
            status = recv_number(0, 1, (unsigned)i, LONG_US);
            if (status < 0)
                break;
            EXPECT(status, ==, port->max_len);
        }
        EXPECT(status, ==, JL_ECLOSED);
        EXPECT(i, >=, port->slots + 3);
    } else {
        EXPECT(await(0, 2), ==, 0);
        EXPECT(signal_to(2, 1), ==, JL_OK);
    }
}

/* --- point 1: slots, or rendezvous --------------------------------------- */

static void slots_held(int pe)
{
    int i;

    if (pe == 0) {
        for (i = 0; i < port->slots; i++)
            EXPECT(send_number(0, 1, port->max_len, (unsigned)i, 0), ==,
                   JL_OK);
        EXPECT(await(1, 0), ==, 0);
    } else {
        if (port->slots > 0)
            EXPECT(jl_chan_recv(port->rx(0, 1), NULL, 0, LONG_US), ==,
                   JL_ETOOLONG);
        for (i = 0; i < port->slots; i++)
            EXPECT(recv_number(0, 1, (unsigned)i, LONG_US), ==,
                   port->max_len);
        EXPECT(signal_to(1, 0), ==, JL_OK);
    }
}

static void rendezvous(int pe)
{
    if (port->slots > 0)
        return;
    if (pe == 0) {
        /* the receiver is elsewhere: not taken, and never seen again */
        EXPECT(send_number(0, 1, 4, 1, 0), ==, JL_ETIMEOUT);
        EXPECT(send_number(0, 1, 4, 2, SHORT_US), ==, JL_ETIMEOUT);
        EXPECT(signal_to(0, 1), ==, JL_OK);
        /* now it is in recv */
        EXPECT(let_pass(0, SETTLE_US), ==, JL_ETIMEOUT);
        EXPECT(send_number(0, 1, 4, 3, 0), ==, JL_OK);
        /* we are in send, and the receiver comes and looks */
        EXPECT(send_number(0, 1, 4, 4, LONG_US), ==, JL_OK);
        /* a receiver in wait has not taken anything */
        EXPECT(let_pass(0, SETTLE_US), ==, JL_ETIMEOUT);
        EXPECT(send_number(0, 1, 4, 5, 0), ==, JL_ETIMEOUT);
        EXPECT(send_number(0, 1, 4, 6, LONG_US), ==, JL_OK);
    } else if (pe == 1) {
        jl_chan *from = port->rx(0, 1);

        EXPECT(let_pass(1, SETTLE_US), ==, JL_ETIMEOUT);
        EXPECT(jl_chan_wait(&from, 1, 0), ==, 0);
        EXPECT(await(0, 1), ==, 0);
        EXPECT(recv_number(0, 1, 3, LONG_US), ==, 4);
        EXPECT(let_pass(1, SETTLE_US), ==, JL_ETIMEOUT);
        EXPECT(recv_number(0, 1, 4, 0), ==, 4);
        EXPECT(jl_chan_wait(&from, 1, LONG_US), ==, 0);
        EXPECT(recv_number(0, 1, 6, 0), ==, 4);
    } else {
        stay();
    }
}

/* --- point 5: wait ------------------------------------------------------- */

static void wait_first(int pe)
{
    jl_chan *from[2], *back[2];

    if (pe < 2) {
        EXPECT(send_number(pe, 2, 8 + pe, (unsigned)pe, LONG_US), ==, JL_OK);
        EXPECT(await(2, pe), ==, 0);
        return;
    }
    from[0] = back[1] = port->rx(0, 2);
    from[1] = back[0] = port->rx(1, 2);
    EXPECT(jl_chan_wait(&from[0], 1, LONG_US), ==, 0);
    EXPECT(jl_chan_wait(&from[1], 1, LONG_US), ==, 0);
    EXPECT(jl_chan_wait(from, 2, 0), ==, 0);
    EXPECT(jl_chan_wait(back, 2, 0), ==, 0);
    EXPECT(recv_number(0, 2, 0, 0), ==, 8);
    EXPECT(jl_chan_wait(from, 2, 0), ==, 1);
    EXPECT(jl_chan_wait(back, 2, 0), ==, 0);
    EXPECT(recv_number(1, 2, 1, 0), ==, 9);
    EXPECT(jl_chan_wait(from, 2, SHORT_US), ==, JL_ETIMEOUT);
    EXPECT(signal_to(2, 1), ==, JL_OK);
    EXPECT(jl_chan_wait(from, 2, LONG_US), ==, 1);      /* closed */
    EXPECT(jl_chan_recv(from[1], NULL, 0, 0), ==, JL_ECLOSED);
    EXPECT(signal_to(2, 0), ==, JL_OK);
}

/* --- point 6: closing ---------------------------------------------------- */

static void closed_after_drain(int pe)
{
    int i, n = port->slots;

    if (pe == 0) {
        for (i = 0; i < n; i++)
            EXPECT(send_number(0, 1, port->max_len, (unsigned)i, LONG_US), ==,
                   JL_OK);
        return;
    }
    if (pe == 2) {
        EXPECT(await(1, 2), ==, JL_ECLOSED);
        return;
    }
    EXPECT(let_pass(1, 10 * SHORT_US), ==, JL_ETIMEOUT);
    for (i = 0; i < n; i++)
        EXPECT(recv_number(0, 1, (unsigned)i, LONG_US), ==, port->max_len);
    EXPECT(recv_number(0, 1, 0, LONG_US), ==, JL_ECLOSED);
    EXPECT(recv_number(0, 1, 0, 0), ==, JL_ECLOSED);
    EXPECT(recv_number(0, 1, 0, JL_FOREVER), ==, JL_ECLOSED);
}

static void send_to_closed(int pe)
{
    int i, status = JL_OK;

    if (pe == 1)
        return;
    for (i = 0; i < 1000 && status == JL_OK; i++)
        status = send_number(0, 1, 1, 1, LONG_US);
    EXPECT(status, ==, JL_ECLOSED);
    EXPECT(send_number(0, 1, 1, 1, JL_FOREVER), ==, JL_ECLOSED);
    EXPECT(send_number(0, 1, 1, 1, 0), ==, JL_ECLOSED);
}

/* --- traffic ------------------------------------------------------------- */

/* Both rings full, then each side alternates: nobody may wait for ever. */
static void two_ways_full(int pe)
{
    int other = 1 - pe, sent = 0, got = 0, n = 10 * port->rounds;
    int len = port->max_len;

    while (sent < port->slots && sent < n)
        EXPECT(send_number(pe, other, len, (unsigned)sent++, LONG_US), ==,
               JL_OK);
    while (sent < n || got < n) {
        if (pe == 0 && sent < n)
            EXPECT(send_number(0, 1, len, (unsigned)sent++, LONG_US), ==,
                   JL_OK);
        if (got < n)
            EXPECT(recv_number(other, pe, (unsigned)got++, LONG_US), ==, len);
        if (pe == 1 && sent < n)
            EXPECT(send_number(1, 0, len, (unsigned)sent++, LONG_US), ==,
                   JL_OK);
    }
}

/* A list of hops in one order, of which each PE executes its part: free of
 * deadlock even if every hop is a rendezvous. */
static void all_to_all(int pe, int n)
{
    unsigned state = 99, hop = 0;
    int round, from, to;

    for (round = 0; round < port->rounds; round++)
        for (from = 0; from < n; from++)
            for (to = 0; to < n; to++, hop++) {
                int len = (int)(conform_random(&state)
                                % ((unsigned)port->max_len + 1));

                if (from == to)
                    continue;
                if (pe == from)
                    EXPECT(send_number(from, to, len, hop, LONG_US), ==,
                           JL_OK);
                if (pe == to)
                    EXPECT(recv_number(from, to, hop, LONG_US), ==, len);
            }
}

static void all_to_all_2(int pe) { all_to_all(pe, 2); }
static void all_to_all_3(int pe) { all_to_all(pe, 3); }
static void all_to_all_4(int pe) { all_to_all(pe, 4); }
static void all_to_all_5(int pe) { all_to_all(pe, 5); }

/* Whoever has something is served first. */
static void many_to_one(int pe)
{
    jl_chan *from[CONFORM_PES - 1];
    int who[CONFORM_PES - 1], next[CONFORM_PES] = { 0 };
    int i, k, left = CONFORM_PES - 1, n = 5 * port->rounds;

    if (pe > 0) {
        for (k = 0; k < n; k++)
            EXPECT(send_number(pe, 0, pe, (unsigned)k, LONG_US), ==, JL_OK);
        return;
    }
    for (i = 0; i < left; i++) {
        who[i] = i + 1;
        from[i] = port->rx(i + 1, 0);
    }
    while (left > 0) {
        i = jl_chan_wait(from, left, LONG_US);
        EXPECT(i, >=, 0);
        EXPECT(recv_number(who[i], 0, (unsigned)next[who[i]], 0), ==, who[i]);
        if (++next[who[i]] == n) {
            left--;
            from[i] = from[left];
            who[i] = who[left];
        }
    }
}

/* --- counters ------------------------------------------------------------ */

static void counters(int pe)
{
    jl_chan *chan = pe == 0 ? port->tx(0, 1) : port->rx(0, 1);
    unsigned long messages = chan->messages, octets = chan->octets;
    int i;

    EXPECT(chan->max_len, ==, port->max_len);
    EXPECT(chan->slots, ==, port->slots);
    for (i = 1; i <= 10; i++)
        if (pe == 0) {
            EXPECT(send_number(0, 1, port->max_len + 1, 0, 0), ==,
                   JL_ETOOLONG);
            EXPECT(send_number(0, 1, i, 0, LONG_US), ==, JL_OK);
        } else {
            EXPECT(jl_chan_recv(chan, NULL, 0, LONG_US), ==, JL_ETOOLONG);
            EXPECT(recv_number(0, 1, 0, LONG_US), ==, i);
        }
    EXPECT(chan->messages - messages, ==, 10);
    EXPECT(chan->octets - octets, ==, 55);
}

const conform_case conform_cases[] = {
    { "all_lengths", 2, all_lengths },
    { "order", 2, order },
    { "forever", 3, forever },
    { "too_long", 2, too_long },
    { "recv_timeout", 2, recv_timeout },
    { "send_timeout", 3, send_timeout },
    { "slots_held", 2, slots_held },
    { "rendezvous", 3, rendezvous },
    { "wait_first", 3, wait_first },
    { "closed_after_drain", 3, closed_after_drain },
    { "send_to_closed", 2, send_to_closed },
    { "two_ways_full", 2, two_ways_full },
    { "all_to_all_2", 2, all_to_all_2 },
    { "all_to_all_3", 3, all_to_all_3 },
    { "all_to_all_4", 4, all_to_all_4 },
    { "all_to_all_5", 5, all_to_all_5 },
    { "many_to_one", CONFORM_PES, many_to_one },
    { "counters", 2, counters },
    { NULL, 0, NULL }
};
