/* The exchange as a list of hops. */
#include "jumplink/plan.h"

struct list {
    jl_hop *hops;
    int cap, count;
    int npe;
    int pe;                     /* whose hops are listed; -1: all           */
    int level[JL_MAX_PES];      /* of each PE's next hop, as far as it knows */
};

static void add(struct list *list, int from, int to, int first, int count)
{
    jl_hop *hop = &list->hops[list->count];
    int *a = &list->level[from], *b = &list->level[to];
    int level = *a > *b ? *a : *b;

    *a = *b = level + 1;
    if (list->pe >= 0 && list->pe != from && list->pe != to)
        return;
    if (list->count++ >= list->cap)
        return;
    hop->from = (unsigned char)from;
    hop->to = (unsigned char)to;
    hop->first = (unsigned char)((first + list->npe) % list->npe);
    hop->count = (unsigned char)count;
    hop->level = (unsigned char)level;
}

/* The circle method for an odd number of seats: seats i and j meet in round
 * (i + j) mod seats, and the one that would meet itself meets the last PE of an
 * even number. */
static void full(struct list *list)
{
    int npe = list->npe, seats = npe % 2 == 0 ? npe - 1 : npe;
    int round, i, j;

    for (round = 0; round < seats; round++)
        for (i = 0; i < seats; i++) {
            j = (round - i + seats) % seats;
            if (i == j)
                j = seats;
            if (i < j && j < npe) {
                add(list, i, j, i, 1);
                add(list, j, i, j, 1);
            }
        }
}

static void star(struct list *list)
{
    int npe = list->npe, i;

    for (i = 1; i < npe; i++)
        add(list, i, 0, i, 1);
    for (i = 1; i < npe; i++)
        add(list, 0, i, i + 1, npe - 1);
}

/* Pairs that share no PE stand together, so that they swap at the same time. */
static void ring(struct list *list)
{
    int npe = list->npe, d, odd, i, up;

    for (d = 1; d <= npe / 2; d++)
        for (odd = 0; odd < 2; odd++)
            for (i = odd; i < npe; i += 2) {
                up = (i + 1) % npe;
                add(list, i, up, i - d + 1, 1);
                if (2 * d < npe)
                    add(list, up, i, up + d - 1, 1);
            }
}

static void chain(struct list *list)
{
    int last = list->npe - 1, i;

    for (i = 0; i < last; i++) {
        add(list, i, i + 1, 0, i + 1);
        add(list, last - i, last - i - 1, last - i, i + 1);
    }
}

int jl_hops_exchange(jl_hop *hops, int cap, int topology, int npe, int pe)
{
    struct list list;
    int i;

    if (npe < 1 || npe > JL_MAX_PES || pe < -1 || pe >= npe)
        return JL_EDIM;
    list.hops = hops;
    list.cap = cap;
    list.count = 0;
    list.npe = npe;
    list.pe = pe;
    for (i = 0; i < npe; i++)
        list.level[i] = 0;
    switch (topology) {
    case JL_TOPO_FULL:
        full(&list);
        break;
    case JL_TOPO_STAR:
        star(&list);
        break;
    case JL_TOPO_RING:
        ring(&list);
        break;
    case JL_TOPO_CHAIN:
        chain(&list);
        break;
    default:
        return JL_EDIM;
    }
    return list.count <= cap ? list.count : JL_ENOMEM;
}
