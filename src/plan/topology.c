/* Which PEs are joined, and the ways between them. */
#include "jumplink/plan.h"

static int apart(int a, int b)
{
    return a > b ? a - b : b - a;
}

int jl_topo_relays(int topology, int npe, int a, int b)
{
    int steps = apart(a, b);

    JL_ASSERT(a >= 0 && a < npe && b >= 0 && b < npe && a != b);
    switch (topology) {
    case JL_TOPO_STAR:
        return a != 0 && b != 0;
    case JL_TOPO_RING:
        return (steps < npe - steps ? steps : npe - steps) - 1;
    case JL_TOPO_CHAIN:
        return steps - 1;
    default:
        return 0;
    }
}

int jl_topo_parent(int topology, int npe, int pe)
{
    JL_ASSERT(pe > 0 && pe < npe);
    if (topology == JL_TOPO_CHAIN)
        return pe - 1;
    if (topology == JL_TOPO_RING)
        return pe <= npe / 2 ? pe - 1 : (pe + 1) % npe;
    return 0;
}
