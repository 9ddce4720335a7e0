#include "fault.h"

#include <string.h>

void fault_init(fault *f, const fault_set *set, unsigned seed)
{
    memset(f, 0, sizeof *f);
    f->set = *set;
    f->random = seed * 2654435761U + 1;
}

/* 0 to n - 1. */
static unsigned dice(fault *f, unsigned n)
{
    f->random = f->random * 1664525U + 1013904223U;
    return (f->random >> 8) % n;
}

static int befalls(fault *f, enum fault_kind kind)
{
    if ((int)dice(f, 100) >= f->set.percent[kind])
        return 0;
    f->count[kind]++;
    return 1;
}

static int ready(const fault *f, const struct fault_place *p, jl_u32 now)
{
    return f->put > p->behind || now - p->since >= p->wait;
}

/* One of what may be two of the same, each with a fate of its own. */
static void place(fault *f, int to, const unsigned char *datagram, int len,
                  jl_u32 now)
{
    struct fault_place *p = f->place;
    unsigned flips;

    while (p < f->place + FAULT_PLACES && p->len > 0)
        p++;
    if (p == f->place + FAULT_PLACES) {
        f->crowded++;
        return;
    }
    memcpy(p->octets, datagram, (size_t)len);
    p->to = to;
    p->number = 2 * f->put;
    p->behind = f->put;
    p->since = now;
    p->wait = 0;
    if (len > 1 && befalls(f, FAULT_CUT))
        len = 1 + (int)dice(f, (unsigned)len - 1);
    p->len = len;
    if (befalls(f, FAULT_CORRUPT))
        for (flips = 1 + dice(f, 3); flips > 0; flips--)
            p->octets[dice(f, (unsigned)len)] ^=
                (unsigned char)(1 << dice(f, 8));
    if (befalls(f, FAULT_REORDER)) {
        unsigned overtaken = 1 + dice(f, 3);

        p->number += 2 * overtaken + 1;
        p->behind += overtaken - 1;
        p->wait = FAULT_WAIT_US;
    }
    if (befalls(f, FAULT_DELAY)) {
        p->behind = ~0UL;
        p->wait = 1 + dice(f, f->set.delay_us);
    }
}

void fault_put(fault *f, int to, const unsigned char *datagram, int len,
               jl_u32 now)
{
    f->put++;
    if (befalls(f, FAULT_DROP))
        return;
    place(f, to, datagram, len, now);
    if (befalls(f, FAULT_REPEAT))
        place(f, to, datagram, len, now);
}

int fault_get(fault *f, int *to, unsigned char *datagram, jl_u32 now)
{
    struct fault_place *p, *first = NULL;
    int len;

    for (p = f->place; p < f->place + FAULT_PLACES; p++)
        if (p->len > 0 && ready(f, p, now)
            && (first == NULL || p->number < first->number))
            first = p;
    if (first == NULL)
        return 0;
    len = first->len;
    memcpy(datagram, first->octets, (size_t)len);
    *to = first->to;
    first->len = 0;
    f->got++;
    return len;
}

long fault_timer(const fault *f, jl_u32 now)
{
    const struct fault_place *p;
    long next = -1;

    for (p = f->place; p < f->place + FAULT_PLACES; p++)
        if (p->len > 0) {
            long left = ready(f, p, now)
                ? 0 : (long)(p->wait - (now - p->since));

            if (next < 0 || left < next)
                next = left;
        }
    return next;
}
