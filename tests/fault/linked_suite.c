#include "linked_suite.h"

#include "close.h"
#include "conform/conform.h"
#include "conform/par_case.h"
#include "pair.h"

#define NODES_MAX 5
#define SLOTS 4
#define LINGER_US 20000000L
#define PAR_PES 3

/* --- nodes over the carrier ---------------------------------------------- */

/* One run: every node opens its links, lives, and closes them. */
struct world {
    const linked_port *over;
    const fault_set *set;
    int nodes, max_len;
    int (*life)(int node, void *context);       /* 0: all went well         */
    void *context;
    void *carrier;
    linked *linked[NODES_MAX];
    jl_link_count count[NODES_MAX];
    fault fault[NODES_MAX];
    int failed[NODES_MAX];
    double seconds;
};

static struct world w;

static jl_u32 now(void *context)
{
    return w.over->now(context);
}

static linked *open_node(int node)
{
    jl_chan *to[NODES_MAX], *from[NODES_MAX];
    linked_config config = { 0 };
    int i;

    for (i = 0; i < w.nodes; i++) {
        to[i] = w.over->tx(w.carrier, node, i);
        from[i] = w.over->rx(w.carrier, i, node);
    }
    config.node = node;
    config.nodes = w.nodes;
    config.max_len = w.max_len;
    config.slots = SLOTS;
    config.rto_us = w.over->rto_us;
    config.set = w.set;
    config.to = to;
    config.from = from;
    config.now = now;
    config.context = w.carrier;
    return linked_open(&config);
}

static void live(int node, void *context)
{
    linked *l = open_node(node);

    (void)context;
    w.linked[node] = l;
    w.failed[node] = l == NULL || w.life(node, w.context) != 0;
    if (l == NULL)
        return;
    w.count[node] = linked_count(l);
    w.fault[node] = *linked_fault(l);
    linked_close(l, LINGER_US);
}

/* Returns how many nodes failed. */
static int run(int nodes, int max_len, int (*life)(int node, void *context),
               void *context)
{
    int i, failed = 0;
    jl_u32 since;

    w.nodes = nodes;
    w.max_len = max_len;
    w.life = life;
    w.context = context;
    w.carrier = w.over->make(nodes, JL_FRAME_MAX, LINKED_PLACES);
    if (w.carrier == NULL)
        return nodes;
    since = w.over->now(w.carrier);
    if (w.over->run(w.carrier, live, NULL) != JL_OK)
        failed = nodes;
    w.seconds = 1e-6 * (double)(w.over->now(w.carrier) - since);
    w.over->free(w.carrier);
    for (i = 0; i < nodes; i++)
        failed += w.failed[i];
    return failed;
}

/* --- a million messages -------------------------------------------------- */

static int live_in_pair(int node, void *context)
{
    linked *l = w.linked[node];
    int failed = pair_body(node, *(const long *)context,
                           linked_tx(l, 1 - node), linked_rx(l, 1 - node));

    if (failed)
        pair_explain(node, linked_link(l, 1 - node), linked_fault(l),
                     now(w.carrier));
    return failed;
}

void linked_suite_million(const linked_port *over)
{
    long total = 0;
    int s, i;

    w.over = over;
    pair_print_head(over->name);
    for (s = 0; s < PAIR_SETS; s++) {
        struct pair_result result = { 0 };
        long each = pair_messages(s) / 2;

        w.set = &pair_sets[s];
        assert_int_equal(run(2, PAIR_MAX_LEN, live_in_pair, &each), 0);
        result.messages = 2 * each;
        result.seconds = w.seconds;
        for (i = 0; i < 2; i++)
            pair_add(&result, &w.count[i], &w.fault[i]);
        pair_print(w.set, &result);
        assert_true(pair_faults_were_real(w.set, &result));
        total += result.messages;
    }
    assert_true(total >= PAIR_ALL);
}

/* --- the contract -------------------------------------------------------- */

static jl_chan *tx(int from, int to)
{
    return linked_tx(w.linked[from], to);
}

static jl_chan *rx(int from, int to)
{
    return linked_rx(w.linked[to], from);
}

static int live_a_case(int node, void *context)
{
    (*(conform_body *)context)(node);
    return 0;
}

static int run_case(int n, conform_body body)
{
    int before = conform_failures();

    return run(n, port->max_len, live_a_case, &body)
        + conform_failures() - before;
}

static const conform_port linked_conform = {
    2000, SLOTS, 500, 1, tx, rx, run_case
};

void linked_suite_conforms(const linked_port *over)
{
    const conform_case *c;
    int s, failed = 0;

    w.over = over;
    port = &linked_conform;
    for (s = 0; s < PAIR_SETS; s++) {
        w.set = &pair_sets[s];
        for (c = conform_cases; c->name != NULL; c++)
            if (port->run(c->n, c->body) != 0) {
                print_error("failed: %s, %s\n", c->name, w.set->name);
                failed++;
            }
    }
    assert_int_equal(failed, 0);
}

/* --- the parallel filter ------------------------------------------------- */

struct filter {
    struct par_shape shape;
    struct par_trace trace;
};

static int live_in_filter(int node, void *context)
{
    struct filter *filter = context;
    jl_chan *to[NODES_MAX], *from[NODES_MAX];
    int i, status;

    for (i = 0; i <= PAR_PES; i++) {
        to[i] = linked_tx(w.linked[node], i);
        from[i] = linked_rx(w.linked[node], i);
    }
    if (node == PAR_PES)
        status = par_host(&filter->trace, &filter->shape, to[0], from[0],
                          NULL);
    else
        status = par_pe(node, &filter->shape, to, from, NULL);
    if (status != JL_OK)
        print_error("%s: node %d: %s\n", w.set->name, node,
                    jl_status_text(status));
    return status != JL_OK;
}

void linked_suite_gives_serial_bits(const linked_port *over)
{
    static const struct par_shape shapes[] = {
        { .M = PAR_M, .form = &jl_kf_joseph },
        { .M = PAR_M, .form = &jl_kf_joseph, .sticky = 1 },
        { .M = PAR_PES, .axes = 1 },            /* constant gains */
        { .M = 8, .axes = PAR_CG_AXES }
    };
    static struct par_trace serial;
    static struct filter filter;
    int s, k;

    w.over = over;
    for (k = 0; k < 4; k++) {
        filter.shape = shapes[k];
        filter.shape.npe = PAR_PES;
        filter.shape.hangs_at = -1;
        par_serial(&serial, &filter.shape);
        for (s = k % 2; s < PAIR_SETS; s += 2) {
            w.set = &pair_sets[s];
            assert_int_equal(run(PAR_PES + 1,
                                 JL_PAR_MSG(PAR_M, PAR_N, PAR_Z),
                                 live_in_filter, &filter), 0);
            assert_same_bits(&filter.trace, &serial, sizeof serial);
        }
    }
}
