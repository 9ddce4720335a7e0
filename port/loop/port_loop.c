#include "port_loop.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* Clocks in 64 bits: no deadline is ever far enough to wrap. */
typedef unsigned long long tick;
#define NEVER (~(tick)0)

struct pipe;

struct end {
    jl_chan chan;               /* first: ops get a jl_chan and cast it     */
    struct pipe *pipe;
};

/* One channel.  A rendezvous uses one place as well: the message lies there
 * while its sender is blocked in send. */
struct pipe {
    jl_loop *loop;
    int from, to;
    int places;
    unsigned char *data;        /* [places, max_len]                        */
    int *len;                   /* [places]                                 */
    int first, held;
    struct end tx, rx;
};

enum task { RUNS, SENDS, RECEIVES, WAITS, DONE };

struct pe {
    jl_loop *loop;
    int index;
    pthread_t thread;
    pthread_cond_t turn;
    enum task task;             /* what it is blocked in, RUNS or DONE      */
    jl_chan *const *chans;      /* ... on which channels                    */
    int n;
    tick deadline;
    int deadlocked;
};

/* The mutex guards only the baton and `cancelled`.  All else belongs to the
 * PE that has the baton, and is handed over with it. */
struct jl_loop {
    int n;
    struct pe *pes;             /* [n]                                      */
    struct pipe *pipes;         /* [n,n]; the diagonal is not used          */
    pthread_mutex_t mutex;
    int baton;                  /* index of the PE that runs; n: nobody     */
    int cancelled;
    tick now;
    void (*body)(int pe, void *context);
    void *context;
};

/* --- who can go on ------------------------------------------------------ */

static struct pipe *pipe_of(const jl_chan *chan)
{
    return ((const struct end *)chan)->pipe;
}

static int closed(const struct pipe *p, int pe)
{
    return p->loop->pes[pe].task == DONE;
}

/* The sender need not wait: there is room, or, in a rendezvous, what it put
 * there was taken; or nobody will ever take it. */
static int sendable(const struct pipe *p)
{
    return p->held < p->places || closed(p, p->to);
}

static int receivable(const struct pipe *p)
{
    return p->held > 0 || closed(p, p->from);
}

static int first_receivable(jl_chan *const *chans, int n)
{
    int i;

    for (i = 0; i < n; i++)
        if (receivable(pipe_of(chans[i])))
            return i;
    return -1;
}

static int satisfied(const struct pe *pe)
{
    if (pe->task == SENDS)
        return sendable(pipe_of(pe->chans[0]));
    return first_receivable(pe->chans, pe->n) >= 0;
}

static int can_go_on(const struct pe *pe)
{
    if (pe->task == RUNS || pe->task == DONE)
        return pe->task == RUNS;
    return pe->deadlocked || pe->deadline <= pe->loop->now || satisfied(pe);
}

static void let_time_pass(jl_loop *loop)
{
    tick earliest = NEVER;
    int i;

    for (i = 0; i < loop->n; i++)
        if (loop->pes[i].task != DONE && loop->pes[i].deadline < earliest)
            earliest = loop->pes[i].deadline;
    if (earliest != NEVER) {
        loop->now = earliest;
        return;
    }
    for (i = 0; i < loop->n; i++)
        loop->pes[i].deadlocked = loop->pes[i].task != DONE;
}

/* The PE after `me`, or at last `me` itself, that can go on; n: all done. */
static int next_after(jl_loop *loop, int me)
{
    int done = 0, k;

    for (;;) {
        for (k = 1; k <= loop->n; k++) {
            int i = (me + k) % loop->n;

            if (can_go_on(&loop->pes[i]))
                return i;
            done += loop->pes[i].task == DONE;
        }
        if (done == loop->n)
            return loop->n;
        done = 0;
        let_time_pass(loop);
    }
}

/* --- the baton ---------------------------------------------------------- */

static void hand_over(jl_loop *loop, int to)
{
    loop->baton = to;
    if (to < loop->n)
        pthread_cond_signal(&loop->pes[to].turn);
}

static void await_turn(struct pe *pe)
{
    while (pe->loop->baton != pe->index && !pe->loop->cancelled)
        pthread_cond_wait(&pe->turn, &pe->loop->mutex);
}

static void pass_baton(struct pe *pe)
{
    jl_loop *loop = pe->loop;
    int next = next_after(loop, pe->index);

    if (next == pe->index)
        return;
    pthread_mutex_lock(&loop->mutex);
    hand_over(loop, next);
    if (pe->task != DONE)
        await_turn(pe);
    pthread_mutex_unlock(&loop->mutex);
}

/* Block in `task` until it is satisfied: JL_OK; else why it never was.  A
 * timeout of 0 has a deadline as well, 1 us from now and already reached. */
static int block(struct pe *pe, enum task task, jl_chan *const *chans, int n,
                 long timeout_us)
{
    int status;

    pe->task = task;
    pe->chans = chans;
    pe->n = n;
    pe->deadlocked = 0;
    if (timeout_us == 0)
        pe->loop->now++;
    pe->deadline = timeout_us == JL_FOREVER ? NEVER
                                            : pe->loop->now + (tick)timeout_us;
    pass_baton(pe);
    if (pe->deadlocked)
        status = JL_EDEADLOCK;
    else
        status = satisfied(pe) ? JL_OK : JL_ETIMEOUT;
    pe->task = RUNS;
    return status;
}

/* --- the operations of a channel ---------------------------------------- */

static void put(struct pipe *p, const unsigned char *msg, int len)
{
    int place = (p->first + p->held) % p->places;

    if (len > 0)
        memcpy(p->data + (size_t)place * (size_t)p->tx.chan.max_len, msg,
               (size_t)len);
    p->len[place] = len;
    p->held++;
}

static int receiver_waits(const struct pipe *p)
{
    const struct pe *pe = &p->loop->pes[p->to];

    return pe->task == RECEIVES && pe->chans[0] == &p->rx.chan
        && !pe->deadlocked;
}

/* The message lies in the place only while its sender is in here. */
static int meet(struct pe *pe, jl_chan *chan, const unsigned char *msg, int len,
                long timeout_us)
{
    struct pipe *p = pipe_of(chan);
    int status;

    if (timeout_us == 0 && !receiver_waits(p)) {
        p->loop->now++;
        pass_baton(pe);
        return JL_ETIMEOUT;
    }
    put(p, msg, len);
    status = block(pe, SENDS, &chan, 1, timeout_us);
    if (p->held == 0)
        return JL_OK;
    p->held = 0;
    return status == JL_OK ? JL_ECLOSED : status;
}

static int loop_send(jl_chan *chan, const unsigned char *msg, int len,
                     long timeout_us)
{
    struct pipe *p = pipe_of(chan);
    struct pe *pe = &p->loop->pes[p->from];
    int status;

    if (closed(p, p->to))
        return JL_ECLOSED;
    if (chan->slots == 0)
        return meet(pe, chan, msg, len, timeout_us);
    if (!sendable(p)) {
        status = block(pe, SENDS, &chan, 1, timeout_us);
        if (status != JL_OK)
            return status;
        if (closed(p, p->to))
            return JL_ECLOSED;
    }
    put(p, msg, len);
    return JL_OK;
}

static int loop_recv(jl_chan *chan, unsigned char *msg, int cap,
                     long timeout_us)
{
    struct pipe *p = pipe_of(chan);
    int status, len;

    if (!receivable(p)) {
        status = block(&p->loop->pes[p->to], RECEIVES, &chan, 1, timeout_us);
        if (status != JL_OK)
            return status;
    }
    if (p->held == 0)
        return JL_ECLOSED;
    len = p->len[p->first];
    if (len > cap)
        return JL_ETOOLONG;
    if (len > 0)
        memcpy(msg, p->data + (size_t)p->first * (size_t)chan->max_len,
               (size_t)len);
    p->first = (p->first + 1) % p->places;
    p->held--;
    return len;
}

static int loop_wait(jl_chan *const *chans, int n, long timeout_us)
{
    struct pipe *p = pipe_of(chans[0]);
    int i = first_receivable(chans, n);
    int status;

    if (i >= 0)
        return i;
    status = block(&p->loop->pes[p->to], WAITS, chans, n, timeout_us);
    return status == JL_OK ? first_receivable(chans, n) : status;
}

static const jl_chan_ops loop_ops = { loop_send, loop_recv, loop_wait };

/* --- the loop ----------------------------------------------------------- */

static int pipe_init(jl_loop *loop, int from, int to, int max_len, int slots)
{
    struct pipe *p = &loop->pipes[from * loop->n + to];

    p->loop = loop;
    p->from = from;
    p->to = to;
    p->places = slots > 0 ? slots : 1;
    jl_chan_init(&p->tx.chan, &loop_ops, max_len, slots);
    jl_chan_init(&p->rx.chan, &loop_ops, max_len, slots);
    p->tx.pipe = p;
    p->rx.pipe = p;
    /* One octet more, for malloc(0) may be NULL. */
    p->data = malloc((size_t)p->places * (size_t)max_len + 1);
    p->len = calloc((size_t)p->places, sizeof *p->len);
    return p->data != NULL && p->len != NULL;
}

jl_loop *jl_loop_new(int n, int max_len, int slots)
{
    jl_loop *loop;
    int i, ok = 1;

    if (n < 1 || n > 1024 || max_len < 0 || slots < 0)
        return NULL;
    loop = calloc(1, sizeof *loop);
    if (loop == NULL)
        return NULL;
    loop->n = n;
    loop->baton = n;
    pthread_mutex_init(&loop->mutex, NULL);
    loop->pes = calloc((size_t)n, sizeof *loop->pes);
    loop->pipes = calloc((size_t)n * (size_t)n, sizeof *loop->pipes);
    if (loop->pes == NULL || loop->pipes == NULL) {
        jl_loop_free(loop);
        return NULL;
    }
    for (i = 0; i < n; i++) {
        loop->pes[i].loop = loop;
        loop->pes[i].index = i;
        pthread_cond_init(&loop->pes[i].turn, NULL);
    }
    for (i = 0; i < n * n && ok; i++)
        if (i / n != i % n)
            ok = pipe_init(loop, i / n, i % n, max_len, slots);
    if (!ok) {
        jl_loop_free(loop);
        return NULL;
    }
    return loop;
}

void jl_loop_free(jl_loop *loop)
{
    int i;

    if (loop == NULL)
        return;
    for (i = 0; loop->pipes != NULL && i < loop->n * loop->n; i++) {
        free(loop->pipes[i].data);
        free(loop->pipes[i].len);
    }
    for (i = 0; loop->pes != NULL && loop->pipes != NULL && i < loop->n; i++)
        pthread_cond_destroy(&loop->pes[i].turn);
    pthread_mutex_destroy(&loop->mutex);
    free(loop->pipes);
    free(loop->pes);
    free(loop);
}

static struct pipe *pipe_at(jl_loop *loop, int from, int to)
{
    if (from < 0 || from >= loop->n || to < 0 || to >= loop->n || from == to)
        return NULL;
    return &loop->pipes[from * loop->n + to];
}

jl_chan *jl_loop_tx(jl_loop *loop, int from, int to)
{
    struct pipe *p = pipe_at(loop, from, to);

    return p == NULL ? NULL : &p->tx.chan;
}

jl_chan *jl_loop_rx(jl_loop *loop, int from, int to)
{
    struct pipe *p = pipe_at(loop, from, to);

    return p == NULL ? NULL : &p->rx.chan;
}

jl_u32 jl_loop_now(const jl_loop *loop)
{
    return (jl_u32)(loop->now & 0xffffffffUL);
}

static void *pe_thread(void *arg)
{
    struct pe *pe = arg;
    jl_loop *loop = pe->loop;
    int cancelled;

    pthread_mutex_lock(&loop->mutex);
    await_turn(pe);
    cancelled = loop->cancelled;
    pthread_mutex_unlock(&loop->mutex);
    if (cancelled)
        return NULL;
    loop->body(pe->index, loop->context);
    pe->task = DONE;
    pass_baton(pe);
    return NULL;
}

int jl_loop_run(jl_loop *loop, void (*body)(int pe, void *context),
                void *context)
{
    int i, threads;

    loop->body = body;
    loop->context = context;
    loop->cancelled = 0;
    loop->baton = loop->n;
    for (i = 0; i < loop->n * loop->n; i++)
        loop->pipes[i].held = 0;
    for (i = 0; i < loop->n; i++)
        loop->pes[i].task = RUNS;
    for (threads = 0; threads < loop->n; threads++)
        if (pthread_create(&loop->pes[threads].thread, NULL, pe_thread,
                           &loop->pes[threads]) != 0)
            break;
    pthread_mutex_lock(&loop->mutex);
    if (threads == loop->n)
        hand_over(loop, 0);
    loop->cancelled = threads < loop->n;
    for (i = 0; i < threads && loop->cancelled; i++)
        pthread_cond_signal(&loop->pes[i].turn);
    pthread_mutex_unlock(&loop->mutex);
    for (i = 0; i < threads; i++)
        pthread_join(loop->pes[i].thread, NULL);
    return threads == loop->n ? JL_OK : JL_EIO;
}
