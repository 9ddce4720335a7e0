/* Links: two of them over a carrier with a seed and a virtual clock, which
 * loses, doubles, reorders, cuts and alters datagrams, and one that repeats
 * what it once recorded. */
#include "close.h"

#include "jumplink/link.h"

enum { MAX_LEN = 2 * JL_FRAME_PAYLOAD + JL_FRAME_PAYLOAD / 3, SLOTS = 2 };
enum { AIR = 512, TAPE = 4096 };
enum { MEM = JL_LINK_MEM(MAX_LEN, SLOTS) };

typedef struct datagram {
    jl_u32 at;                  /* when it arrives                          */
    int to;                     /* 0 or 1; -1: a free entry                 */
    int len;
    unsigned char octets[JL_FRAME_MAX];
} datagram;

typedef struct carrier {        /* probabilities in percent                 */
    int lose, twice, cut, alter;
    jl_u32 delay, spread;       /* [us]; a spread reorders                  */
} carrier;

typedef struct end {
    jl_link link;
    unsigned char mem[MEM];
    long sent, got;             /* messages                                 */
    long goal;                  /* messages to be sent                      */
    jl_u32 next_recv, every;    /* receives one message in so many us       */
    int told;                   /* first error that recv returned           */
    int close;                  /* closes when all is sent                  */
} end;

typedef struct world {
    end e[2];
    carrier c;
    jl_u32 now, random;
    jl_u32 passed;              /* virtual time spent                       */
    datagram air[AIR];
    datagram tape[TAPE];        /* all that was ever sent                   */
    int taped, replay;          /* replay: tape entries go in at random     */
} world;

static world w;
static unsigned char msg[MAX_LEN + 1], want[MAX_LEN + 1];

static jl_u32 mix(jl_u32 x)
{
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ x >> 16;
}

static int dice(int n)
{
    w.random = w.random * 1664525u + 1013904223u;
    return (int)(mix(w.random) % (jl_u32)n);
}

/* Message i of a direction: every length from 0 to max_len, special ones
 * often. */
static int message(unsigned char *p, int direction, long i, int max_len)
{
    static const int special[] = { 0, 1, JL_FRAME_PAYLOAD - 1,
        JL_FRAME_PAYLOAD, JL_FRAME_PAYLOAD + 1, 2 * JL_FRAME_PAYLOAD };
    jl_u32 r = mix((jl_u32)(2 * i + direction + 1));
    int len = (int)(r % (jl_u32)(max_len + 1)), k;

    if (r >> 28 < 6 && special[r >> 28] <= max_len)
        len = special[r >> 28];
    else if (r >> 28 < 11)
        len %= 64;
    for (k = 0; k < len; k++) {
        if (k % 4 == 0)
            r = mix(r + 1);
        p[k] = (unsigned char)(r >> 8 * (k % 4));
    }
    return len;
}

static jl_link_config config(int from, int to, jl_u32 session)
{
    jl_link_config c = { 8, from, to, session, MAX_LEN, SLOTS, 20000, 2000,
                         0, 0 };

    return c;
}

static void start(int i, jl_u32 session)
{
    jl_link_config c = config(10 + i, 11 - i, session);

    memset(&w.e[i], 0, sizeof w.e[i]);
    w.e[i].next_recv = w.now;
    assert_int_equal(jl_link_init(&w.e[i].link, &c, w.e[i].mem, MEM, w.now),
                     JL_OK);
}

static void begin(carrier c, unsigned seed)
{
    int i;

    w.c = c;
    w.now = 0;
    w.passed = 0;
    w.random = seed;
    w.taped = w.replay = 0;
    for (i = 0; i < AIR; i++)
        w.air[i].to = -1;
    start(0, 0x1111);
    start(1, 0x2222);
}

static void throw_in(int to, const unsigned char *octets, int len)
{
    int i;

    for (i = 0; i < AIR && w.air[i].to >= 0; i++)
        ;
    assert_true(i < AIR);
    w.air[i].to = to;
    w.air[i].at = w.now + w.c.delay +
        (w.c.spread > 0 ? (jl_u32)dice((int)w.c.spread) : 0);
    w.air[i].len = len;
    memcpy(w.air[i].octets, octets, (size_t)len);
    if (len > 0 && dice(100) < w.c.cut)
        w.air[i].len = dice(len);
    if (len > 0 && dice(100) < w.c.alter)
        w.air[i].octets[dice(len)] ^= (unsigned char)(1 << dice(8));
}

static void carry(int to, const unsigned char *octets, int len)
{
    if (w.taped < TAPE) {
        datagram *d = &w.tape[w.taped++];
        d->to = to;
        d->len = len;
        memcpy(d->octets, octets, (size_t)len);
    }
    if (dice(100) >= w.c.lose)
        throw_in(to, octets, len);
    if (dice(100) < w.c.twice)
        throw_in(to, octets, len);
}

/* All that one end can do now; returns how long it may sleep, -1: for ever. */
static long act(int i)
{
    unsigned char out[JL_FRAME_MAX];
    end *e = &w.e[i];
    long sleep;
    int len, status;

    while (e->sent < e->goal) {
        len = message(msg, i, e->sent, MAX_LEN);
        status = jl_link_send(&e->link, msg, len);
        if (status != JL_OK)
            break;
        e->sent++;
    }
    if (e->close && e->sent == e->goal)
        jl_link_close(&e->link);
    while ((int)(w.now - e->next_recv) >= 0) {
        int peeked = jl_link_peek(&e->link);
        len = jl_link_recv(&e->link, msg, MAX_LEN);
        assert_int_equal(peeked, len);
        if (len < 0) {
            if (len != JL_EAGAIN && e->told == 0)
                e->told = len;
            break;
        }
        assert_int_equal(len, message(want, 1 - i, e->got, MAX_LEN));
        assert_memory_equal(msg, want, (size_t)len);
        e->got++;
        e->next_recv = w.now + e->every;
    }
    while (len = jl_link_output(&e->link, out, JL_FRAME_MAX, w.now), len > 0) {
        assert_in_range(len, JL_FRAME_HEADER + JL_FRAME_TRAILER, JL_FRAME_MAX);
        carry(1 - i, out, len);
    }
    jl_link_judge(&e->link, w.now);
    sleep = jl_link_timer(&e->link, w.now);
    assert_true(sleep > 0 || sleep == -1);
    if (jl_link_peek(&e->link) != JL_EAGAIN && e->told == 0 &&
        (sleep < 0 || sleep > (long)(e->next_recv - w.now)))
        sleep = (long)(e->next_recv - w.now);
    return sleep;
}

/* Let time pass until done() or the limit; returns 1 if done. */
static int run(int (*done)(void), jl_u32 limit_us)
{
    jl_u32 end_at = w.passed + limit_us;

    while (w.passed < end_at) {
        long step = (long)(end_at - w.passed), sleep;
        int i;

        for (i = 0; i < 2; i++) {
            sleep = act(i);
            if (sleep >= 0 && sleep < step)
                step = sleep;
        }
        if (done != NULL && done())
            return 1;
        for (i = 0; i < AIR; i++)
            if (w.air[i].to >= 0 && (long)(int)(w.air[i].at - w.now) < step)
                step = (int)(w.air[i].at - w.now) < 0
                           ? 0 : (long)(int)(w.air[i].at - w.now);
        w.now += (jl_u32)step;
        w.passed += (jl_u32)step;
        for (i = 0; i < AIR; i++)
            if (w.air[i].to >= 0 && (int)(w.now - w.air[i].at) >= 0) {
                datagram d = w.air[i];
                w.air[i].to = -1;
                jl_link_input(&w.e[d.to].link, d.octets, d.len, w.now);
            }
        if (w.replay > 0) {
            datagram *d = &w.tape[dice(w.replay)];
            jl_link_input(&w.e[d->to].link, d->octets, d->len, w.now);
        }
    }
    return 0;
}

static int all_there(void)
{
    return w.e[0].got == w.e[1].goal && w.e[1].got == w.e[0].goal &&
           jl_link_idle(&w.e[0].link) && jl_link_idle(&w.e[1].link);
}

static int both_up(void)
{
    return w.e[0].link.up && w.e[1].link.up;
}

static int idle(void)
{
    return jl_link_idle(&w.e[0].link) && jl_link_idle(&w.e[1].link);
}

static void goals(long a, long b)
{
    w.e[0].goal = a;
    w.e[1].goal = b;
}

static const carrier clean = { 0, 0, 0, 0, 500, 0 };
static const carrier lossy = { 30, 0, 0, 0, 500, 0 };
static const carrier awful = { 25, 20, 5, 5, 200, 8000 };

#define SECONDS(s) ((jl_u32)(s) * 1000000u)

static void test_link_clean(void **state)
{
    (void)state;
    begin(clean, 1);
    goals(1500, 1500);
    assert_true(run(all_there, SECONDS(60)));
    assert_int_equal(w.e[0].link.count.resent, 0);
    assert_int_equal(w.e[1].link.count.resent, 0);
    assert_int_equal(w.e[0].link.count.sent, w.e[1].link.count.received);
    assert_int_equal(w.e[1].link.count.doubled + w.e[1].link.count.early, 0);
    assert_int_equal(w.e[1].link.count.refused + w.e[1].link.count.stale, 0);
    /* all is said: no timer runs, nothing goes out */
    assert_int_equal(jl_link_timer(&w.e[0].link, w.now), -1);
    assert_int_equal(jl_link_timer(&w.e[1].link, w.now), -1);
    assert_int_equal(jl_link_output(&w.e[0].link, msg, JL_FRAME_MAX,
                                    w.now + 9999999), 0);
}

static void test_link_loses_a_third(void **state)
{
    unsigned seed;

    (void)state;
    for (seed = 1; seed <= 4; seed++) {
        begin(lossy, seed);
        goals(600, 600);
        assert_true(run(all_there, SECONDS(900)));
        assert_true(w.e[0].link.count.resent > 100);
        assert_int_equal(w.e[0].link.count.sent, w.e[1].link.count.received);
    }
}

static void test_link_everything_at_once(void **state)
{
    unsigned seed;

    (void)state;
    for (seed = 1; seed <= 6; seed++) {
        begin(awful, seed);
        goals(500, 500);
        assert_true(run(all_there, SECONDS(900)));
        assert_true(w.e[0].link.count.resent > 100);
        assert_true(w.e[0].link.count.doubled > 10);
        assert_true(w.e[0].link.count.early > 10);
        assert_true(w.e[0].link.count.refused > 10);
        assert_int_equal(w.e[0].link.count.sent, w.e[1].link.count.received);
        assert_int_equal(w.e[1].link.count.sent, w.e[0].link.count.received);
    }
}

/* Whatever a bad carrier did, at whatever moment it becomes good: what was sent
 * is there, and known to be there, after the longest wait between repetitions
 * (16 rto_us of 20 ms), two ways there and back of 1 ms, the first for one piece
 * and the second for the rest, and the wait of an acknowledgement (2 ms). */
static void test_link_recovers_with_the_carrier(void **state)
{
    static const carrier blind = { 95, 20, 5, 5, 200, 8000 };
    unsigned seed;

    (void)state;
    for (seed = 1; seed <= 600; seed++) {
        begin(seed % 3 == 0 ? lossy : seed % 3 == 1 ? awful : blind, seed);
        goals(1000000, seed % 2 == 0 ? 0 : 1000000);
        assert_false(run(NULL, 20000 + (jl_u32)dice(2000000)));
        w.c = clean;
        goals(w.e[0].sent, w.e[1].sent);
        assert_true(run(all_there, 16 * 20000 + 2 * 1000 + 2000));
    }
}

static void test_link_one_way(void **state)
{
    (void)state;
    begin(awful, 7);
    goals(500, 0);
    assert_true(run(all_there, SECONDS(900)));
    assert_true(w.e[1].link.count.acks > 0);
}

static void test_link_wraps(void **state)
{
    unsigned seed;
    int i;

    (void)state;
    for (seed = 1; seed <= 3; seed++) {
        begin(seed == 3 ? awful : clean, seed);
        w.now = 0u - 30000u;    /* the clock wraps in the handshake or later */
        start(0, 0x1111);
        start(1, 0x2222);
        for (i = 0; i < 2; i++) {
            jl_link *l = &w.e[i].link;
            l->out_first = l->out_next = l->out_high = l->out_end = 0u - 50u;
            w.e[1 - i].link.in_next = 0u - 50u;
        }
        goals(300, 300);
        assert_true(run(all_there, SECONDS(900)));
        assert_in_range(w.e[0].link.out_end, 250, 2000);
    }
}

static void test_link_receives_slowly(void **state)
{
    (void)state;
    begin(clean, 1);
    goals(100, 0);
    w.e[1].every = 300000;      /* far beyond the longest retransmission */
    assert_true(run(all_there, SECONDS(60)));
    assert_true(w.passed < SECONDS(31));
    assert_true(w.e[1].link.count.early > 0);

    begin(lossy, 2);
    goals(100, 0);
    w.e[1].every = 50000;
    assert_true(run(all_there, SECONDS(60)));
}

/* A receiver that fetches nothing for long, then everything: the sender is
 * told at once. */
static int nothing_moves(void)
{
    return 0;
}

static void test_link_room_is_told(void **state)
{
    (void)state;
    begin(clean, 1);
    w.e[1].next_recv = SECONDS(5);
    goals(40, 0);
    assert_false(run(nothing_moves, SECONDS(5) - 1));
    assert_int_equal(w.e[1].got, 0);
    assert_int_equal(w.e[1].link.in_held, w.e[1].link.window);
    /* one piece at a time is tried, ever more rarely */
    assert_in_range(w.e[0].link.count.resent, 14, 40);
    assert_true(run(all_there, 100000));
}

static void test_link_starts_in_any_order(void **state)
{
    unsigned char out[JL_FRAME_MAX];
    jl_link_config c = config(10, 11, 0x1111);
    jl_u32 now;
    int hellos = 0, len, i;

    (void)state;
    begin(clean, 1);
    for (now = 0; now < SECONDS(3600); now += (jl_u32)jl_link_timer(
                                           &w.e[0].link, now)) {
        len = jl_link_output(&w.e[0].link, out, JL_FRAME_MAX, now);
        if (len > 0) {
            hellos++;
            assert_int_equal(out[3], JL_FRAME_HELLO);
        }
        assert_true(jl_link_timer(&w.e[0].link, now) > 0);
        assert_true(jl_link_timer(&w.e[0].link, now) <= 100000);
    }
    assert_in_range(hellos, 36000, 36010);

    for (i = 0; i < 20; i++) {  /* the second comes up to 95 ms later */
        begin(i < 10 ? clean : awful, (unsigned)i + 1);
        w.e[1].link.hello_now = 0;
        w.e[1].link.wait_us = (jl_u32)i * 5000 + 1;
        goals(5, 5);
        assert_true(run(all_there, SECONDS(20)));
    }
    c.rto_us = JL_LINK_MAX_US;  /* a slow carrier: no HELLO before its time */
    assert_int_equal(jl_link_init(&w.e[0].link, &c, w.e[0].mem, MEM, 0), JL_OK);
    assert_true(jl_link_output(&w.e[0].link, out, JL_FRAME_MAX, 0) > 0);
    assert_int_equal(jl_link_timer(&w.e[0].link, 0), JL_LINK_MAX_US);
    assert_true(jl_link_output(&w.e[0].link, out, JL_FRAME_MAX,
                               JL_LINK_MAX_US) > 0);
    assert_int_equal(jl_link_timer(&w.e[0].link, JL_LINK_MAX_US),
                     JL_LINK_MAX_US);
}

static void test_link_peer_restarts(void **state)
{
    unsigned seed;
    jl_u32 session = 0x3333;
    int old;

    (void)state;
    for (seed = 1; seed <= 20; seed++) {
        begin(seed % 2 ? clean : awful, seed);
        goals(1000, 1000);
        run(NULL, 30000 + (jl_u32)dice(1000000));
        w.e[1].close = 0;
        old = w.e[0].link.up;
        start(1, session++);
        run(NULL, SECONDS(3));
        if (!old) {             /* it never knew the first one */
            assert_true(both_up());
            continue;
        }
        assert_int_equal(w.e[0].told, JL_EPEER);
        assert_int_equal(jl_link_send(&w.e[0].link, msg, 1), JL_EPEER);
        assert_int_equal(jl_link_recv(&w.e[0].link, msg, MAX_LEN), JL_EPEER);
        assert_int_equal(jl_link_timer(&w.e[0].link, w.now), -1);
        assert_int_equal(jl_link_idle(&w.e[0].link), 1);
        assert_false(w.e[1].link.up);
        assert_int_equal(w.e[1].got, 0);
        /* a new link at this end too, and all is well, for good */
        start(0, session++);
        goals(50, 50);
        assert_true(run(all_there, SECONDS(60)));
        run(NULL, SECONDS(2));
        assert_true(both_up());
        assert_int_equal(w.e[0].told | w.e[1].told, 0);
    }
}

/* An end that answers a HELLO of the new life, and then is brought up by a
 * late one of the old: the new life is up and silent, and must make it ask. */
static void test_link_late_hello_of_an_old_life(void **state)
{
    unsigned char out[JL_FRAME_MAX], late[JL_FRAME_MAX];
    jl_link *l0 = &w.e[0].link, *l1 = &w.e[1].link;
    int len;

    (void)state;
    begin(clean, 1);
    len = jl_link_output(l0, out, JL_FRAME_MAX, w.now);
    assert_int_equal(jl_link_input(l1, out, len, w.now), JL_OK);
    assert_int_equal(jl_link_output(l1, late, JL_FRAME_MAX, w.now), 36);
    start(1, 0x3333);
    len = jl_link_output(l1, out, JL_FRAME_MAX, w.now);
    assert_int_equal(jl_link_input(l0, out, len, w.now), JL_OK);
    len = jl_link_output(l0, out, JL_FRAME_MAX, w.now);
    assert_int_equal(jl_link_input(l1, out, len, w.now), JL_OK);
    assert_int_equal(l1->up, 1);
    assert_true(jl_link_output(l1, out, JL_FRAME_MAX, w.now) > 0);  /* lost */
    assert_int_equal(jl_link_input(l0, late, 36, w.now), JL_OK);
    assert_int_equal(l0->up, 1);
    goals(1, 0);
    run(NULL, SECONDS(1));
    assert_int_equal(w.e[0].told, JL_EPEER);
    assert_int_equal(w.e[1].got, 0);
}

/* What had wholly arrived before the restart is still fetched. */
static void test_link_restart_drains(void **state)
{
    (void)state;
    begin(clean, 1);
    goals(3, 0);
    w.e[1].next_recv = SECONDS(100);
    run(NULL, SECONDS(1));
    assert_int_equal(w.e[1].link.in_held > 0, 1);
    start(0, 0x3333);
    run(NULL, SECONDS(1));
    assert_int_equal(w.e[1].link.failed, JL_EPEER);
    w.e[1].next_recv = w.now;
    run(NULL, 1);
    assert_int_equal(w.e[1].got, 3);
    assert_int_equal(w.e[1].told, JL_EPEER);
}

/* Both restart again and again at odd moments over a bad carrier: in the end
 * two links that stand. */
static void test_link_restarts_settle(void **state)
{
    jl_u32 session = 0x4000;
    unsigned seed;
    int i, k;

    (void)state;
    for (seed = 1; seed <= 40; seed++) {
        begin(awful, seed);
        w.c.spread = 60000;
        for (k = 0; k < 6; k++) {
            start(dice(2), session++);
            goals(3, 3);
            run(NULL, (jl_u32)dice(80000));
        }
        for (k = 0; k < 20; k++) {      /* a program that starts anew */
            for (i = 0; i < 2; i++)
                if (w.e[i].link.failed != JL_OK)
                    start(i, session++);
            run(NULL, SECONDS(1));
        }
        assert_true(both_up());
        assert_int_equal(w.e[0].link.peer, w.e[1].link.config.session);
        assert_int_equal(w.e[1].link.peer, w.e[0].link.config.session);
    }
}

/* A whole earlier session is played to both ends, before, during and after
 * the next one's handshake: nothing of it is delivered, nothing breaks. */
static void test_link_replay_of_a_session(void **state)
{
    unsigned seed;
    int i, taped;

    (void)state;
    for (seed = 1; seed <= 8; seed++) {
        begin(seed % 2 ? clean : awful, seed);
        goals(60, 60);
        w.e[0].close = (int)(seed & 2);
        run(all_there, SECONDS(20));
        assert_true(w.e[0].got > 20 && w.e[1].got > 20);
        taped = w.taped;
        start(0, 0x5555);
        start(1, 0x6666);
        for (i = 0; i < taped; i++)     /* all, in order */
            jl_link_input(&w.e[w.tape[i].to].link, w.tape[i].octets,
                          w.tape[i].len, w.now);
        assert_false(w.e[0].link.up || w.e[1].link.up);
        w.replay = seed > 4 ? taped : 0;        /* one more at every step */
        goals(60, 60);
        assert_true(run(all_there, SECONDS(100)));
        w.replay = 0;
        assert_int_equal(w.e[0].got, 60);
        for (i = 0; i < taped; i++) {   /* again, and both may answer */
            jl_link_input(&w.e[w.tape[i].to].link, w.tape[i].octets,
                          w.tape[i].len, w.now);
            if (i % 8 == 0)
                run(NULL, 1000);
        }
        run(NULL, SECONDS(1));
        assert_true(both_up());
        assert_int_equal(w.e[0].told | w.e[1].told, 0);
        assert_int_equal(w.e[0].got, 60);
        assert_int_equal(w.e[1].got, 60);
        assert_true(w.e[0].link.count.stale > 0);
        goals(80, 80);                  /* and it goes on working */
        assert_true(run(all_there, SECONDS(100)));
    }
}

/* Its own session played back to a link that is up, answers to DOUBT and all:
 * doubled, nothing else. */
static void test_link_replay_of_itself(void **state)
{
    int taped, i;

    (void)state;
    begin(lossy, 3);
    goals(100, 100);
    run(NULL, SECONDS(1));
    taped = w.taped;
    for (i = 0; i < taped; i++) {
        jl_link_input(&w.e[w.tape[i].to].link, w.tape[i].octets,
                      w.tape[i].len, w.now);
        run(NULL, 500);
    }
    assert_true(run(all_there, SECONDS(100)));
    assert_true(both_up());
    assert_true(w.e[0].link.count.doubled > 0);
}

/* A frame made by hand, as end 0 would send it to end 1. */
static int forge(int kind, jl_u32 session, jl_u32 peer, jl_u32 seq, jl_u32 ack,
                 int len)
{
    unsigned char out[JL_FRAME_MAX];
    jl_frame f = { 0, 8, 10, 11, 0, 0, 0, 0, NULL, 0 };

    f.kind = kind;
    f.session = session;
    f.peer = peer;
    f.seq = seq;
    f.ack = ack;
    f.payload = want;
    f.len = len;
    len = jl_frame_encode(out, JL_FRAME_MAX, &f);
    assert_true(len > 0);
    return jl_link_input(&w.e[1].link, out, len, w.now);
}

static void up(void)
{
    begin(clean, 1);
    assert_true(run(both_up, SECONDS(1)));
    run(NULL, SECONDS(1));
}

static void test_link_hello_to_an_up_link(void **state)
{
    unsigned char out[JL_FRAME_MAX];
    unsigned long stale;

    (void)state;
    up();
    stale = w.e[1].link.count.stale;
    /* of another session: it is asked, once, and does not answer */
    assert_int_equal(forge(JL_FRAME_HELLO, 0x7777, 0, 0, 0, 0), JL_EPEER);
    assert_int_equal(jl_link_timer(&w.e[1].link, w.now), 0);
    assert_true(jl_link_output(&w.e[1].link, out, JL_FRAME_MAX, w.now) > 0);
    assert_int_equal(out[3], JL_FRAME_DOUBT);
    assert_int_equal(jl_get_u32(out + 12), 0x7777);
    assert_int_equal(jl_get_u32(out + 16), 0);
    assert_int_equal(jl_link_output(&w.e[1].link, out, JL_FRAME_MAX, w.now), 0);
    assert_int_equal(forge(JL_FRAME_HELLO, 0x7777, 0x2222, 0, 0, 0), JL_EPEER);
    assert_int_equal(forge(JL_FRAME_DATA, 0x7777, 0x2222, 0, 0,
                           JL_FRAME_PAYLOAD), JL_EPEER);
    assert_int_equal(forge(JL_FRAME_ALIVE, 0x7777, 0x2221, 0, 0, 0), JL_EPEER);
    assert_int_equal(w.e[1].link.count.stale, stale + 4);
    assert_int_equal(w.e[1].link.failed, JL_OK);
    /* of this session: it is acknowledged */
    assert_true(jl_link_output(&w.e[1].link, out, JL_FRAME_MAX, w.now) > 0);
    assert_int_equal(forge(JL_FRAME_HELLO, 0x1111, 0, 0, 0, 0), JL_OK);
    assert_true(jl_link_output(&w.e[1].link, out, JL_FRAME_MAX, w.now) > 0);
    assert_int_equal(out[3], JL_FRAME_ACK);
    assert_int_equal(forge(JL_FRAME_ALIVE, 0x1111, 0x2222, 0, 0, 0), JL_EPEER);
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2223, 0, 0, 4), JL_EPEER);
    assert_true(both_up());
    /* and this is the real thing */
    assert_int_equal(forge(JL_FRAME_ALIVE, 0x7777, 0x2222, 0, 0, 0), JL_EPEER);
    assert_int_equal(w.e[1].link.failed, JL_EPEER);
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2222, 0, 0, 4), JL_EPEER);
    assert_int_equal(jl_link_output(&w.e[1].link, out, JL_FRAME_MAX, w.now), 0);
}

static void test_link_hello_repeats(void **state)
{
    static const long waits[] = { 20000, 40000, 80000, 100000, 100000 };
    unsigned char out[JL_FRAME_MAX];
    jl_link *l = &w.e[1].link;
    int i;

    (void)state;
    begin(clean, 1);
    assert_int_equal(jl_link_timer(l, w.now), 0);
    for (i = 0; i < 5; i++) {
        assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 36);
        assert_int_equal(out[3], JL_FRAME_HELLO);
        assert_int_equal(jl_get_u32(out + 8), 0x2222);
        assert_int_equal(jl_get_u32(out + 12), 0);
        assert_int_equal(jl_get_u32(out + 16), 0);
        assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 0);
        assert_int_equal(jl_link_timer(l, w.now), waits[i]);
        assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX,
                                        w.now + (jl_u32)waits[i] - 1),
                         0);
        w.now += (jl_u32)waits[i];
    }
    /* a HELLO is answered at once */
    jl_link_output(l, out, JL_FRAME_MAX, w.now);
    assert_int_equal(forge(JL_FRAME_HELLO, 0x1111, 0, 0, 0, 0), JL_OK);
    assert_int_equal(jl_link_timer(l, w.now), 0);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 36);
    assert_int_equal(out[3], JL_FRAME_HELLO);
    assert_int_equal(jl_get_u32(out + 12), 0x1111);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 0);
    assert_int_equal(l->up, 0);
    /* and once up, it is the data's waiting time that counts */
    assert_int_equal(forge(JL_FRAME_HELLO, 0x1111, 0x2222, 0, 0, 0), JL_OK);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 36);
    assert_int_equal(out[3], JL_FRAME_ACK);
    assert_int_equal(l->count.acks, 1);
    assert_int_equal(jl_link_send(l, msg, 1), JL_OK);
    assert_int_equal(jl_link_send(l, msg, 1), JL_OK);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 37);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 37);
    assert_int_equal(jl_link_timer(l, w.now), 20000);
}

/* Room is told sooner than at half a ring when all that is left is a message
 * whose rest had no room. */
static void test_link_room_for_the_rest(void **state)
{
    unsigned char out[JL_FRAME_MAX];
    jl_link *l = &w.e[1].link;
    jl_link_config c = config(11, 10, 0x2222);
    jl_u32 i;

    (void)state;
    begin(clean, 1);
    c.slots = 1;
    assert_int_equal(jl_link_init(l, &c, w.e[1].mem, MEM, w.now), JL_OK);
    assert_int_equal(l->window, 3);
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2222, 0, 0, 4), JL_OK);
    for (i = 1; i < 3; i++)
        assert_int_equal(forge(JL_FRAME_DATA, 0x1111, 0x2222, i, 0,
                               JL_FRAME_PAYLOAD), JL_OK);
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2222, 3, 0, 4), JL_EAGAIN);
    while (jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0)
        assert_int_equal(jl_get_u32(out + 16), 0);
    assert_int_equal(jl_link_recv(l, msg, MAX_LEN), 4);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 36);
    assert_int_equal(jl_get_u32(out + 16), 1);
    assert_int_equal(jl_get_u32(out + 20), 3);
}

/* Room is told once, when half of the ring is free. */
static void test_link_room_at_half(void **state)
{
    unsigned char out[JL_FRAME_MAX];
    jl_link *l = &w.e[1].link;
    jl_u32 i, window;
    int status;

    (void)state;
    up();
    window = (jl_u32)l->window;
    assert_int_equal(window, 6);
    for (i = 0; i < window; i++)
        assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2222, i, 0, 4), JL_OK);
    assert_true(jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0);
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2222, i, 0, 4), JL_EAGAIN);
    assert_int_equal(l->count.early, 1);
    for (i = 0; i < window; i++) {
        assert_int_equal(jl_link_timer(l, w.now), -1);
        assert_int_equal(jl_link_recv(l, msg, MAX_LEN), 4);
        if (i == 2) {
            assert_int_equal(jl_link_timer(l, w.now), 0);
            assert_true(jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0);
            assert_int_equal(out[3], JL_FRAME_ACK);
            assert_int_equal(jl_get_u32(out + 16), 1);
            assert_int_equal(jl_get_u32(out + 20), window);
        }
    }
    assert_int_equal(jl_link_timer(l, w.now), -1);
    /* not when what was dropped has come by itself */
    for (i = window; i < 2 * window; i++)
        forge(JL_FRAME_LAST, 0x1111, 0x2222, i, 0, 4);
    forge(JL_FRAME_LAST, 0x1111, 0x2222, i, 0, 4);
    assert_int_equal(jl_link_recv(l, msg, MAX_LEN), 4);
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2222, i, 0, 4), JL_OK);
    while (jl_link_recv(l, msg, MAX_LEN) >= 0)
        ;
    while (status = jl_link_output(l, out, JL_FRAME_MAX, w.now), status > 0)
        assert_int_equal(jl_get_u32(out + 16), 0);
    /* the other side of it: told of room, send at once */
    for (i = 0; i < 3; i++)
        assert_int_equal(jl_link_send(l, msg, 1), JL_OK);
    while (jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0)
        ;
    assert_int_equal(forge(JL_FRAME_ACK, 0x1111, 0x2222, 1, 1, 0), JL_OK);
    assert_int_equal(jl_link_timer(l, w.now), 0);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 37);
    assert_int_equal(jl_get_u32(out + 16), 1);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 37);
    assert_int_equal(jl_get_u32(out + 16), 2);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 0);
    /* progress starts the waiting time anew */
    w.now += 15000;
    assert_int_equal(forge(JL_FRAME_ACK, 0x1111, 0x2222, 0, 2, 0), JL_OK);
    assert_int_equal(jl_link_timer(l, w.now), 20000);
}

/* What end 1 has to say next: nothing (0), or its ACK, which asks or not. */
enum { NOTHING, ACKS, ASKS };

static int says(jl_u32 ack)
{
    unsigned char out[JL_FRAME_MAX];
    int len = jl_link_output(&w.e[1].link, out, JL_FRAME_MAX, w.now);

    if (len == 0)
        return NOTHING;
    assert_int_equal(out[3], JL_FRAME_ACK);
    assert_int_equal(jl_get_u32(out + 20), ack);
    return ACKS + (int)jl_get_u32(out + 16);
}

static int piece(jl_u32 seq)
{
    return forge(JL_FRAME_LAST, 0x1111, 0x2222, seq, 0, 4);
}

static void test_link_asks_for_the_missing(void **state)
{
    jl_link *l = &w.e[1].link;
    jl_u32 i;

    (void)state;
    up();
    assert_int_equal(piece(2), JL_EORDER);
    assert_int_equal(jl_link_timer(l, w.now), 0);
    assert_int_equal(says(0), ASKS);
    for (i = 3; i < 6; i++)             /* once */
        assert_int_equal(piece(i), JL_EORDER);
    assert_int_equal(says(0), NOTHING);
    assert_int_equal(piece(1), JL_EORDER);      /* it starts again, in vain */
    assert_int_equal(says(0), ASKS);
    assert_int_equal(piece(2), JL_EORDER);
    assert_int_equal(says(0), NOTHING);
    assert_int_equal(piece(2), JL_EORDER);
    assert_int_equal(says(0), ASKS);
    assert_int_equal(piece(0), JL_OK);
    assert_int_equal(says(1), NOTHING);
    assert_int_equal(piece(5), JL_EORDER);      /* another is missing */
    assert_int_equal(says(1), ASKS);
    assert_int_equal(piece(7), JL_EORDER);
    assert_int_equal(piece(6), JL_EORDER);
    assert_int_equal(piece(1), JL_OK);          /* it came by itself, but */
    assert_int_equal(says(2), ASKS);            /* the next was dropped   */
    assert_int_equal(l->count.early, 10);
}

static void test_link_does_not_ask_without_room(void **state)
{
    jl_link *l = &w.e[1].link;
    jl_u32 i, window;

    (void)state;
    up();
    window = (jl_u32)l->window;
    for (i = 0; i < window; i++)
        assert_int_equal(piece(i), JL_OK);
    assert_int_equal(says(window), ACKS);
    assert_int_equal(piece(window + 1), JL_EAGAIN);
    assert_int_equal(says(window), NOTHING);
    assert_int_equal(jl_link_recv(l, msg, MAX_LEN), 4);
    assert_int_equal(piece(window + 2), JL_EORDER);
    assert_int_equal(piece(window + 1), JL_EORDER);
    assert_int_equal(says(window), NOTHING);
    assert_int_equal(piece(window), JL_OK);     /* from here on as ever */
    assert_int_equal(jl_link_recv(l, msg, MAX_LEN), 4);
    assert_int_equal(piece(window + 3), JL_EORDER);
    assert_int_equal(says(window + 1), ASKS);
}

/* The first of six is lost: all six are there before any time has passed. */
static void test_link_mends_a_loss_at_once(void **state)
{
    unsigned char out[JL_FRAME_MAX];
    jl_link *from = &w.e[0].link, *to = &w.e[1].link;
    int i, len, lost = 0;

    (void)state;
    up();
    for (i = 0; i < 6; i++)
        assert_int_equal(jl_link_send(from, msg, 1), JL_OK);
    for (i = 0; i < 3; i++) {
        while (len = jl_link_output(from, out, JL_FRAME_MAX, w.now), len > 0)
            if (lost++ > 0)
                jl_link_input(to, out, len, w.now);
        while (len = jl_link_output(to, out, JL_FRAME_MAX, w.now), len > 0)
            jl_link_input(from, out, len, w.now);
    }
    for (i = 0; i < 6; i++)
        assert_int_equal(jl_link_recv(to, msg, MAX_LEN), 1);
    assert_int_equal(from->count.resent, 6);
    assert_true(idle());
}

/* However often the same piece is asked for, it is sent again a few times only,
 * until it is acknowledged or its time is out. */
static void test_link_heeds_few_asks(void **state)
{
    unsigned char out[JL_FRAME_MAX];
    jl_link *l = &w.e[1].link;
    int round, asked, sent;

    (void)state;
    up();
    for (round = 0; round < 3; round++) {
        assert_int_equal(jl_link_send(l, msg, 1), JL_OK);
        for (asked = sent = 0; asked < 20; asked++) {
            while (jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0)
                sent++;
            forge(JL_FRAME_ACK, 0x1111, 0x2222, 1, (jl_u32)round, 0);
        }
        assert_in_range(sent, 3, 10);
        if (round == 1) {               /* its time is out */
            w.now += (jl_u32)jl_link_timer(l, w.now);
            sent = 0;
            while (jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0)
                sent++;
            forge(JL_FRAME_ACK, 0x1111, 0x2222, 1, (jl_u32)round, 0);
            while (jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0)
                sent++;
            assert_int_equal(sent, 2);
        }
        forge(JL_FRAME_ACK, 0x1111, 0x2222, 0, (jl_u32)round + 1, 0);
    }
}

/* --- beat and silence ---------------------------------------------------- */

/* Both ends up at w.now; end 1 with these times. */
static void up_with(jl_u32 beat_us, jl_u32 silence_us)
{
    up();
    w.e[1].link.config.beat_us = beat_us;
    w.e[1].link.config.silence_us = silence_us;
    forge(JL_FRAME_ACK, 0x1111, 0x2222, 0, 0, 0);
    w.e[1].link.said_at = w.now;
}

static void test_link_beats(void **state)
{
    unsigned char out[JL_FRAME_MAX];
    jl_link *l = &w.e[1].link;

    (void)state;
    up_with(10000, 0);
    assert_int_equal(jl_link_timer(l, w.now), 10000);
    w.now += 9999;
    assert_int_equal(says(0), NOTHING);
    assert_int_equal(jl_link_timer(l, w.now), 1);
    w.now += 1;
    assert_int_equal(says(0), ACKS);
    assert_int_equal(says(0), NOTHING);
    w.now += 4000;
    assert_int_equal(jl_link_timer(l, w.now), 6000);
    /* data is a word as well, and so is an acknowledgement */
    assert_int_equal(jl_link_send(l, msg, 1), JL_OK);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 37);
    forge(JL_FRAME_ACK, 0x1111, 0x2222, 0, 1, 0);
    w.now += 9999;
    assert_int_equal(says(0), NOTHING);
    assert_int_equal(piece(0), JL_OK);
    assert_int_equal(piece(0), JL_EORDER);
    assert_int_equal(says(1), ACKS);
    w.now += 9999;
    assert_int_equal(says(1), NOTHING);
    w.now += 1;
    assert_int_equal(says(1), ACKS);
    /* the other end closes, and may still listen */
    assert_int_equal(forge(JL_FRAME_BYE, 0x1111, 0x2222, 1, 1, 0), JL_OK);
    assert_int_equal(says(2), ACKS);
    w.now += 10000;
    assert_int_equal(says(2), ACKS);
    /* we close, and it knows */
    jl_link_close(l);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 36);
    assert_int_equal(out[3], JL_FRAME_BYE);
    assert_int_equal(jl_link_timer(l, w.now), 10000);
    forge(JL_FRAME_ACK, 0x1111, 0x2222, 0, 2, 0);
    assert_int_equal(jl_link_timer(l, w.now), -1);
    w.now += 10000;
    assert_int_equal(says(2), NOTHING);
}

/* Listen for us microseconds as a port does; 1 if the link has failed. */
static int listens_in_vain(jl_u32 us)
{
    jl_link *l = &w.e[1].link;
    jl_u32 end_at = w.now + us;

    while (w.now != end_at) {
        long step = jl_link_timer(l, w.now);

        if (step == -1)
            break;
        assert_true(step > 0);
        if (step > (long)(end_at - w.now))
            step = (long)(end_at - w.now);
        w.now += (jl_u32)step;
        if (jl_link_judge(l, w.now) != JL_OK)
            return 1;
    }
    return 0;
}

static void test_link_notices_silence(void **state)
{
    unsigned char out[JL_FRAME_MAX];
    jl_link *l = &w.e[1].link;
    jl_u32 heard;
    int i;

    (void)state;
    for (i = 0; i < 3; i++) {
        up_with(i == 1 ? 7000 : 0, 80000);
        w.now = i == 2 ? 0u - 30000u : w.now;   /* the clock wraps */
        heard = w.now;
        assert_int_equal(piece(0), JL_OK);
        assert_int_equal(forge(JL_FRAME_DATA, 0x1111, 0x2222, 1, 0,
                               JL_FRAME_PAYLOAD), JL_OK);
        if (i != 1)
            assert_int_equal(says(2), NOTHING);
        l->ack_due = 0;
        assert_int_equal(jl_link_silence(l, w.now), 0);
        while (i == 1 && w.now - heard < 79000) {   /* also while it beats */
            jl_link_output(l, out, JL_FRAME_MAX, w.now);
            assert_false(listens_in_vain(1000));
        }
        if (i == 1)
            l->config.beat_us = 0;
        else
            assert_false(listens_in_vain(79000));
        assert_int_equal(jl_link_silence(l, w.now), 79000);
        assert_false(listens_in_vain(999));
        assert_true(listens_in_vain(1));
        /* it is over, but for what had wholly arrived */
        assert_int_equal(jl_link_silence(l, w.now), 80000);
        assert_int_equal(jl_link_judge(l, w.now), JL_ESILENT);
        assert_int_equal(jl_link_send(l, msg, 1), JL_ESILENT);
        assert_int_equal(jl_link_recv(l, msg, MAX_LEN), 4);
        assert_int_equal(jl_link_recv(l, msg, MAX_LEN), JL_ESILENT);
        assert_int_equal(piece(1), JL_EPEER);
        assert_int_equal(jl_link_timer(l, w.now), -1);
        assert_int_equal(says(1), NOTHING);
        assert_int_equal(jl_link_idle(l), 1);
    }
}

/* Whatever proves that the session lives is a word; what does not, is not. */
static void test_link_hears(void **state)
{
    static const struct {
        int kind;
        jl_u32 session, peer, seq;
        int heard;
    } word[] = {
        { JL_FRAME_ACK, 0x1111, 0x2222, 0, 1 },
        { JL_FRAME_LAST, 0x1111, 0x2222, 5, 1 },        /* early */
        { JL_FRAME_HELLO, 0x1111, 0, 0, 1 },
        { JL_FRAME_ACK, 0x1111, 0x2223, 0, 0 },
        { JL_FRAME_ALIVE, 0x1111, 0x2222, 0, 0 },
        { JL_FRAME_HELLO, 0x3333, 0, 0, 0 },
        { JL_FRAME_LAST, 0x3333, 0x2222, 0, 0 },
        { JL_FRAME_DOUBT, 0x3333, 0x2222, 0, 0 }
    };
    unsigned char out[JL_FRAME_MAX];
    unsigned i;

    (void)state;
    for (i = 0; i < sizeof word / sizeof *word; i++) {
        up_with(0, 80000);
        assert_false(listens_in_vain(75000));
        forge(word[i].kind, word[i].session, word[i].peer, word[i].seq, 0,
              word[i].kind == JL_FRAME_LAST ? 4 : 0);
        while (jl_link_output(&w.e[1].link, out, JL_FRAME_MAX, w.now) > 0)
            ;
        assert_int_equal(jl_link_silence(&w.e[1].link, w.now),
                         word[i].heard ? 0 : 75000);
        assert_int_equal(listens_in_vain(10000), !word[i].heard);
    }
}

/* An end that was stopped for long, or comes seldom, has not listened. */
static void test_link_absence_is_not_silence(void **state)
{
    unsigned char out[JL_FRAME_MAX];
    jl_link *l = &w.e[1].link;
    int i;

    (void)state;
    up_with(0, 80000);
    w.now += SECONDS(100);
    assert_int_equal(jl_link_timer(l, w.now), 0);
    assert_int_equal(jl_link_judge(l, w.now), JL_OK);
    assert_int_equal(jl_link_judge(l, w.now), JL_OK);
    assert_int_equal(jl_link_silence(l, w.now), JL_LINK_MAX_US);
    assert_false(listens_in_vain(60000));
    assert_int_equal(piece(0), JL_OK);
    l->ack_due = 0;
    assert_int_equal(jl_link_silence(l, w.now), 0);
    for (i = 0; i < 7; i++) {
        w.now += SECONDS(i % 2 ? 4220 : 100);   /* the clock goes round */
        assert_int_equal(jl_link_judge(l, w.now), JL_OK);
        assert_int_equal(jl_link_silence(l, w.now), JL_LINK_MAX_US);
    }
    assert_true(listens_in_vain(10000));
    /* one that does not ask is never told, and one that closed may be silent */
    up_with(0, 0);
    assert_false(listens_in_vain(SECONDS(9)));
    assert_int_equal(jl_link_timer(l, w.now), -1);
    up_with(0, 80000);
    assert_int_equal(forge(JL_FRAME_BYE, 0x1111, 0x2222, 0, 0, 0), JL_OK);
    assert_int_equal(says(1), ACKS);
    assert_false(listens_in_vain(SECONDS(9)));
    assert_int_equal(jl_link_silence(l, w.now), -1);
    assert_int_equal(jl_link_recv(l, msg, MAX_LEN), JL_ECLOSED);
    /* ... but not while it owes us an acknowledgement */
    up_with(0, 80000);
    assert_int_equal(jl_link_send(l, msg, 1), JL_OK);
    assert_int_equal(forge(JL_FRAME_BYE, 0x1111, 0x2222, 0, 0, 0), JL_OK);
    for (i = 1; i <= 80; i++) {
        while (jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0)
            ;
        w.now += 1000;
        assert_int_equal(jl_link_judge(l, w.now), i < 80 ? JL_OK : JL_ESILENT);
    }
    assert_true(jl_link_idle(l));
    /* one that never came is not silent either */
    begin(clean, 1);
    l->config.silence_us = 80000;
    for (i = 0; i < 20; i++) {
        w.now += 20000;
        assert_int_equal(jl_link_judge(l, w.now), JL_OK);
    }
    assert_int_equal(jl_link_silence(l, w.now), -1);
}

/* Half an hour without a message over a bad carrier: no false alarm. */
static void test_link_beats_keep_it(void **state)
{
    int i;

    (void)state;
    begin(awful, 3);
    for (i = 0; i < 2; i++) {
        w.e[i].link.config.beat_us = 50000;
        w.e[i].link.config.silence_us = 1000000;
    }
    goals(10, 10);
    assert_true(run(all_there, SECONDS(100)));
    run(NULL, SECONDS(1800));
    assert_true(both_up());
    assert_int_equal(w.e[0].told | w.e[1].told, 0);
    w.c.lose = 100;                     /* the carrier is cut */
    w.c.twice = 0;
    run(NULL, SECONDS(2));
    for (i = 0; i < 2; i++)
        assert_int_equal(jl_link_recv(&w.e[i].link, msg, MAX_LEN), JL_ESILENT);
}

static void test_link_before_it_is_up(void **state)
{
    unsigned char out[JL_FRAME_MAX];

    (void)state;
    begin(clean, 1);
    assert_true(jl_link_output(&w.e[1].link, out, JL_FRAME_MAX, w.now) > 0);
    /* data of somebody who does not know us; an answer to nothing */
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0, 0, 0, 4), JL_EPEER);
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2223, 0, 0, 4), JL_EPEER);
    assert_int_equal(forge(JL_FRAME_ALIVE, 0x1111, 0x2222, 0, 0, 0), JL_EPEER);
    assert_int_equal(forge(JL_FRAME_DOUBT, 0x1111, 0x2223, 0, 0, 0), JL_EPEER);
    assert_int_equal(jl_link_output(&w.e[1].link, out, JL_FRAME_MAX, w.now), 0);
    /* who doubts is answered, and does not bring us up */
    assert_int_equal(forge(JL_FRAME_DOUBT, 0x1110, 0x2222, 0, 0, 0), JL_OK);
    assert_int_equal(jl_link_timer(&w.e[1].link, w.now), 0);
    assert_true(jl_link_output(&w.e[1].link, out, JL_FRAME_MAX, w.now) > 0);
    assert_int_equal(out[3], JL_FRAME_ALIVE);
    assert_int_equal(jl_get_u32(out + 12), 0x1110);
    assert_int_equal(jl_get_u32(out + 16), 0);
    assert_int_equal(w.e[1].link.up, 0);
    assert_int_equal(jl_link_recv(&w.e[1].link, msg, MAX_LEN), JL_EAGAIN);
    /* data of one who knows us do */
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2222, 0, 0, 4), JL_OK);
    assert_int_equal(w.e[1].link.up, 1);
    assert_int_equal(jl_link_recv(&w.e[1].link, msg, MAX_LEN), 4);
}

static void test_link_refuses_foreign(void **state)
{
    unsigned char out[JL_FRAME_MAX];
    jl_frame f = { JL_FRAME_LAST, 8, 10, 11, 0x1111, 0x2222, 0, 0, want, 5 };
    jl_link *l = &w.e[1].link;
    int len;

    (void)state;
    up();
    f.from = 9;
    len = jl_frame_encode(out, JL_FRAME_MAX, &f);
    assert_int_equal(jl_link_input(l, out, len, w.now), JL_EMSG);
    f.from = 10, f.to = 12;
    len = jl_frame_encode(out, JL_FRAME_MAX, &f);
    assert_int_equal(jl_link_input(l, out, len, w.now), JL_EMSG);
    f.to = 11, f.number = 4;
    len = jl_frame_encode(out, JL_FRAME_MAX, &f);
    assert_int_equal(jl_link_input(l, out, len, w.now), JL_ENUMBER);
    f.number = 8;
    len = jl_frame_encode(out, JL_FRAME_MAX, &f);
    out[len - 5] ^= 1;
    assert_int_equal(jl_link_input(l, out, len, w.now), JL_ECRC);
    out[len - 5] ^= 1;
    assert_int_equal(jl_link_input(l, out, len - 1, w.now), JL_ELENGTH);
    assert_int_equal(jl_link_input(l, out, 0, w.now), JL_ELENGTH);
    assert_int_equal(l->count.refused, 6);
    assert_int_equal(l->count.received, 0);
    assert_int_equal(jl_link_output(l, msg, JL_FRAME_MAX, w.now), 0);
    assert_int_equal(jl_link_input(l, out, len, w.now), JL_OK);
    assert_int_equal(l->count.received, 1);
}

/* A peer with the right session that breaks the rules. */
static void test_link_hostile_peer(void **state)
{
    jl_link *l = &w.e[1].link;
    int rest = MAX_LEN - 2 * JL_FRAME_PAYLOAD;

    (void)state;
    up();
    /* pieces that are not full, and would fill the ring with no message */
    assert_int_equal(forge(JL_FRAME_DATA, 0x1111, 0x2222, 0, 0, 0), JL_ELENGTH);
    assert_int_equal(forge(JL_FRAME_DATA, 0x1111, 0x2222, 0, 0,
                           JL_FRAME_PAYLOAD - 1), JL_ELENGTH);
    /* more than max_len */
    assert_int_equal(forge(JL_FRAME_DATA, 0x1111, 0x2222, 0, 0,
                           JL_FRAME_PAYLOAD), JL_OK);
    assert_int_equal(forge(JL_FRAME_DATA, 0x1111, 0x2222, 1, 0,
                           JL_FRAME_PAYLOAD), JL_OK);
    assert_int_equal(forge(JL_FRAME_DATA, 0x1111, 0x2222, 2, 0,
                           JL_FRAME_PAYLOAD), JL_ELENGTH);
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2222, 2, 0, rest + 1),
                     JL_ELENGTH);
    assert_int_equal(l->count.refused, 4);
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2222, 2, 0, rest), JL_OK);
    assert_int_equal(jl_link_recv(l, msg, MAX_LEN - 1), JL_ETOOLONG);
    assert_int_equal(jl_link_recv(l, msg, MAX_LEN), MAX_LEN);
    /* acknowledgements of what was never sent, and old ones */
    assert_int_equal(jl_link_send(l, msg, 7), JL_OK);
    assert_int_equal(forge(JL_FRAME_ACK, 0x1111, 0x2222, 0, 1, 0), JL_OK);
    assert_int_equal(forge(JL_FRAME_ACK, 0x1111, 0x2222, 1, 0xFFFFFFFFu, 0),
                     JL_OK);
    assert_int_equal(l->out_first, 0);
    assert_int_equal(l->out_end, 1);
    /* BYE in the middle of a message, and data behind it */
    assert_int_equal(forge(JL_FRAME_DATA, 0x1111, 0x2222, 3, 0,
                           JL_FRAME_PAYLOAD), JL_OK);
    assert_int_equal(forge(JL_FRAME_BYE, 0x1111, 0x2222, 4, 0, 0), JL_OK);
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2222, 5, 0, 9), JL_EMSG);
    assert_int_equal(jl_link_recv(l, msg, MAX_LEN), JL_ECLOSED);
}

/* max_len a multiple of a frame: an empty last piece would be one too many. */
static void test_link_hostile_empty_last(void **state)
{
    static unsigned char mem[JL_LINK_MEM(2 * JL_FRAME_PAYLOAD, 1)];
    jl_link_config c = config(11, 10, 0x2222);

    (void)state;
    begin(clean, 1);
    c.max_len = 2 * JL_FRAME_PAYLOAD;
    c.slots = 1;
    assert_int_equal(jl_link_init(&w.e[1].link, &c, mem, (int)sizeof mem, 0),
                     JL_OK);
    assert_int_equal(forge(JL_FRAME_DATA, 0x1111, 0x2222, 0, 0,
                           JL_FRAME_PAYLOAD), JL_OK);
    assert_int_equal(forge(JL_FRAME_DATA, 0x1111, 0x2222, 1, 0,
                           JL_FRAME_PAYLOAD), JL_ELENGTH);
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2222, 1, 0,
                           JL_FRAME_PAYLOAD), JL_OK);
    assert_int_equal(jl_link_peek(&w.e[1].link), 2 * JL_FRAME_PAYLOAD);
}

static void test_link_closes(void **state)
{
    unsigned seed;
    int both;

    (void)state;
    for (seed = 1; seed <= 20; seed++) {
        both = (int)(seed & 1);
        begin(seed <= 2 ? clean : awful, seed);
        goals(30, 30);
        w.e[0].close = 1;
        w.e[1].close = both;
        if (seed % 5 == 0)
            w.e[1].every = 40000;
        run(NULL, SECONDS(30));
        /* a send is refused when the other end has closed first */
        assert_int_equal(w.e[1].got, w.e[0].sent);
        assert_int_equal(w.e[0].got, w.e[1].sent);
        assert_true(w.e[0].sent == 30 || w.e[1].sent == 30);
        assert_int_equal(w.e[1].told, w.e[0].sent == 30 ? JL_ECLOSED : 0);
        assert_int_equal(w.e[0].told,
                         both && w.e[1].sent == 30 ? JL_ECLOSED : 0);
        assert_true(idle());
        assert_int_equal(jl_link_send(&w.e[0].link, msg, 1), JL_ECLOSED);
        assert_int_equal(jl_link_send(&w.e[1].link, msg, 1), JL_ECLOSED);
        assert_int_equal(jl_link_timer(&w.e[0].link, w.now), -1);
        if (w.e[0].link.closing)
            jl_link_close(&w.e[0].link);        /* twice is once */
        assert_true(idle());
    }
}

/* One end closes and leaves; the other closes later, into the void. */
static void test_link_closes_after_the_other_left(void **state)
{
    (void)state;
    up();
    w.e[0].close = 1;
    act(0);
    assert_false(jl_link_idle(&w.e[0].link));
    assert_true(run(idle, SECONDS(1)));
    w.c.lose = 100;
    jl_link_close(&w.e[1].link);
    assert_false(jl_link_idle(&w.e[1].link));   /* BYE is not out yet */
    act(1);
    assert_true(jl_link_idle(&w.e[1].link));

    up();                       /* but data that nobody has are under way */
    w.e[0].close = 1;
    assert_true(run(idle, SECONDS(1)) && jl_link_idle(&w.e[0].link));
    up();
    w.c.lose = 100;
    assert_int_equal(jl_link_send(&w.e[1].link, msg, 1), JL_OK);
    jl_link_close(&w.e[1].link);
    run(NULL, SECONDS(1));
    assert_false(jl_link_idle(&w.e[1].link));
}

/* An orderly end stays one when the other program starts again. */
static void test_link_restart_after_close(void **state)
{
    (void)state;
    up();
    w.e[0].close = 1;
    run(NULL, SECONDS(1));
    assert_int_equal(w.e[1].told, JL_ECLOSED);
    start(0, 0x3333);
    run(NULL, SECONDS(1));
    assert_int_equal(jl_link_recv(&w.e[1].link, msg, MAX_LEN), JL_ECLOSED);
    assert_int_equal(jl_link_idle(&w.e[1].link), 1);
    assert_int_equal(jl_link_timer(&w.e[1].link, w.now), -1);

    up();                       /* but not if something never arrived */
    assert_int_equal(jl_link_send(&w.e[1].link, msg, 1), JL_OK);
    w.c.lose = 100;
    act(1);
    w.c.lose = 0;
    w.e[0].close = 1;
    act(0);
    start(0, 0x3333);
    run(NULL, SECONDS(1));
    assert_int_equal(w.e[0].got, 0);
    assert_int_equal(jl_link_recv(&w.e[1].link, msg, MAX_LEN), JL_EPEER);
}

static void test_link_acknowledges_in_time(void **state)
{
    unsigned char out[JL_FRAME_MAX];
    jl_link *l = &w.e[1].link;
    int i;

    (void)state;
    up();
    /* alone: after ack_us, not before */
    forge(JL_FRAME_LAST, 0x1111, 0x2222, 0, 0, 4);
    assert_int_equal(jl_link_idle(l), 0);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 0);
    assert_int_equal(jl_link_timer(l, w.now), 2000);
    assert_int_equal(jl_link_timer(l, w.now + 1500), 500);
    assert_int_equal(jl_link_timer(l, w.now + 2500), 0);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now + 1999), 0);
    assert_true(jl_link_output(l, out, JL_FRAME_MAX, w.now + 2000) > 0);
    assert_int_equal(out[3], JL_FRAME_ACK);
    assert_int_equal(jl_get_u32(out + 20), 1);
    assert_int_equal(jl_link_idle(l), 1);
    /* a second time: at once */
    assert_int_equal(forge(JL_FRAME_LAST, 0x1111, 0x2222, 0, 0, 4), JL_EORDER);
    assert_int_equal(jl_link_timer(l, w.now), 0);
    assert_true(jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0);
    /* half a window: at once */
    for (i = 0; i < l->window / 2 - 1; i++)
        forge(JL_FRAME_LAST, 0x1111, 0x2222, 1 + (jl_u32)i, 0, 4);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 0);
    forge(JL_FRAME_LAST, 0x1111, 0x2222, 1 + (jl_u32)i, 0, 4);
    assert_true(jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0);
    assert_int_equal(out[3], JL_FRAME_ACK);
    while (jl_link_recv(l, msg, MAX_LEN) >= 0)
        ;
    /* with data: no frame of its own */
    forge(JL_FRAME_LAST, 0x1111, 0x2222, 2 + (jl_u32)i, 0, 4);
    assert_int_equal(jl_link_send(l, msg, 3), JL_OK);
    assert_int_equal(jl_link_timer(l, w.now), 0);
    assert_true(jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0);
    assert_int_equal(out[3], JL_FRAME_LAST);
    assert_int_equal(jl_get_u32(out + 20), 3 + i);
    assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 0);
    assert_int_equal(jl_link_timer(l, w.now), 20000);
}

static void test_link_backs_off(void **state)
{
    static const long waits[] = { 20000, 40000, 80000, 160000, 320000, 320000,
                                  320000 };
    unsigned char out[JL_FRAME_MAX];
    jl_link *l = &w.e[1].link;
    int i;

    (void)state;
    up();
    assert_int_equal(jl_link_send(l, msg, 3), JL_OK);
    assert_int_equal(jl_link_send(l, msg, 3), JL_OK);
    assert_true(jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0);
    for (i = 0; i < 7; i++) {
        assert_true(jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0 || i > 0);
        assert_int_equal(jl_link_output(l, out, JL_FRAME_MAX, w.now), 0);
        assert_int_equal(jl_link_timer(l, w.now), waits[i]);
        w.now += (jl_u32)waits[i];
        assert_int_equal(jl_link_timer(l, w.now), 0);
        assert_true(jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0);
        assert_int_equal(jl_get_u32(out + 16), 0);
    }
    /* an acknowledgement of nothing new is no progress */
    w.now += 1000;
    forge(JL_FRAME_ACK, 0x1111, 0x2222, 0, 0, 0);
    assert_int_equal(jl_link_timer(l, w.now), 319000);
    /* progress: the rest at once, and the first waiting time again */
    forge(JL_FRAME_ACK, 0x1111, 0x2222, 0, 1, 0);
    assert_true(jl_link_output(l, out, JL_FRAME_MAX, w.now) > 0);
    assert_int_equal(jl_get_u32(out + 16), 1);
    assert_int_equal(jl_link_timer(l, w.now), 20000);
    assert_int_equal(l->count.sent, 2);
    assert_int_equal(l->count.resent, 8);
    /* a clock that stood for 50 minutes changes nothing */
    assert_int_equal(jl_link_timer(l, w.now + SECONDS(3000)), 0);
}

static void test_link_window_is_full(void **state)
{
    jl_link *l = &w.e[0].link;
    int i;

    (void)state;
    begin(clean, 1);
    for (i = 0; i < SLOTS; i++)         /* before it is up, too */
        assert_int_equal(jl_link_send(l, msg, MAX_LEN), JL_OK);
    assert_int_equal(jl_link_send(l, msg, 0), JL_EAGAIN);
    assert_int_equal(jl_link_idle(l), 0);
    begin(clean, 1);
    for (i = 0; i < l->window; i++)
        assert_int_equal(jl_link_send(l, msg, 0), JL_OK);
    assert_int_equal(jl_link_send(l, msg, 0), JL_EAGAIN);
    assert_int_equal(jl_link_send(l, msg, MAX_LEN + 1), JL_ETOOLONG);
    assert_int_equal(jl_link_send(l, msg, -1), JL_ETOOLONG);
    jl_link_close(l);                   /* BYE needs no room */
    w.e[1].next_recv = SECONDS(100);
    assert_true(run(idle, SECONDS(1)));
    for (i = 0; i < l->window; i++)
        assert_int_equal(jl_link_recv(&w.e[1].link, msg, 0), 0);
    assert_int_equal(jl_link_recv(&w.e[1].link, msg, 0), JL_ECLOSED);
}

static void test_link_init_refuses(void **state)
{
    jl_link l, before;
    jl_link_config good = config(0, 255, 1), c;

    (void)state;
    memset(&l, 0x5A, sizeof l);
    before = l;
#define REFUSED(field, value, code) \
    (c = good, c.field = (value), \
     assert_int_equal(jl_link_init(&l, &c, w.e[0].mem, MEM, 0), (code)))
    REFUSED(number, 0, JL_EDIM);
    REFUSED(number, 5, JL_EDIM);
    REFUSED(from, -1, JL_EDIM);
    REFUSED(from, 256, JL_EDIM);
    REFUSED(from, 255, JL_EDIM);        /* = to */
    REFUSED(to, -1, JL_EDIM);
    REFUSED(to, 256, JL_EDIM);
    REFUSED(session, 0, JL_EDIM);
    REFUSED(max_len, -1, JL_EDIM);
    REFUSED(slots, 0, JL_EDIM);
    REFUSED(slots, INT_MAX, JL_EDIM);
    REFUSED(max_len, INT_MAX, JL_EDIM);
    REFUSED(rto_us, 0, JL_EDIM);
    REFUSED(rto_us, JL_LINK_MAX_US + 1, JL_EDIM);
    REFUSED(ack_us, JL_LINK_MAX_US + 1, JL_EDIM);
    REFUSED(beat_us, JL_LINK_MAX_US + 1, JL_EDIM);
    REFUSED(silence_us, JL_LINK_MAX_US + 1, JL_EDIM);
    REFUSED(slots, SLOTS + 1, JL_ENOMEM);
    assert_int_equal(jl_link_init(&l, &good, w.e[0].mem, MEM - 1, 0),
                     JL_ENOMEM);
    assert_memory_equal(&l, &before, sizeof l);
    assert_int_equal(jl_link_init(&l, &good, w.e[0].mem, MEM, 0), JL_OK);
    good.number = 4;
    good.from = 255;
    good.to = 0;
    good.session = 0xFFFFFFFFu;
    good.max_len = 0;
    good.slots = 1;
    good.rto_us = good.ack_us = JL_LINK_MAX_US;
    good.beat_us = good.silence_us = JL_LINK_MAX_US;
    assert_int_equal(jl_link_init(&l, &good, w.e[0].mem, JL_LINK_MEM(0, 1), 0),
                     JL_OK);
}

/* The smallest link: a window of one piece, no waiting for acknowledgements,
 * one sequence number at a time. */
static void test_link_smallest(void **state)
{
    static unsigned char mem[2][JL_LINK_MEM(0, 1)];
    unsigned char out[JL_FRAME_MAX];
    jl_link l[2];
    jl_link_config c;
    jl_u32 now = 0;
    int i, k, len, sent = 0, got = 0;

    (void)state;
    w.random = 5;
    for (i = 0; i < 2; i++) {
        c = config(i, 1 - i, 77);       /* even the same session */
        c.max_len = 0;
        c.slots = 1;
        c.ack_us = 0;
        assert_int_equal(jl_link_init(&l[i], &c, mem[i], JL_LINK_MEM(0, 1),
                                      now), JL_OK);
    }
    for (k = 0; k < 100000 && got < 300; k++, now += 1000) {
        if (sent < 300 && jl_link_send(&l[0], NULL, 0) == JL_OK)
            sent++;
        for (i = 0; i < 2; i++)
            while (len = jl_link_output(&l[i], out, JL_FRAME_MAX, now), len > 0)
                if (dice(3) > 0)
                    jl_link_input(&l[1 - i], out, len, now);
        if (jl_link_recv(&l[1], NULL, 0) == 0)
            got++;
    }
    assert_int_equal(got, 300);
    assert_int_equal(jl_link_recv(&l[1], NULL, 0), JL_EAGAIN);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_link_clean),
        cmocka_unit_test(test_link_loses_a_third),
        cmocka_unit_test(test_link_everything_at_once),
        cmocka_unit_test(test_link_recovers_with_the_carrier),
        cmocka_unit_test(test_link_one_way),
        cmocka_unit_test(test_link_wraps),
        cmocka_unit_test(test_link_receives_slowly),
        cmocka_unit_test(test_link_room_is_told),
        cmocka_unit_test(test_link_starts_in_any_order),
        cmocka_unit_test(test_link_peer_restarts),
        cmocka_unit_test(test_link_late_hello_of_an_old_life),
        cmocka_unit_test(test_link_restart_drains),
        cmocka_unit_test(test_link_restarts_settle),
        cmocka_unit_test(test_link_replay_of_a_session),
        cmocka_unit_test(test_link_replay_of_itself),
        cmocka_unit_test(test_link_hello_to_an_up_link),
        cmocka_unit_test(test_link_hello_repeats),
        cmocka_unit_test(test_link_room_for_the_rest),
        cmocka_unit_test(test_link_room_at_half),
        cmocka_unit_test(test_link_asks_for_the_missing),
        cmocka_unit_test(test_link_does_not_ask_without_room),
        cmocka_unit_test(test_link_mends_a_loss_at_once),
        cmocka_unit_test(test_link_heeds_few_asks),
        cmocka_unit_test(test_link_beats),
        cmocka_unit_test(test_link_notices_silence),
        cmocka_unit_test(test_link_hears),
        cmocka_unit_test(test_link_absence_is_not_silence),
        cmocka_unit_test(test_link_beats_keep_it),
        cmocka_unit_test(test_link_before_it_is_up),
        cmocka_unit_test(test_link_refuses_foreign),
        cmocka_unit_test(test_link_hostile_peer),
        cmocka_unit_test(test_link_hostile_empty_last),
        cmocka_unit_test(test_link_closes),
        cmocka_unit_test(test_link_closes_after_the_other_left),
        cmocka_unit_test(test_link_restart_after_close),
        cmocka_unit_test(test_link_acknowledges_in_time),
        cmocka_unit_test(test_link_backs_off),
        cmocka_unit_test(test_link_window_is_full),
        cmocka_unit_test(test_link_init_refuses),
        cmocka_unit_test(test_link_smallest)
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
