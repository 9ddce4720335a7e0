/* How a PE waits: it looks for a while, then it sleeps until it is woken. */
#include "threads_parts.h"

#include <sched.h>
#include <time.h>

#define SPIN_US 20
#define LOOKS 32                    /* at most a microsecond */

#if defined(__x86_64__) || defined(__i386__)
#define RELAX() __builtin_ia32_pause()
#elif defined(__aarch64__)
#define RELAX() __asm__ volatile("yield")
#else
#define RELAX() ((void)0)
#endif

static tick now_us(void)
{
    struct timespec t;

    clock_gettime(CLOCK_MONOTONIC, &t);
    return (tick)t.tv_sec * 1000000 + (tick)t.tv_nsec / 1000;
}

tick jli_deadline(long timeout_us)
{
    return timeout_us == JL_FOREVER ? NEVER : now_us() + (tick)timeout_us;
}

static int first_ready(jl_chan *const *chans, int n,
                       int (*ready)(struct end *))
{
    int i;

    for (i = 0; i < n; i++)
        if (ready(jli_end(chans[i])))
            return i;
    return JL_ETIMEOUT;
}

/* The other PE may have been put on the same core, where it gets on only if we
 * let it: hence sched_yield, which returns at once where nobody else is. */
static int spin(jl_chan *const *chans, int n, int (*ready)(struct end *),
                tick deadline)
{
    tick until = now_us() + SPIN_US;
    int i, found;

    if (deadline < until)
        until = deadline;
    do {
        for (i = 0; i < LOOKS; i++) {
            found = first_ready(chans, n, ready);
            if (found >= 0)
                return found;
            RELAX();
        }
        sched_yield();
    } while (now_us() < until);
    return JL_ETIMEOUT;
}

static void set_asleep(jl_chan *const *chans, int n, int asleep)
{
    int i;

    for (i = 0; i < n; i++)
        atomic_store(&jli_end(chans[i])->asleep, asleep);
}

/* Returns 1 when the deadline has passed. */
static int doze(struct pe *pe, tick deadline)
{
    struct timespec t;

    if (deadline == NEVER) {
        pthread_cond_wait(&pe->woken, &pe->mutex);
        return 0;
    }
    t.tv_sec = (time_t)(deadline / 1000000);
    t.tv_nsec = (long)(deadline % 1000000) * 1000;
    return pthread_cond_timedwait(&pe->woken, &pe->mutex, &t) != 0;
}

/* Nobody who has seen `asleep` gets the mutex before we doze. */
static int sleep_until(jl_chan *const *chans, int n,
                       int (*ready)(struct end *), tick deadline)
{
    struct pe *pe = jli_end(chans[0])->pe;
    int found, late = 0;

    pthread_mutex_lock(&pe->mutex);
    for (;;) {
        set_asleep(chans, n, 1);
        found = first_ready(chans, n, ready);
        if (found >= 0 || late)
            break;
        late = doze(pe, deadline);
    }
    set_asleep(chans, n, 0);
    pthread_mutex_unlock(&pe->mutex);
    return found;
}

int jli_await(jl_chan *const *chans, int n, int (*ready)(struct end *),
              tick deadline)
{
    jl_threads *threads = jli_end(chans[0])->pe->threads;

    if (atomic_load(&threads->unfinished) <= threads->cores) {
        int found = spin(chans, n, ready, deadline);

        if (found >= 0)
            return found;
    }
    return sleep_until(chans, n, ready, deadline);
}

void jli_wake(struct end *end)
{
    struct pe *pe = end->pe;

    if (!atomic_load(&end->asleep))
        return;
    pthread_mutex_lock(&pe->mutex);
    atomic_store(&end->asleep, 0);
    pthread_mutex_unlock(&pe->mutex);
    pthread_cond_signal(&pe->woken);
}

int jli_wait(jl_chan *const *chans, int n, int (*ready)(struct end *),
             long timeout_us)
{
    int found = first_ready(chans, n, ready);

    if (found >= 0 || timeout_us == 0)
        return found;
    return jli_await(chans, n, ready, jli_deadline(timeout_us));
}
