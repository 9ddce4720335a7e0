/* The channel contract, and the parallel filter, on port skel over a carrier
 * made of port loop: whoever fills in skel's three functions for a machine gets
 * a port that passes this. */
#include "par_case.h"
#include "conform.h"

#include "loop/port_loop.h"
#include "skel/port_skel.h"

enum { MAX_LEN = 3000, SLOTS = 2, NODES = 5, QUEUE = 8 };
enum { MEM = JL_SKEL_MEM(NODES, MAX_LEN, SLOTS) };

#define LINGER_US 10000000L

/* The carrier of a node: channels of port loop, of which a full one loses what
 * is sent; in a queue of its own the keeper, which never sends, so that one may
 * wait when all others have left. */
struct radio {
    int node, nodes;
    int left[NODES];            /* nodes that are there no more             */
    unsigned noise;
};

static jl_loop *loop;
static struct radio radios[NODES];
static jl_skel skels[NODES];
static unsigned char mem[NODES][MEM];
static unsigned lost;           /* of 100 datagrams                         */
static jl_u32 beat_us;
static jl_u32 lives;

/* --- the three functions ------------------------------------------------- */

static int radio_put(void *context, int to, const unsigned char *datagram,
                     int len)
{
    struct radio *r = context;

    if (conform_random(&r->noise) % 100 >= lost)
        (void)jl_chan_send(jl_loop_tx(loop, r->node, to), datagram, len, 0);
    return JL_OK;
}

static int radio_get(void *context, unsigned char *datagram, int cap,
                     long wait_us)
{
    struct radio *r = context;
    jl_chan *from[NODES + 1];
    int who[NODES + 1], i, n, len;

    for (;;) {
        for (i = n = 0; i <= r->nodes; i++)
            if (i != r->node && (i == r->nodes || !r->left[i])) {
                who[n] = i;
                from[n++] = jl_loop_rx(loop, i, r->node);
            }
        i = jl_chan_wait(from, n, wait_us);
        if (i == JL_ETIMEOUT)
            return 0;
        if (i < 0 || who[i] == r->nodes)
            return JL_EIO;
        len = jl_chan_recv(from[i], datagram, cap, 0);
        if (len != JL_ECLOSED)
            return len;
        r->left[who[i]] = 1;
    }
}

static jl_u32 radio_now(void *context)
{
    (void)context;
    return jl_loop_now(loop);
}

/* --- nodes --------------------------------------------------------------- */

static void join(int node, int nodes)
{
    jl_skel_config config;

    memset(&radios[node], 0, sizeof radios[node]);
    radios[node].node = node;
    radios[node].nodes = nodes;
    radios[node].noise = (unsigned)node + 1;
    memset(&config, 0, sizeof config);
    config.carrier.put = radio_put;
    config.carrier.get = radio_get;
    config.carrier.now = radio_now;
    config.carrier.context = &radios[node];
    config.node = node;
    config.nodes = nodes;
    config.session = ++lives;
    config.number = JL_REAL_OCTETS;
    config.max_len = MAX_LEN;
    config.slots = SLOTS;
    config.rto_us = 20000;
    config.ack_us = 5000;
    config.beat_us = beat_us;
    config.silence_us = 8 * beat_us;
    EXPECT(jl_skel_init(&skels[node], &config, mem[node], MEM), ==, JL_OK);
}

static void keep(int nodes)
{
    int i;

    for (i = 0; i < nodes; i++)
        EXPECT(jl_chan_recv(jl_loop_rx(loop, i, nodes), NULL, 0, JL_FOREVER),
               ==, JL_ECLOSED);
}

struct crew {
    int nodes;
    conform_body body;
};

/* The last acknowledgement may be lost, and its sender gone. */
static void leave(int node)
{
    int status = jl_skel_close(&skels[node], LINGER_US);

    if (lost == 0 || status != JL_ETIMEOUT)
        EXPECT(status, ==, JL_OK);
}

static void live(int node, void *context)
{
    const struct crew *crew = context;

    if (node == crew->nodes) {
        keep(node);
        return;
    }
    join(node, crew->nodes);
    crew->body(node);
    leave(node);
}

static int run(int nodes, conform_body body)
{
    struct crew crew = { nodes, body };
    int before = conform_failures(), status;

    loop = jl_loop_new(nodes + 1, JL_FRAME_MAX, QUEUE);
    assert_non_null(loop);
    status = jl_loop_run(loop, live, &crew);
    jl_loop_free(loop);
    return status != JL_OK || conform_failures() != before;
}

/* --- the contract -------------------------------------------------------- */

static jl_chan *tx(int from, int to)
{
    return jl_skel_tx(&skels[from], to);
}

static jl_chan *rx(int from, int to)
{
    return jl_skel_rx(&skels[to], from);
}

static conform_port skel_port = { MAX_LEN, SLOTS, 7, 20, tx, rx, run };

static void all_cases(unsigned loss)
{
    const conform_case *c;
    int failed = 0;

    lost = loss;
    for (c = conform_cases; c->name != NULL; c++)
        if (run(c->n, c->body) != 0) {
            print_error("failed: %s, %u%% lost\n", c->name, loss);
            failed++;
        }
    assert_int_equal(failed, 0);
}

static void test_conform_skel(void **state)
{
    (void)state;
    all_cases(0);
}

static void test_conform_skel_lossy(void **state)
{
    (void)state;
    all_cases(30);
}

/* --- the parallel filter ------------------------------------------------- */

static struct par_trace trace;
static const struct par_shape shape = {
    .npe = NODES - 1, .M = PAR_M, .form = &jl_kf_joseph,
    .topology = JL_TOPO_RING, .hangs = -1, .hangs_at = -1
};

static void filter(int node)
{
    jl_chan *to[NODES] = { NULL }, *from[NODES] = { NULL };
    int i;

    for (i = 0; i < NODES; i++)
        if (i != node) {
            to[i] = tx(node, i);
            from[i] = rx(i, node);
        }
    if (node == NODES - 1)
        EXPECT(par_host(&trace, &shape, to[0], from[0], NULL), ==, JL_OK);
    else
        EXPECT(par_pe(node, &shape, to, from, NULL), ==, JL_OK);
}

static void test_skel_gives_serial_bits(void **state)
{
    static struct par_trace serial;

    (void)state;
    par_serial(&serial, &shape);
    for (lost = 0; lost <= 30; lost += 30) {
        assert_int_equal(run(NODES, filter), 0);
        assert_same_bits(&trace, &serial, sizeof serial);
    }
}

/* --- what is the port's own ---------------------------------------------- */

/* A node that goes without a word, and comes to no call any more. */
static void falls_silent(int node)
{
    EXPECT(jl_chan_send(tx(node, 1 - node), NULL, 0, LONG_US), ==, JL_OK);
    EXPECT(jl_chan_recv(rx(1 - node, node), NULL, 0, LONG_US), ==, 0);
    if (node == 0)
        EXPECT(jl_chan_recv(rx(1, 0), NULL, 0, JL_FOREVER), ==, JL_ESILENT);
    else
        EXPECT(jl_chan_recv(jl_loop_rx(loop, 2, 1), NULL, 0, 900000), ==,
               JL_ETIMEOUT);
}

static void test_skel_notices_silence(void **state)
{
    (void)state;
    lost = 0;
    beat_us = 100000;
    assert_int_equal(run(2, falls_silent), 0);
    beat_us = 0;
}

/* Datagrams of nobody are counted. */
static void among_strangers(int node)
{
    unsigned char noise[60];
    unsigned state = 1;
    int i, k;

    if (node == 0) {
        for (i = 0; i < 100; i++) {
            for (k = 0; k < (int)sizeof noise; k++)
                noise[k] = (unsigned char)conform_random(&state);
            noise[JL_FRAME_FROM] = (unsigned char)(i % 4);
            EXPECT(radio_put(&radios[0], 1, noise, 1 + i % 59), ==,
                   JL_OK);
            EXPECT(jl_skel_poll(&skels[0]), ==, JL_OK);
        }
        EXPECT(jl_chan_send(tx(0, 1), NULL, 0, LONG_US), ==, JL_OK);
    } else {
        const jl_skel *s = &skels[1];

        EXPECT(jl_chan_recv(rx(0, 1), NULL, 0, LONG_US), ==, 0);
        EXPECT(s->strays + s->peers[0].link.count.refused, ==, 100);
        EXPECT(s->strays, >=, 75);
    }
}

static void test_skel_counts_strays(void **state)
{
    (void)state;
    lost = 0;
    assert_int_equal(run(2, among_strangers), 0);
}

/* As long as a machine's carrier is not filled in, every call says so. */
static void test_skel_machine_fails(void **state)
{
    jl_skel *s = &skels[0];
    jl_skel_config config;
    unsigned char msg[3] = { 0 };
    jl_chan *from;

    (void)state;
    memset(&config, 0, sizeof config);
    config.carrier = jl_skel_machine;
    config.nodes = 2;
    config.session = 1;
    config.number = JL_REAL_OCTETS;
    config.max_len = 3;
    config.slots = 1;
    config.rto_us = 20000;
    assert_int_equal(jl_skel_init(s, &config, mem[0], MEM), JL_OK);
    from = jl_skel_rx(s, 1);
    assert_int_equal(jl_skel_poll(s), JL_EIO);
    assert_int_equal(jl_chan_send(jl_skel_tx(s, 1), msg, 3, JL_FOREVER),
                     JL_EIO);
    assert_int_equal(jl_chan_recv(from, msg, 3, JL_FOREVER), JL_EIO);
    assert_int_equal(jl_chan_wait(&from, 1, 0), JL_EIO);
    assert_int_equal(jl_skel_close(s, 1000), JL_EIO);
}

static void test_skel_refuses(void **state)
{
    jl_skel *s = &skels[0];
    jl_skel_config good, c;
    int i;

    (void)state;
    memset(&good, 0, sizeof good);
    good.carrier = jl_skel_machine;
    good.node = 1;
    good.nodes = NODES;
    good.session = 1;
    good.number = JL_REAL_OCTETS;
    good.max_len = MAX_LEN;
    good.slots = SLOTS;
    good.rto_us = 20000;
    for (i = 0; i < 10; i++) {
        c = good;
        switch (i) {
        case 0: c.node = -1; break;
        case 1: c.node = NODES; break;
        case 2: c.nodes = 0; break;
        case 3: c.nodes = JL_SKEL_NODES + 1; break;
        case 4: c.session = 0; break;
        case 5: c.number = 5; break;
        case 6: c.max_len = -1; break;
        case 7: c.max_len = INT_MAX; break;
        case 8: c.slots = 0; break;
        case 9: c.rto_us = 0; break;
        }
        assert_int_equal(jl_skel_init(s, &c, mem[0], MEM), JL_EDIM);
    }
    assert_int_equal(jl_skel_init(s, &good, mem[0], MEM - 1), JL_ENOMEM);
    assert_int_equal(jl_skel_init(s, &good, mem[0], MEM), JL_OK);
    assert_null(jl_skel_tx(s, 1));
    assert_null(jl_skel_rx(s, -1));
    assert_null(jl_skel_rx(s, NODES));
    assert_non_null(jl_skel_tx(s, 0));
}

int main(void)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_conform_skel),
        cmocka_unit_test(test_conform_skel_lossy),
        cmocka_unit_test(test_skel_gives_serial_bits),
        cmocka_unit_test(test_skel_notices_silence),
        cmocka_unit_test(test_skel_counts_strays),
        cmocka_unit_test(test_skel_machine_fails),
        cmocka_unit_test(test_skel_refuses),
    };

    port = &skel_port;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
