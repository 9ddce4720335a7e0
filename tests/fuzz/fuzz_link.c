/* Two links and an adversary between them, moved by a script.
 *
 * The adversary may keep, drop, repeat, cut and damage datagrams, send back
 * what it has recorded in earlier lives of an end, and make up frames that have
 * a right checksum and are blind: they do not know the receiver's session.
 * Whatever it does, what an end receives are the first messages of one life of
 * the other end, in order and whole; a link fails only if the other end has
 * closed, restarted, or not been heard for silence_us; and when the adversary
 * tires, all that was sent arrives.
 *
 * With one bit of the script the adversary also knows sessions: then it can say
 * anything to anybody, and only memory and bookkeeping must stay sound. */
#include "fuzz.h"

#include <stdlib.h>
#include <string.h>

#include "jumplink/link.h"

enum { LIVES = 4, MESSAGES = 64, AIR = 16, TAPE = 32, OPERATIONS = 300 };

struct life {
    int sent;                   /* messages                                 */
    int len[MESSAGES];
    int closed;
};

struct end {
    jl_link link;
    unsigned char *mem;
    int slots;
    struct life lives[LIVES];
    int life;                   /* the present one                          */
    int got;                    /* messages, in this life                   */
    jl_u32 unheard_us;          /* since it took something; does not wrap   */
};

struct datagram {
    int to, len;
    unsigned char octets[JL_FRAME_MAX];
};

struct world {
    fuzz_script script;
    struct end end[2];
    struct datagram air[AIR];   /* under way                                */
    int flying;
    struct datagram tape[TAPE]; /* all that was ever put out                */
    unsigned taped;
    int max_len, forging;
    jl_u32 rto_us, ack_us, silence_us, now;
};

/* --- sessions and messages ----------------------------------------------- */

#define SESSIONS ((jl_u32)0x5e550000UL)

static jl_u32 session_of(int end, int life)
{
    return SESSIONS + 1 + (jl_u32)(16 * end + life);
}

/* The life of `end` that has this session; -1: none that has begun. */
static int life_of(const struct world *w, int end, jl_u32 session)
{
    int life;

    for (life = w->end[end].life; life >= 0; life--)
        if (session_of(end, life) == session)
            return life;
    return -1;
}

static unsigned char message_octet(jl_u32 session, int number, int i)
{
    jl_u32 x = (session * 31 + (jl_u32)number) * 2654435761u + (jl_u32)i;

    return (unsigned char)(x * 40503u >> 13 & 255);
}

static void begin_life(struct world *w, int i)
{
    struct end *e = &w->end[i];
    jl_link_config config;
    int octets = JL_LINK_MEM(w->max_len, e->slots);

    memset(&config, 0, sizeof config);
    config.number = 8;
    config.from = 10 + i;
    config.to = 11 - i;
    config.session = session_of(i, e->life);
    config.max_len = w->max_len;
    config.slots = e->slots;
    config.rto_us = w->rto_us;
    config.ack_us = w->ack_us;
    config.silence_us = w->silence_us;
    config.beat_us = w->silence_us / 8;
    free(e->mem);
    e->mem = malloc((size_t)octets);
    FUZZ_HOLDS(jl_link_init(&e->link, &config, e->mem, octets - 1, w->now) ==
               JL_ENOMEM);
    FUZZ_HOLDS(jl_link_init(&e->link, &config, e->mem, octets, w->now) ==
               JL_OK);
    e->got = 0;
    e->unheard_us = 0;
}

/* --- bookkeeping --------------------------------------------------------- */

static jl_u32 apart(jl_u32 a, jl_u32 b)
{
    return (a - b) & (jl_u32)0xffffffffUL;
}

static void pass_time(struct world *w, jl_u32 us)
{
    int i;

    w->now += us;
    for (i = 0; i < 2; i++)
        if (w->end[i].unheard_us < (jl_u32)JL_LINK_MAX_US)
            w->end[i].unheard_us += us > (jl_u32)JL_LINK_MAX_US
                ? (jl_u32)JL_LINK_MAX_US : us;
}

static void check_sound(const struct world *w, const struct end *e)
{
    const jl_link *l = &e->link;
    jl_u32 held = apart(l->out_end, l->out_first);

    FUZZ_HOLDS(l->window == e->slots * JL_LINK_PIECES(w->max_len));
    FUZZ_HOLDS(l->in_held >= 0 && l->in_held <= l->window);
    FUZZ_HOLDS(l->in_len >= 0 && l->in_len <= w->max_len);
    FUZZ_HOLDS(held <= (jl_u32)(l->window + l->closing));
    FUZZ_HOLDS(apart(l->out_high, l->out_first) <= held);
    FUZZ_HOLDS(apart(l->out_next, l->out_first) <=
               apart(l->out_high, l->out_first));
    FUZZ_HOLDS(jl_link_timer(l, w->now) >= -1);
    FUZZ_HOLDS(jl_link_silence(l, w->now) >= -1 &&
               jl_link_silence(l, w->now) <= JL_LINK_MAX_US);
    FUZZ_HOLDS(l->failed == JL_OK || l->failed == JL_ECLOSED ||
               l->failed == JL_EPEER ||
               (l->failed == JL_ESILENT && w->silence_us > 0));
}

/* The life of the other end that this one is up with. */
static const struct life *partner(const struct world *w, int i, int *life)
{
    *life = life_of(w, 1 - i, w->end[i].link.peer);
    FUZZ_HOLDS(*life >= 0);
    return &w->end[1 - i].lives[*life];
}

/* --- what the program at an end does ------------------------------------- */

static void do_send(struct world *w, int i, int len)
{
    struct end *e = &w->end[i];
    struct life *life = &e->lives[e->life];
    jl_link *l = &e->link;
    unsigned char *msg = malloc((size_t)len + 1);
    int k, status, failed = l->failed;
    jl_u32 held = apart(l->out_end, l->out_first);

    for (k = 0; k < len; k++)
        msg[k] = message_octet(l->config.session, life->sent, k);
    if (life->sent < MESSAGES) {
        status = jl_link_send(l, msg, len);
        if (failed != JL_OK)
            FUZZ_HOLDS(status == failed);
        else if (life->closed)
            FUZZ_HOLDS(status == JL_ECLOSED);
        else if (len > w->max_len)
            FUZZ_HOLDS(status == JL_ETOOLONG);
        else
            FUZZ_HOLDS(status == ((int)held + JL_LINK_PIECES(len) > l->window
                                  ? JL_EAGAIN : JL_OK));
        if (status == JL_OK)
            life->len[life->sent++] = len;
    }
    free(msg);
}

static void check_message(const struct world *w, int i,
                          const unsigned char *msg, int len)
{
    const struct end *e = &w->end[i];
    const struct life *life;
    int which, k;

    life = partner(w, i, &which);
    FUZZ_HOLDS(e->got < life->sent);
    FUZZ_HOLDS(len == life->len[e->got]);
    for (k = 0; k < len; k++)
        FUZZ_HOLDS(msg[k] == message_octet(e->link.peer, e->got, k));
}

/* Returns 1 if a message was there. */
static int do_recv(struct world *w, int i, int cap)
{
    struct end *e = &w->end[i];
    unsigned char *msg = malloc((size_t)cap + 1);
    int which, peeked = jl_link_peek(&e->link);
    int len = jl_link_recv(&e->link, msg, cap);

    if (peeked > cap)
        FUZZ_HOLDS(len == JL_ETOOLONG);
    else
        FUZZ_HOLDS(len == peeked);
    FUZZ_HOLDS(len >= 0 || len == JL_EAGAIN || len == JL_ETOOLONG ||
               len == JL_ECLOSED || len == e->link.failed);
    FUZZ_HOLDS(len <= w->max_len);
    if (!w->forging) {
        if (len >= 0) {
            check_message(w, i, msg, len);
        } else if (len == JL_ECLOSED) {
            const struct life *life = partner(w, i, &which);

            FUZZ_HOLDS(life->closed && e->got == life->sent);
        } else if (len == JL_EPEER) {
            (void)partner(w, i, &which);
            FUZZ_HOLDS(which < w->end[1 - i].life);
        }
    }
    e->got += len >= 0;
    free(msg);
    return len >= 0;
}

static void do_close(struct world *w, int i)
{
    jl_link_close(&w->end[i].link);
    w->end[i].lives[w->end[i].life].closed = 1;
}

static void do_restart(struct world *w, int i)
{
    if (w->end[i].life + 1 == LIVES)
        return;
    w->end[i].life++;
    begin_life(w, i);
}

/* When nobody is heard for long, and not before, a link fails for silence; also
 * one whose other end has closed, and has not acknowledged all. */
static void do_judge(struct world *w, int i)
{
    jl_link *l = &w->end[i].link;
    int failed = l->failed, status = jl_link_judge(l, w->now);

    FUZZ_HOLDS(status == (l->failed == JL_ESILENT ? JL_ESILENT : JL_OK));
    if (l->failed != failed) {
        FUZZ_HOLDS(failed == JL_OK || failed == JL_ECLOSED);
        FUZZ_HOLDS(status == JL_ESILENT);
        FUZZ_HOLDS(w->end[i].unheard_us >= w->silence_us);
    }
}

/* --- what the carrier does ----------------------------------------------- */

/* Anything goes in; a refusal is counted once, under its name. */
static int do_input(struct world *w, int i, const unsigned char *octets,
                    int len)
{
    jl_link *l = &w->end[i].link;
    jl_link_count a = l->count, b;
    jl_u32 peer = l->peer;
    int status, up = l->up;
    unsigned char *copy = malloc((size_t)len + 1);

    memcpy(copy, octets, (size_t)len);
    copy = realloc(copy, (size_t)len + (len == 0));
    status = jl_link_input(l, copy, len, w->now);
    free(copy);
    b = l->count;
    FUZZ_HOLDS((b.refused - a.refused) + (b.stale - a.stale) +
               (b.doubled - a.doubled) + (b.early - a.early) ==
               (status != JL_OK));
    FUZZ_HOLDS(b.received - a.received <= (unsigned long)(status == JL_OK));
    FUZZ_HOLDS(b.sent == a.sent && b.resent == a.resent && b.acks == a.acks);
    FUZZ_HOLDS(!up || l->peer == peer);
    if (status <= JL_EMAGIC && status >= JL_ECRC)
        FUZZ_HOLDS(b.refused == a.refused + 1);
    if (b.received > a.received)
        w->end[i].unheard_us = 0;
    return status;
}

/* Returns the length of a datagram that is well formed, or 0. */
static int do_output(struct world *w, int i, unsigned char *octets)
{
    jl_link *l = &w->end[i].link;
    unsigned char *out = malloc(JL_FRAME_MAX);
    jl_frame frame;
    int len;

    FUZZ_HOLDS(jl_link_output(l, out, JL_FRAME_MAX - 1, w->now) ==
               JL_ENOMEM);
    len = jl_link_output(l, out, JL_FRAME_MAX, w->now);
    if (len != 0) {
        FUZZ_HOLDS(jl_frame_decode(&frame, out, len, 8) == JL_OK);
        FUZZ_HOLDS(frame.from == 10 + i && frame.to == 11 - i);
        FUZZ_HOLDS(frame.session == l->config.session);
        memcpy(octets, out, (size_t)len);
    } else {
        FUZZ_HOLDS(w->silence_us > 0 || jl_link_timer(l, w->now) != 0);
    }
    free(out);
    return len;
}

static void put_in_air(struct world *w, int i)
{
    struct datagram d;

    d.to = 1 - i;
    d.len = do_output(w, i, d.octets);
    if (d.len == 0)
        return;
    w->tape[w->taped++ % TAPE] = d;
    if (w->flying < AIR)        /* else it is lost */
        w->air[w->flying++] = d;
}

static struct datagram take_from_air(struct world *w, unsigned which)
{
    int i = (int)(which % (unsigned)w->flying);
    struct datagram d = w->air[i];

    w->flying--;
    memmove(w->air + i, w->air + i + 1,
            (size_t)(w->flying - i) * sizeof *w->air);
    return d;
}

/* Damage that a CRC-32 always finds: a burst of at most 32 bits. */
static void do_damage(struct world *w, struct datagram d)
{
    int at = (int)(fuzz_u16(&w->script) % (unsigned)(d.len - 3));
    jl_u32 burst = fuzz_u32(&w->script);
    int status;

    if (burst == 0)
        burst = 1;
    jl_put_u32(d.octets + at, jl_get_u32(d.octets + at) ^ burst);
    status = do_input(w, d.to, d.octets, d.len);
    FUZZ_HOLDS(status == JL_EMAGIC || status == JL_EVERSION ||
               status == JL_ELENGTH || status == JL_ECRC);
}

static void do_cut(struct world *w, struct datagram d)
{
    int len = (int)(fuzz_u16(&w->script) % (unsigned)d.len);

    FUZZ_HOLDS(do_input(w, d.to, d.octets, len) == JL_ELENGTH);
}

/* --- what the adversary makes up ----------------------------------------- */

static jl_u32 some_session(struct world *w)
{
    unsigned which = fuzz_octet(&w->script);
    int i = (int)(which & 1);
    jl_u32 session = which & 128 ? fuzz_u32(&w->script)
        : session_of(i, (int)(which >> 1) % (w->end[i].life + 1));

    /* not a session to come: nobody can know it */
    if (life_of(w, 0, session) < 0 && life_of(w, 1, session) < 0)
        session |= (jl_u32)0x80000000UL;
    return session;
}

/* A number near those that the receiver has to do with. */
static jl_u32 some_number(struct world *w, jl_u32 near)
{
    unsigned how = fuzz_octet(&w->script);

    return how & 128 ? fuzz_u32(&w->script) : near + how - 8;
}

static void do_make_up(struct world *w, int i)
{
    static const unsigned char zeros[JL_FRAME_PAYLOAD];
    const jl_link *l = &w->end[i].link;
    unsigned char octets[JL_FRAME_MAX];
    unsigned kind = fuzz_octet(&w->script), length = fuzz_octet(&w->script);
    jl_frame f;
    int len, status;

    memset(&f, 0, sizeof f);
    f.kind = 1 + (int)(kind & 15) % JL_FRAME_ALIVE;
    f.number = kind & 16 ? 4 : 8;
    f.from = kind & 32 ? 10 + i : 11 - i;
    f.to = kind & 64 ? 11 - i : 10 + i;
    f.session = some_session(w);
    f.peer = some_session(w);
    if (!w->forging && f.peer == l->config.session)
        f.peer = 0;
    f.seq = some_number(w, l->in_next);
    f.ack = some_number(w, l->out_first);
    f.payload = zeros;
    if (f.kind == JL_FRAME_DATA || f.kind == JL_FRAME_LAST)
        f.len = length < 128 ? (int)length % (JL_FRAME_PAYLOAD + 1)
                             : JL_FRAME_PAYLOAD - (int)(length & 3);
    len = jl_frame_encode(octets, sizeof octets, &f);
    FUZZ_HOLDS(len > 0);
    status = do_input(w, i, octets, len);
    if (kind & 16)
        FUZZ_HOLDS(status == JL_ENUMBER);
    else if (kind & 96)
        FUZZ_HOLDS(status == JL_EMSG);
}

static void do_noise(struct world *w, int i)
{
    unsigned char octets[JL_FRAME_MAX + 8];
    int len = (int)(fuzz_u16(&w->script) % sizeof octets), status;

    fuzz_octets(&w->script, octets, len < 64 ? len : 64);
    if (len > 64)
        memset(octets + 64, 0, (size_t)len - 64);
    status = do_input(w, i, octets, len);
    if (len > JL_FRAME_MAX)
        FUZZ_HOLDS(status == JL_ELENGTH);
}

/* --- the script ---------------------------------------------------------- */

static int some_len(struct world *w)
{
    static const int special[] = { 0, 1, JL_FRAME_PAYLOAD - 1,
        JL_FRAME_PAYLOAD, JL_FRAME_PAYLOAD + 1, 2 * JL_FRAME_PAYLOAD,
        2 * JL_FRAME_PAYLOAD + 1, 3 * JL_FRAME_PAYLOAD };
    unsigned which = fuzz_octet(&w->script);

    return which & 8 ? (int)fuzz_octet(&w->script) : special[which & 7];
}

static jl_u32 some_time(struct world *w)
{
    unsigned how = fuzz_octet(&w->script);

    return (jl_u32)(1 + (how & 7)) << (how >> 3) % 30;
}

static void operate(struct world *w)
{
    unsigned op = fuzz_octet(&w->script), which = op >> 4 & 7;
    int i = op >> 7 ? 1 : 0;
    struct datagram d;

    switch (op & 15) {
    case 0: put_in_air(w, i); break;
    case 1: do_send(w, i, some_len(w)); break;
    case 2: (void)do_recv(w, i, w->max_len); break;
    case 3: (void)do_recv(w, i, some_len(w)); break;
    case 4: pass_time(w, some_time(w)); break;
    case 5: do_make_up(w, i); break;
    case 6: do_noise(w, i); break;
    case 7:
        if (which == 0)
            do_close(w, i);
        else if (which == 1)
            do_restart(w, i);
        else
            do_judge(w, i);
        break;
    case 8:                     /* a record, to whom it went or back */
        if (w->taped > 0) {
            d = w->tape[fuzz_octet(&w->script) %
                        (w->taped < TAPE ? w->taped : TAPE)];
            (void)do_input(w, which == 7 ? 1 - d.to : d.to, d.octets, d.len);
        }
        break;
    default:
        if (w->flying == 0)
            break;
        d = take_from_air(w, which);
        switch (op & 15) {
        case 9: do_damage(w, d); break;
        case 10: do_cut(w, d); break;
        case 11: break;         /* lost */
        default: (void)do_input(w, d.to, d.octets, d.len); break;
        }
    }
    check_sound(w, &w->end[0]);
    check_sound(w, &w->end[1]);
}

/* --- the adversary tires ------------------------------------------------- */

/* One of them has met another life of the other, or has not heard it for too
 * long, and says no more. */
static int over(const struct world *w)
{
    int i, n = 0;

    for (i = 0; i < 2; i++)
        n += w->end[i].link.failed != JL_OK && !w->end[i].link.up;
    return n > 0;
}

/* All that end i has sent in this life is received, if the other end is up
 * with this life. */
static int arrived(const struct world *w, int i)
{
    const struct end *e = &w->end[i], *other = &w->end[1 - i];

    return other->link.peer != e->link.config.session ||
           other->got == e->lives[e->life].sent;
}

/* It has nothing to say but that it lives. */
static int quiet(const struct world *w, int i)
{
    const jl_link *l = &w->end[i].link;
    long timer = jl_link_timer(l, w->now);

    return jl_link_idle(l) && jl_link_peek(l) < 0 &&
           (timer < 0 || (timer > 0 && l->up && w->silence_us > 0));
}

/* A perfect carrier, programs that receive all, and time that passes, until
 * there is nothing left to say; nobody sleeps before that.  After
 * restarts one end may have failed (do_recv has checked why), or not know yet
 * that the other is not who it was, because nobody has had a word to say. */
static void check_arrival(struct world *w)
{
    unsigned char octets[JL_FRAME_MAX];
    int restarted = w->end[0].life + w->end[1].life > 0;
    long timer, next = 0;
    int i, len, rounds;

    for (rounds = 0; next >= 0; rounds++) {
        FUZZ_HOLDS(rounds < 3000);
        pass_time(w, (jl_u32)next);
        for (i = 0; i < 2; i++)
            while (do_recv(w, i, w->max_len))
                ;
        for (i = 0; i < 2; i++)
            while ((len = do_output(w, i, octets)) > 0)
                (void)do_input(w, 1 - i, octets, len);
        for (i = 0; i < 2; i++)
            do_judge(w, i);
        if (over(w) || (quiet(w, 0) && quiet(w, 1)))
            break;
        next = -1;
        for (i = 0; i < 2; i++) {
            timer = jl_link_timer(&w->end[i].link, w->now);
            if (timer >= 0 && (next < 0 || timer < next))
                next = timer;
        }
        if (next < 0 && (jl_link_peek(&w->end[0].link) >= 0 ||
                         jl_link_peek(&w->end[1].link) >= 0))
            next = 0;
    }
    FUZZ_HOLDS(over(w) || (quiet(w, 0) && quiet(w, 1)));
    FUZZ_HOLDS(restarted || w->silence_us > 0 || !over(w));
    for (i = 0; i < 2 && !over(w); i++) {
        FUZZ_HOLDS(w->end[i].link.up);
        FUZZ_HOLDS(arrived(w, i));
        FUZZ_HOLDS(restarted || w->end[i].link.peer ==
                   w->end[1 - i].link.config.session);
    }
}

int fuzz_link(const unsigned char *data, size_t size)
{
    static const jl_u32 times[4] = { 20000, 1000, 100, 67108864 };
    static struct world w;
    unsigned first;
    int i;

    memset(&w, 0, sizeof w);
    w.script.at = data;
    w.script.left = size;
    first = fuzz_octet(&w.script);
    w.forging = first >> 7 & 1;
    w.end[0].slots = 1 + (first & 1);
    w.end[1].slots = 1 + (first >> 1 & 1);
    w.rto_us = times[first >> 2 & 3];
    w.ack_us = (first >> 4 & 1) ? 0 : w.rto_us / 4;
    w.silence_us = (first >> 6 & 1) ? 8 * w.rto_us : 0;
    if (w.silence_us > (jl_u32)JL_LINK_MAX_US)
        w.silence_us = (jl_u32)JL_LINK_MAX_US;
    w.max_len = some_len(&w);
    w.now = (first >> 5 & 1) ? 0u - 100000u : 0;
    for (i = 0; i < 2; i++)
        begin_life(&w, i);
    for (i = 0; i < OPERATIONS && w.script.left > 0; i++)
        operate(&w);
    if (!w.forging)
        check_arrival(&w);
    for (i = 0; i < 2; i++)
        free(w.end[i].mem);
    return 0;
}
