/* The object, and a run of it. */
#include "threads_parts.h"

#include <sched.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define MAX_PES 256

/* The cores that this process may use. */
static int count_cores(void)
{
    cpu_set_t set;

    if (sched_getaffinity(0, sizeof set, &set) == 0)
        return CPU_COUNT(&set);
    return (int)sysconf(_SC_NPROCESSORS_ONLN);  /* more than fit in a set */
}

/* --- new and free -------------------------------------------------------- */

static void *new_lines(size_t size)
{
    void *lines = aligned_alloc(LINE, (size + LINE - 1) / LINE * LINE);

    if (lines != NULL)
        memset(lines, 0, size);
    return lines;
}

static void pe_init(jl_threads *threads, int index)
{
    struct pe *pe = &threads->pes[index];
    pthread_condattr_t attributes;

    pe->threads = threads;
    pe->index = index;
    pthread_mutex_init(&pe->mutex, NULL);
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&pe->woken, &attributes);
    pthread_condattr_destroy(&attributes);
}

static int ring_init(struct ring *r, struct pe *from, struct pe *to,
                     int max_len, int slots)
{
    const jl_chan_ops *ops = slots > 0 ? &jli_ring_ops : &jli_meet_ops;

    jl_chan_init(&r->tx.chan, ops, max_len, slots);
    jl_chan_init(&r->rx.chan, ops, max_len, slots);
    r->tx.ring = r->rx.ring = r;
    r->tx.pe = from;
    r->rx.pe = to;
    if (slots == 0)
        return 1;
    r->places = (unsigned)slots;
    r->stride = (sizeof(int) + (size_t)max_len + LINE - 1) / LINE * LINE;
    r->data = new_lines(r->places * r->stride);
    return r->data != NULL;
}

jl_threads *jl_threads_new(int n, int max_len, int slots)
{
    jl_threads *threads;
    int i, ok = 1;

    if (n < 1 || n > MAX_PES || max_len < 0 || slots < 0)
        return NULL;
    threads = calloc(1, sizeof *threads);
    if (threads == NULL)
        return NULL;
    threads->n = n;
    threads->pes = new_lines((size_t)n * sizeof *threads->pes);
    threads->rings = new_lines((size_t)n * (size_t)n * sizeof *threads->rings);
    if (threads->pes == NULL || threads->rings == NULL) {
        free(threads->pes);
        free(threads->rings);
        free(threads);
        return NULL;
    }
    pthread_mutex_init(&threads->start, NULL);
    for (i = 0; i < n; i++)
        pe_init(threads, i);
    for (i = 0; i < n * n && ok; i++)
        if (i / n != i % n)
            ok = ring_init(&threads->rings[i], &threads->pes[i / n],
                           &threads->pes[i % n], max_len, slots);
    if (!ok) {
        jl_threads_free(threads);
        return NULL;
    }
    return threads;
}

void jl_threads_free(jl_threads *threads)
{
    int i;

    if (threads == NULL)
        return;
    for (i = 0; i < threads->n * threads->n; i++)
        free(threads->rings[i].data);
    for (i = 0; i < threads->n; i++) {
        pthread_cond_destroy(&threads->pes[i].woken);
        pthread_mutex_destroy(&threads->pes[i].mutex);
    }
    pthread_mutex_destroy(&threads->start);
    free(threads->rings);
    free(threads->pes);
    free(threads);
}

static struct ring *ring_at(jl_threads *threads, int from, int to)
{
    if (from < 0 || from >= threads->n || to < 0 || to >= threads->n
        || from == to)
        return NULL;
    return &threads->rings[from * threads->n + to];
}

jl_chan *jl_threads_tx(jl_threads *threads, int from, int to)
{
    struct ring *r = ring_at(threads, from, to);

    return r == NULL ? NULL : &r->tx.chan;
}

jl_chan *jl_threads_rx(jl_threads *threads, int from, int to)
{
    struct ring *r = ring_at(threads, from, to);

    return r == NULL ? NULL : &r->rx.chan;
}

/* --- a run --------------------------------------------------------------- */

static void open_end(struct end *end)
{
    end->place = end->seen = 0;
    atomic_store(&end->count, 0);
}

static void open_all(jl_threads *threads)
{
    int i;

    for (i = 0; i < threads->n * threads->n; i++) {
        open_end(&threads->rings[i].tx);
        open_end(&threads->rings[i].rx);
    }
    for (i = 0; i < threads->n; i++)
        atomic_store(&threads->pes[i].closed, 0);
    atomic_store(&threads->unfinished, threads->n);
    threads->cores = count_cores();
}

static void close_all(struct pe *pe)
{
    jl_threads *threads = pe->threads;
    int i;

    atomic_store(&pe->closed, 1);
    atomic_fetch_sub(&threads->unfinished, 1);
    for (i = 0; i < threads->n; i++)
        if (i != pe->index) {
            jli_wake(&ring_at(threads, pe->index, i)->rx);
            jli_wake(&ring_at(threads, i, pe->index)->tx);
        }
}

static void *pe_thread(void *arg)
{
    struct pe *pe = arg;
    jl_threads *threads = pe->threads;
    int cancelled;

    pthread_mutex_lock(&threads->start);
    cancelled = threads->cancelled;
    pthread_mutex_unlock(&threads->start);
    if (cancelled)
        return NULL;
    threads->body(pe->index, threads->context);
    close_all(pe);
    return NULL;
}

int jl_threads_run(jl_threads *threads, void (*body)(int pe, void *context),
                   void *context)
{
    int i, made;

    threads->body = body;
    threads->context = context;
    open_all(threads);
    pthread_mutex_lock(&threads->start);
    for (made = 0; made < threads->n; made++)
        if (pthread_create(&threads->pes[made].thread, NULL, pe_thread,
                           &threads->pes[made]) != 0)
            break;
    threads->cancelled = made < threads->n;
    pthread_mutex_unlock(&threads->start);
    for (i = 0; i < made; i++)
        pthread_join(threads->pes[i].thread, NULL);
    return made == threads->n ? JL_OK : JL_EIO;
}
