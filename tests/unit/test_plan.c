/* Topologies and the exchange's list of hops, for every number of PEs. */
#include "close.h"

#include "jumplink/plan.h"

#define ALL JL_HOPS_OF_ALL(JL_MAX_PES)

static const int topologies[] = {
    JL_TOPO_FULL, JL_TOPO_STAR, JL_TOPO_RING, JL_TOPO_CHAIN
};

/* Of any topology, with any number of PEs. */
#define FOR_EACH(t, npe) \
    for (t = 0; t < 4; t++) \
        for (npe = 1; npe <= JL_MAX_PES; npe++)

static int block(const jl_hop *hop, int k, int npe)
{
    return (hop->first + k) % npe;
}

/* --- topologies ---------------------------------------------------------- */

/* The definition, link by link. */
static int joined(int topology, int npe, int a, int b)
{
    int low = a < b ? a : b, high = a < b ? b : a;

    switch (topology) {
    case JL_TOPO_STAR:
        return low == 0;
    case JL_TOPO_RING:
        return high - low == 1 || (low == 0 && high == npe - 1);
    case JL_TOPO_CHAIN:
        return high - low == 1;
    default:
        return 1;
    }
}

/* Floyd and Warshall: links on the shortest way. */
static void distances(int d[JL_MAX_PES][JL_MAX_PES], int topology, int npe)
{
    int i, j, k;

    for (i = 0; i < npe; i++)
        for (j = 0; j < npe; j++)
            d[i][j] = i == j ? 0 : joined(topology, npe, i, j) ? 1 : 1000;
    for (k = 0; k < npe; k++)
        for (i = 0; i < npe; i++)
            for (j = 0; j < npe; j++)
                if (d[i][k] + d[k][j] < d[i][j])
                    d[i][j] = d[i][k] + d[k][j];
}

static void test_topo_relays_are_of_the_shortest_way(void **state)
{
    int d[JL_MAX_PES][JL_MAX_PES], t, npe, a, b;

    (void)state;
    FOR_EACH(t, npe) {
        distances(d, topologies[t], npe);
        for (a = 0; a < npe; a++)
            for (b = 0; b < npe; b++)
                if (a != b)
                    assert_int_equal(jl_topo_relays(topologies[t], npe, a, b),
                                     d[a][b] - 1);
    }
}

static void test_topo_one_relay_up_to_four_pes(void **state)
{
    int t, npe, a, b;

    (void)state;
    FOR_EACH(t, npe)
        for (a = 0; a < npe && npe <= 4; a++)
            for (b = 0; b < npe; b++)
                if (a != b && topologies[t] != JL_TOPO_CHAIN)
                    assert_true(jl_topo_relays(topologies[t], npe, a, b)
                                <= 1);
}

static void test_topo_parents_make_the_shortest_tree(void **state)
{
    int d[JL_MAX_PES][JL_MAX_PES], t, npe, pe, parent;

    (void)state;
    FOR_EACH(t, npe) {
        distances(d, topologies[t], npe);
        for (pe = 1; pe < npe; pe++) {
            parent = jl_topo_parent(topologies[t], npe, pe);
            assert_int_equal(d[pe][parent], 1);
            assert_int_equal(d[parent][0], d[pe][0] - 1);
        }
    }
}

/* --- the exchange -------------------------------------------------------- */

/* In the list's order, each PE has what it sends, and at last everything; the
 * level is one more than that of the last hop that either end has done. */
static void test_hops_bring_every_block_to_every_pe(void **state)
{
    static jl_hop hops[ALL];
    char has[JL_MAX_PES][JL_MAX_PES];
    int next[JL_MAX_PES], t, npe, count, h, k;

    (void)state;
    FOR_EACH(t, npe) {
        count = jl_hops_exchange(hops, ALL, topologies[t], npe, -1);
        assert_true(count >= 0);
        memset(has, 0, sizeof has);
        memset(next, 0, sizeof next);
        for (k = 0; k < npe; k++)
            has[k][k] = 1;
        for (h = 0; h < count; h++) {
            const jl_hop *hop = &hops[h];

            assert_true(joined(topologies[t], npe, hop->from, hop->to));
            assert_in_range(hop->count, 1, npe - 1);
            for (k = 0; k < hop->count; k++) {
                int b = block(hop, k, npe);

                assert_true(has[hop->from][b]);
                assert_false(has[(int)hop->to][b]);     /* nothing twice */
                has[hop->to][b] = 1;
            }
            assert_int_equal(hop->level, next[hop->from] > next[hop->to]
                             ? next[hop->from] : next[hop->to]);
            next[hop->from] = next[hop->to] = hop->level + 1;
        }
        for (h = 0; h < npe; h++)
            for (k = 0; k < npe; k++)
                assert_true(has[h][k]);
    }
}

static void test_hops_of_a_pe_are_those_of_the_list(void **state)
{
    static jl_hop all[ALL], own[JL_HOPS_OF_PE(JL_MAX_PES)];
    int t, npe, count, pe, h, k, n;

    (void)state;
    FOR_EACH(t, npe) {
        count = jl_hops_exchange(all, ALL, topologies[t], npe, -1);
        for (pe = 0; pe < npe; pe++) {
            n = jl_hops_exchange(own, JL_HOPS_OF_PE(npe), topologies[t], npe,
                                 pe);
            k = 0;
            for (h = 0; h < count; h++)
                if (all[h].from == pe || all[h].to == pe) {
                    assert_true(k < n);
                    assert_memory_equal(&all[h], &own[k], sizeof *own);
                    k++;
                }
            assert_int_equal(k, n);
        }
    }
}

/* Every PE executes its part; a hop is done when both ends stand at it. */
static void test_hops_never_deadlock_under_rendezvous(void **state)
{
    static jl_hop own[JL_MAX_PES][JL_HOPS_OF_PE(JL_MAX_PES)];
    int n[JL_MAX_PES], at[JL_MAX_PES], t, npe, pe, left, moved;

    (void)state;
    FOR_EACH(t, npe) {
        left = 0;
        for (pe = 0; pe < npe; pe++) {
            n[pe] = jl_hops_exchange(own[pe], JL_HOPS_OF_PE(npe),
                                     topologies[t], npe, pe);
            at[pe] = 0;
            left += n[pe];
        }
        do {
            moved = 0;
            for (pe = 0; pe < npe; pe++) {
                const jl_hop *hop = &own[pe][at[pe]];
                int to = hop->to;

                if (at[pe] < n[pe] && hop->from == pe && at[to] < n[to]
                    && memcmp(hop, &own[to][at[to]], sizeof *hop) == 0) {
                    at[pe]++;
                    at[to]++;
                    moved = 1;
                    left -= 2;
                }
            }
        } while (moved);
        assert_int_equal(left, 0);
    }
}

static void test_hops_are_as_few_as_they_can_be(void **state)
{
    static jl_hop hops[ALL];
    int t, npe, n;

    (void)state;
    FOR_EACH(t, npe) {
        n = jl_hops_exchange(hops, ALL, topologies[t], npe, -1);
        assert_int_equal(n, topologies[t] == JL_TOPO_FULL
                         || topologies[t] == JL_TOPO_RING
                         ? npe * (npe - 1) : 2 * (npe - 1));
    }
}

static void test_hops_refuse(void **state)
{
    jl_hop hops[ALL];

    (void)state;
    assert_int_equal(jl_hops_exchange(hops, ALL, -1, 2, -1), JL_EDIM);
    assert_int_equal(jl_hops_exchange(hops, ALL, JL_TOPO_CHAIN + 1, 2, -1),
                     JL_EDIM);
    assert_int_equal(jl_hops_exchange(hops, ALL, JL_TOPO_FULL, 0, -1),
                     JL_EDIM);
    assert_int_equal(jl_hops_exchange(hops, ALL, JL_TOPO_FULL, JL_MAX_PES + 1,
                                      -1), JL_EDIM);
    assert_int_equal(jl_hops_exchange(hops, ALL, JL_TOPO_FULL, 2, 2), JL_EDIM);
    assert_int_equal(jl_hops_exchange(hops, ALL, JL_TOPO_FULL, 2, -2),
                     JL_EDIM);
    assert_int_equal(jl_hops_exchange(hops, 11, JL_TOPO_FULL, 4, -1),
                     JL_ENOMEM);
    assert_int_equal(jl_hops_exchange(hops, 12, JL_TOPO_FULL, 4, -1), 12);
    assert_int_equal(jl_hops_exchange(hops, 0, JL_TOPO_FULL, 1, 0), 0);
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_topo_relays_are_of_the_shortest_way),
        cmocka_unit_test(test_topo_one_relay_up_to_four_pes),
        cmocka_unit_test(test_topo_parents_make_the_shortest_tree),
        cmocka_unit_test(test_hops_bring_every_block_to_every_pe),
        cmocka_unit_test(test_hops_of_a_pe_are_those_of_the_list),
        cmocka_unit_test(test_hops_never_deadlock_under_rendezvous),
        cmocka_unit_test(test_hops_are_as_few_as_they_can_be),
        cmocka_unit_test(test_hops_refuse),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
