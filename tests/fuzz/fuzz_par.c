/* A host and some PEs on port loop; a script says what the host measures, and
 * how messages are altered before they are received: what a PE built from other
 * sources, or a broken port, might say.
 *
 * Whatever comes, everybody comes to an end, a PE takes up only measurements
 * that can be used, and what is accepted has exactly the octets that were
 * received; a message of another length, or with another header, is refused.
 * If nothing was altered, the host gets the serial filter's bits (an all-reduce
 * has its own, which are not compared), and for what is refused the code that
 * par.h promises.  Some games have a gate; in some the filter is a constant-gain
 * IMM, of which no PE ever holds a number that is not finite, nor changes what a
 * step that failed has begun. */
#include "fuzz.h"

#include <stdlib.h>
#include <string.h>

#include "jumplink.h"
#include "loop/port_loop.h"

enum { M = 3, N = 2, Z = 1, PES = 3, NODES = PES + 1, ROWS = 12 };
enum { ORDER = 3 };             /* of the constant-gain IMM: 2, 3, 2        */
enum { LONGEST = JL_PAR_MSG(M, N, Z), WAIT_US = 1000000 };
enum { ESTIMATE = 8 + (1 + N + JL_PACKED(N) + M) * JL_REAL_OCTETS };
JL_STATIC_ASSERT(LONGEST >= JL_PAR_CG_MSG(M, Z), a_message_has_room);

struct bank {
    jl_mode modes[M];
    jl_real mode_mem[M][JL_MODE_MEM(N, Z, Z)];
    jl_real mem[JL_IMM_STATE(M, N, N)];
    jl_real scratch[JL_IMM_SCRATCH(M, N, Z)];
    jl_imm imm;
    jl_cg_gains gains[M];
    jl_real cg_mem[JL_CGIMM_STATE(M, Z)];
    jl_real before[JL_CGIMM_STATE(M, Z)];       /* the present step         */
    jl_cgimm cg;
};

struct game;

/* A channel to receive from, and what the script does to its messages. */
struct bent {
    jl_chan chan;               /* first: ops get a jl_chan and cast it     */
    jl_chan *inner;
    struct game *game;
    int to, from;
    unsigned char last[LONGEST];        /* the message before, as received  */
    int last_len;
};

struct game {
    fuzz_script script;
    jl_loop *loop;
    int npe, topology, exchange, gate;
    int cg;                     /* the filter is a constant-gain IMM        */
    struct bent from[NODES][NODES];     /* [receiver][sender]               */
    struct bank bank[NODES];            /* the host's is the serial filter  */
    jl_u32 last_seq[NODES];
    int started[NODES];                 /* has taken up a measurement       */
    int begun;                  /* the host knows that all are ready        */
    int altered;                /* messages                                 */
    int spoilt;                 /* in this row PE0 or the host got a message
                                   that must not be taken                   */
};

/* --- altered messages ---------------------------------------------------- */

/* PE0 and the host must see what is no message of this filter: another length,
 * or another header than a PE gives it.  (Two alterations may make it good.) */
static void spoil(struct game *g, const struct bent *b, int header)
{
    if (g->begun && g->altered == 1 &&
        (b->to == g->npe || (b->to == 0 && (!header || b->from != g->npe))))
        g->spoilt = 1;
}

/* Returns the length, or an error of the channel instead of the message. */
static int alter(struct game *g, const struct bent *b, unsigned char *msg,
                 int len)
{
    unsigned how = fuzz_octet(&g->script), at;
    int before = len;
    unsigned char octet;

    if (how == 0 || how > 7)
        return len;
    g->altered++;
    switch (how) {
    case 1:
        if (len == 0)
            return 0;
        at = fuzz_octet(&g->script);
        at = (at < 128 ? at : at % 8) % (unsigned)len;
        octet = (unsigned char)fuzz_octet(&g->script);
        msg[at] ^= octet;
        if (at < 8 && octet != 0        /* unless it is another verdict */
            && !(b->to == g->npe && at == 1 && msg[1] <= JL_REJECTED))
            spoil(g, b, 1);
        return len;
    case 2:
    case 3:
        at = fuzz_octet(&g->script) % (LONGEST + 1);
        len = how == 2 ? (int)at % (len + 1) : len + (int)at;
        if (len > LONGEST)
            len = LONGEST;
        if (len > before)
            fuzz_octets(&g->script, msg + before, len - before);
        if (len != before)
            spoil(g, b, 0);
        return len;
    case 4:
        len = (int)(fuzz_octet(&g->script) % (LONGEST + 1));
        fuzz_octets(&g->script, msg, len);
        return len;
    case 5:
        memcpy(msg, b->last, (size_t)b->last_len);
        return b->last_len;
    case 6:
        return JL_EPEER;
    default:                    /* a real, or the status of a mode */
        at = fuzz_octet(&g->script) % (LONGEST - 8);
        fuzz_octets(&g->script, msg + at, 8);
        return len;
    }
}

static int bent_send(jl_chan *chan, const unsigned char *msg, int len,
                     long timeout_us)
{
    return jl_chan_send(((struct bent *)chan)->inner, msg, len, timeout_us);
}

static int bent_recv(jl_chan *chan, unsigned char *msg, int cap,
                     long timeout_us)
{
    struct bent *b = (struct bent *)chan;
    unsigned char own[LONGEST];
    int len;

    memset(own, 0, sizeof own);
    len = jl_chan_recv(b->inner, own, LONGEST, timeout_us);
    if (len >= 0)
        len = alter(b->game, b, own, len);
    if (len < 0)
        return len;
    memcpy(b->last, own, (size_t)len);
    b->last_len = len;
    if (len > cap)
        return JL_ETOOLONG;
    memcpy(msg, own, (size_t)len);
    return len;
}

static int bent_wait(jl_chan *const *chans, int n, long timeout_us)
{
    jl_chan *inner[NODES];
    int i;

    FUZZ_HOLDS(n <= NODES);
    for (i = 0; i < n; i++)
        inner[i] = ((struct bent *)chans[i])->inner;
    return jl_chan_wait(inner, n, timeout_us);
}

static const jl_chan_ops bent_ops = { bent_send, bent_recv, bent_wait };

/* --- the filter ---------------------------------------------------------- */

static const jl_real other[M * M] = {
    JL_C(0.9), JL_C(0.05), JL_C(0.05), JL_C(0.1), JL_C(0.8), JL_C(0.1),
    JL_C(0.2), JL_C(0.1), JL_C(0.7)
};

static void bank_init(struct bank *bank, int sticky, int gate)
{
    static const jl_real mu[M] = { 0.5, 0.25, 0.25 };
    static const jl_real alike[M * M] = {
        JL_C(0.9), JL_C(0.05), JL_C(0.05), JL_C(0.05), JL_C(0.9), JL_C(0.05),
        JL_C(0.05), JL_C(0.05), JL_C(0.9)
    };
    jl_motion motion = { JL_MOTION_CV, Z, N, 0, 0, 2, 0 };
    jl_real x[M * N], P[M * N * N], zero = 0;
    int j;

    memset(bank, 0, sizeof *bank);
    for (j = 0; j < M; j++) {
        motion.accel_std = (jl_real)(1 + 2 * j);
        FUZZ_HOLDS(jl_mode_init(&bank->modes[j], N, Z, Z, bank->mode_mem[j],
                                JL_MODE_MEM(N, Z, Z)) == JL_OK);
        FUZZ_HOLDS(jl_mode_motion(&bank->modes[j], &motion, 1) == JL_OK);
        jl_motion_start(x + j * N, P + j * N * N, &motion, &zero, 10, 3);
    }
    FUZZ_HOLDS(jl_imm_init(&bank->imm, M, bank->modes, &jl_kf_joseph,
                           JL_MIX_AUTO, bank->mem, JL_IMM_STATE(M, N, N)) ==
               JL_OK);
    FUZZ_HOLDS(jl_imm_chain(&bank->imm, sticky ? alike : other) == JL_OK);
    FUZZ_HOLDS(jl_imm_set(&bank->imm, x, P, mu, bank->scratch) == JL_OK);
    if (gate)
        FUZZ_HOLDS(jl_imm_gate(&bank->imm, JL_C(10.83), 2) == JL_OK);
}

static void bank_init_cg(struct bank *bank)
{
    int j;

    memset(bank, 0, sizeof *bank);
    for (j = 0; j < M; j++)
        FUZZ_HOLDS(jl_cg_design(&bank->gains[j], 2 + j % 2, 1,
                                (jl_real)(1 + 20 * j), 4) == JL_OK);
    FUZZ_HOLDS(jl_cgimm_init(&bank->cg, M, bank->gains, Z, 1, 4, other,
                             bank->cg_mem, JL_CGIMM_STATE(M, Z)) == JL_OK);
    FUZZ_HOLDS(bank->cg.order == ORDER);
}

static int within(jl_real v, jl_real limit)
{
    return v >= -limit && v <= limit;
}

/* What par.h promises of a measurement: JL_OK, or why it is refused. */
static int usable(const struct game *g, int node, const jl_meas *meas)
{
    if (g->started[node] && meas->seq <= g->last_seq[node])
        return JL_EMSG;
    if (!(meas->dt - meas->dt == 0) ||
        (meas->z != NULL && !within(meas->z[0], g->gate ? JL_REAL_MAX
                                                         : JL_LARGE)))
        return JL_ENONFINITE;
    return meas->dt < 0 ? JL_ETIME : JL_OK;
}

static void take_up(struct game *g, int node, const jl_meas *meas)
{
    FUZZ_HOLDS(usable(g, node, meas) == JL_OK);
    g->started[node] = 1;
    g->last_seq[node] = meas->seq;
}

/* Before a step of the constant-gain IMM, on every PE: not for any dt; at a new
 * record a mode's gains start again. */
static int renew(struct bank *bank, const jl_meas *meas)
{
    if (meas->dt > 12)
        return JL_ERANGE;
    if (meas->first)
        jl_cgimm_restart(&bank->cg, (int)(meas->seq % M));
    memcpy(bank->before, bank->cg_mem, sizeof bank->before);
    return JL_OK;
}

static int kept(const struct bank *bank, const jl_real *v, int n)
{
    return memcmp(v, bank->before + (v - bank->cg_mem),
                  (size_t)n * sizeof *v) == 0;
}

static void check_cg(const struct bank *bank)
{
    const jl_cgimm *cg = &bank->cg;
    jl_real sum = 0;
    int i;

    for (i = 0; i < 3 * M * Z; i++)
        FUZZ_HOLDS(within(cg->x[i], JL_REAL_MAX));
    for (i = 0; i < M; i++) {
        FUZZ_HOLDS(cg->mu[i] >= 0);
        sum += cg->mu[i];
    }
    FUZZ_HOLDS(within(sum - 1, 8 * JL_EPSILON));
    if (cg->stage == 2)         /* filtered, but not weighed: a step failed */
        FUZZ_HOLDS(kept(bank, cg->x, 3 * M * Z) && kept(bank, cg->mu, M) &&
                   kept(bank, cg->w, 3 * M));
}

/* --- a PE ---------------------------------------------------------------- */

struct prepared {
    struct game *game;
    int pe;
};

/* A measurement has the octets that came from somebody. */
static int was_received(const struct game *g, int pe, const jl_meas *meas)
{
    unsigned char octets[8 + (1 + Z) * JL_REAL_OCTETS], *p = octets + 8;
    int i;

    octets[0] = 2;
    octets[1] = (unsigned char)meas->first;
    jl_put_u16(octets + 2, meas->z != NULL ? Z : 0);
    jl_put_u32(octets + 4, meas->seq);
    p = jl_put_reals(p, &meas->dt, 1);
    p = jl_put_reals(p, meas->z, meas->z != NULL ? Z : 0);
    for (i = 0; i <= g->npe; i++)
        if (g->from[pe][i].last_len == (int)(p - octets) &&
            memcmp(g->from[pe][i].last, octets, (size_t)(p - octets)) == 0)
            return 1;
    return 0;
}

static int prepare(void *context, jl_imm *imm, const jl_meas *meas)
{
    struct prepared *p = context;

    (void)imm;
    FUZZ_HOLDS(meas->first == 0 || meas->first == 1);
    FUZZ_HOLDS(was_received(p->game, p->pe, meas));
    take_up(p->game, p->pe, meas);
    return JL_OK;
}

static int prepare_cg(void *context, jl_cgimm *cg, const jl_meas *meas)
{
    struct prepared *p = context;
    struct bank *bank = &p->game->bank[p->pe];

    (void)cg;
    check_cg(bank);
    (void)prepare(context, NULL, meas);
    return renew(bank, meas);
}

/* Bind a PE's part to the game's filter, and serve. */
static int serve(jl_par *par, struct game *g, struct bank *bank,
                 const jl_par_config *config, unsigned char *buf, int *status,
                 jl_real *z)
{
    int ended;

    if (!g->cg) {
        bank_init(bank, g->exchange == JL_EXCHANGE_REDUCE, g->gate);
        FUZZ_HOLDS(jl_par_init(par, &bank->imm, config, buf,
                               JL_PAR_BUF(M, N, Z), status, z) == JL_OK);
        return jl_par_serve(par, bank->scratch);
    }
    bank_init_cg(bank);
    FUZZ_HOLDS(jl_par_init_cg(par, &bank->cg, config, buf,
                              JL_PAR_BUF(M, N, Z), status, z) == JL_OK);
    ended = jl_par_serve(par, bank->scratch);
    check_cg(bank);
    return ended;
}

static void be_pe(struct game *g, int pe, jl_chan **to, jl_chan **from)
{
    unsigned char owner[M], *buf = malloc(JL_PAR_BUF(M, N, Z));
    int *status = calloc(M, sizeof *status), ended;
    jl_real *z = calloc(Z + 1, sizeof *z);      /* one more, to be kept */
    struct prepared context;
    jl_par_config config;
    jl_par par;

    context.game = g;
    context.pe = pe;
    jl_par_deal(owner, M, g->npe);
    memset(&config, 0, sizeof config);
    config.pe = pe;
    config.npe = g->npe;
    config.owner = owner;
    config.topology = g->topology;
    config.exchange = g->exchange;
    config.to = to;
    config.from = from;
    config.to_host = to[g->npe];
    config.from_host = from[g->npe];
    config.prepare = prepare;
    config.prepare_cg = prepare_cg;
    config.context = &context;
    config.fingerprint = 7;
    config.start_us = config.timeout_us = WAIT_US;
    ended = serve(&par, g, &g->bank[pe], &config, buf, status, z);
    FUZZ_HOLDS(ended <= 0);
    FUZZ_HOLDS(z[Z] == 0);
    FUZZ_HOLDS(g->altered || ended == JL_OK || ended == JL_ECLOSED);
    free(buf);
    free(status);
    free(z);
}

/* --- the host ------------------------------------------------------------ */

/* Returns how many components it has; rarely not as many as the model. */
static int some_meas(struct game *g, jl_meas *meas, jl_real *z)
{
    unsigned how = fuzz_octet(&g->script);
    unsigned char octets[2 * JL_REAL_OCTETS];

    meas->first = how >> 1 & 1;
    meas->seq = how & 64 ? fuzz_u32(&g->script)
                         : meas->seq + 1 + (how >> 3 & 3);
    if (how & 4) {
        fuzz_octets(&g->script, octets, sizeof octets);
        meas->dt = jl_get_real(octets);
        z[0] = jl_get_real(octets + JL_REAL_OCTETS);
    } else {
        meas->dt = (jl_real)fuzz_octet(&g->script) / 16;
        z[0] = (jl_real)((int)fuzz_octet(&g->script) - 128);
    }
    z[1] = 1;
    meas->z = how & 1 ? NULL : z;
    return how & 128 && !(how & 1) ? Z + 1 : Z;
}

/* An estimate has the octets that it was read from (layout: par_msg.h). */
static void check_octets(const jl_estimate *e, const struct bent *from, int n)
{
    unsigned char octets[ESTIMATE], *p = octets + 8;
    int i;

    memset(octets, 0, 8);
    octets[0] = e->P != NULL ? 4 : 8;
    octets[1] = (unsigned char)e->verdict;
    jl_put_u16(octets + 2, (unsigned)-e->status);
    jl_put_u32(octets + 4, e->seq);
    if (e->status == JL_OK) {
        p = jl_put_reals(p, &e->loglik, 1);
        p = jl_put_reals(p, e->x, n);
        for (i = 0; i < n && e->P != NULL; i++)
            p = jl_put_reals(p, e->P + i * n + i, n - i);
        p = jl_put_reals(p, e->mu, M);
    }
    FUZZ_HOLDS(from->last_len == (int)(p - octets));
    FUZZ_HOLDS(memcmp(from->last, octets, (size_t)(p - octets)) == 0);
}

static int step(jl_estimate *e, struct bank *bank, const jl_meas *meas)
{
    jl_imm *imm = &bank->imm;
    int status = jl_imm_step(imm, meas->z, bank->scratch);

    e->verdict = imm->verdict;
    e->loglik = imm->loglik;
    e->x = imm->xhat;
    e->P = imm->Phat;
    e->mu = imm->mu;
    return status;
}

static int step_cg(jl_estimate *e, struct bank *bank, const jl_meas *meas)
{
    jl_cgimm *cg = &bank->cg;
    int status = renew(bank, meas);

    if (status == JL_OK)
        status = jl_cgimm_step(cg, meas->z);
    jl_cgimm_estimate(cg, bank->scratch);
    e->verdict = meas->z != NULL ? JL_ACCEPTED : JL_MISSING;
    e->loglik = jl_cgimm_loglik(cg);
    e->x = bank->scratch;
    e->mu = cg->mu;
    return status;
}

/* The serial filter's answer. */
static void check_answer(struct game *g, const jl_meas *meas, int m,
                         const jl_estimate *e, int n)
{
    struct bank *serial = &g->bank[g->npe];
    int status = m == Z ? usable(g, g->npe, meas) : JL_EMSG;
    jl_estimate want;

    if (status == JL_OK) {
        take_up(g, g->npe, meas);
        status = (g->cg ? step_cg : step)(&want, serial, meas);
    }
    FUZZ_HOLDS(e->seq == meas->seq);
    FUZZ_HOLDS(e->status == status);
    FUZZ_HOLDS(e->verdict == (status == JL_OK ? want.verdict : 0));
    if (status != JL_OK)
        return;
    FUZZ_HOLDS(memcmp(e->x, want.x, (size_t)n * sizeof *e->x) == 0);
    FUZZ_HOLDS(e->P == NULL ||
               memcmp(e->P, want.P, (size_t)(n * n) * sizeof *e->P) == 0);
    FUZZ_HOLDS(memcmp(e->mu, want.mu, M * sizeof *e->mu) == 0);
    FUZZ_HOLDS(memcmp(&e->loglik, &want.loglik, sizeof e->loglik) == 0);
}

static void be_host(struct game *g, jl_chan *to, jl_chan *from)
{
    unsigned char buf[LONGEST];
    jl_real x[ORDER], P[N * N], mu[M], z[Z + 1];
    jl_estimate estimate;
    jl_meas meas;
    int row, m, status, n = g->cg ? ORDER : N;

    memset(&estimate, 0, sizeof estimate);
    memset(&meas, 0, sizeof meas);
    estimate.x = x;
    estimate.P = g->cg ? NULL : P;
    estimate.mu = mu;
    if (g->cg)
        bank_init_cg(&g->bank[g->npe]);
    else
        bank_init(&g->bank[g->npe], 0, g->gate);
    status = jl_host_ready(from, 7, &estimate.failed_pe, buf, sizeof buf,
                           WAIT_US);
    g->begun = 1;
    for (row = 0; row < ROWS && g->script.left > 0 && status == JL_OK;
         row++) {
        m = some_meas(g, &meas, z);
        g->spoilt = 0;
        status = jl_host_send(to, &meas, m, buf, sizeof buf, WAIT_US);
        if (status == JL_OK)
            status = jl_host_recv(from, &estimate, M, n, buf, sizeof buf,
                                  WAIT_US);
        if (status == JL_OK)
            check_octets(&estimate, &g->from[g->npe][0], n);
        if (status == JL_OK && estimate.seq == meas.seq &&
            estimate.status == JL_OK)
            FUZZ_HOLDS(!g->spoilt);
        if (status == JL_OK && !g->altered &&
            g->exchange == JL_EXCHANGE_GATHER)
            check_answer(g, &meas, m, &estimate, n);
    }
    FUZZ_HOLDS(g->altered || status == JL_OK);
    if (fuzz_octet(&g->script) % 8 != 7)
        (void)jl_host_stop(to, buf, sizeof buf, WAIT_US);
}

/* --- the game ------------------------------------------------------------ */

static void be_node(int node, void *context)
{
    struct game *g = context;
    jl_chan *to[NODES] = { NULL }, *from[NODES] = { NULL };
    int i;

    for (i = 0; i <= g->npe; i++)
        if (i != node) {
            struct bent *b = &g->from[node][i];

            to[i] = jl_loop_tx(g->loop, node, i);
            from[i] = &b->chan;
            b->inner = jl_loop_rx(g->loop, i, node);
            b->game = g;
            b->to = node;
            b->from = i;
            jl_chan_init(&b->chan, &bent_ops, LONGEST, b->inner->slots);
        }
    if (node == g->npe)
        be_host(g, to[0], from[0]);
    else
        be_pe(g, node, to, from);
}

int fuzz_par(const unsigned char *data, size_t size)
{
    static struct game g;
    unsigned first;

    memset(&g, 0, sizeof g);
    g.script.at = data;
    g.script.left = size;
    first = fuzz_octet(&g.script);
    g.npe = 1 + (int)(first % PES);
    g.topology = (int)(first >> 2 & 3);
    g.cg = first >> 5 == 7;
    g.exchange = first >> 7 && !g.cg ? JL_EXCHANGE_REDUCE
                                     : JL_EXCHANGE_GATHER;
    g.gate = first >> 5 == 3;
    g.loop = jl_loop_new(g.npe + 1, LONGEST, (int)(first >> 4 & 7) % 3);
    FUZZ_HOLDS(g.loop != NULL);
    FUZZ_HOLDS(jl_loop_run(g.loop, be_node, &g) == JL_OK);
    jl_loop_free(g.loop);
    return 0;
}
