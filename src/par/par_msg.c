/* Messages as octets. */
#include "par/par_parts.h"

#include "mat/mat_k.h"

int jli_msg_plain(unsigned char *buf, int type, int octet, int number,
                  jl_u32 word)
{
    buf[0] = (unsigned char)type;
    buf[1] = (unsigned char)octet;
    jl_put_u16(buf + 2, (unsigned)number);
    jl_put_u32(buf + 4, word);
    return JLI_MSG_HEADER;
}

/* --- measurement --------------------------------------------------------- */

int jli_msg_meas(unsigned char *buf, const jl_meas *meas, int m)
{
    unsigned char *p;

    p = buf + jli_msg_plain(buf, JLI_MEAS, meas->first != 0,
                            meas->z != NULL ? m : 0, meas->seq);
    p = jl_put_reals(p, &meas->dt, 1);
    if (meas->z != NULL)
        p = jl_put_reals(p, meas->z, m);
    return (int)(p - buf);
}

int jli_msg_meas_read(jl_meas *meas, jl_real *z, int m,
                      const unsigned char *buf, int len)
{
    int count;

    if (len < JLI_MSG_HEADER)
        return JL_ELENGTH;
    if (buf[0] != JLI_MEAS || buf[1] > 1)
        return JL_EMSG;
    meas->seq = jl_get_u32(buf + 4);    /* first: the refusal bears it */
    meas->first = buf[1];
    count = (int)jl_get_u16(buf + 2);
    if (count != 0 && count != m)
        return JL_EMSG;
    if (len != JLI_MSG_HEADER + (1 + count) * JL_REAL_OCTETS)
        return JL_ELENGTH;
    buf = jl_get_reals(buf + JLI_MSG_HEADER, &meas->dt, 1);
    (void)jl_get_reals(buf, z, count);
    meas->z = count > 0 ? z : NULL;
    return JL_OK;
}

/* --- modes --------------------------------------------------------------- */

static int carried(const jl_par *par, const jl_hop *hop, int j)
{
    return JLI_CARRIES(hop, par->config.owner[j], par->active);
}

/* How many modes a hop carries; and estimates with them: of every mode, or of
 * every PE, at the place of its first mode. */
static int count_modes(const jl_par *par, const jl_hop *hop)
{
    int j, count = 0;

    for (j = 0; j < par->imm->M; j++)
        count += carried(par, hop, j);
    return count;
}

static int has_estimate(const jl_par *par, int j)
{
    int i;

    if (par->config.exchange != JL_EXCHANGE_REDUCE)
        return 1;
    for (i = 0; par->config.owner[i] != par->config.owner[j]; i++)
        ;
    return i == j;
}

static int count_estimates(const jl_par *par, const jl_hop *hop)
{
    return par->config.exchange == JL_EXCHANGE_REDUCE ? hop->count
        : count_modes(par, hop);
}

/* The lower half of a covariance is not sent: it mirrors the upper, or, of a
 * factor, is zero. */
static unsigned char *put_upper(unsigned char *p, const jl_real *P, int n)
{
    int i;

    for (i = 0; i < n; i++)
        p = jl_put_reals(p, P + i * n + i, n - i);
    return p;
}

static const unsigned char *get_upper(const unsigned char *p, jl_real *P,
                                      int factored, int n)
{
    int i, j;

    for (i = 0; i < n; i++) {
        p = jl_get_reals(p, P + i * n + i, n - i);
        for (j = i + 1; j < n; j++)
            P[j * n + i] = factored ? 0 : P[i * n + j];
    }
    return p;
}

/* A mode whose nis is above the gate says so in its status. */
#define OUTSIDE 0x8000u

static unsigned status_word(const jl_par *par, int j)
{
    const jl_imm *imm = par->imm;
    unsigned word = (unsigned)-par->status[j];

    return imm->gate > 0 && imm->nis[j] > imm->gate ? word | OUTSIDE : word;
}

static void read_status(jl_par *par, int j, unsigned word)
{
    par->status[j] = -(int)(word & ~OUTSIDE);
    par->imm->nis[j] = word & OUTSIDE ? -jl_log(0) : 0; /* above any gate */
}

/* The own pool has a place of its own, for the own modes are still needed. */
static unsigned char *put_estimate(unsigned char *p, const jl_par *par, int j)
{
    const jl_imm *imm = par->imm;
    int n = imm->n;
    const jl_real *x = imm->xw + j * n, *P = imm->Pw + j * n * n;

    if (par->config.exchange == JL_EXCHANGE_REDUCE
        && par->config.owner[j] == par->config.pe) {
        x = par->pool;
        P = x + n;
    }
    p = jl_put_reals(p, x, n);
    return put_upper(p, P, n);
}

int jli_msg_modes(unsigned char *buf, const jl_par *par, const jl_hop *hop)
{
    const jl_imm *imm = par->imm;
    unsigned char *p = buf;
    int j;

    p += jli_msg_plain(buf, JLI_MODES, par->config.pe, count_modes(par, hop),
                       par->seq);
    for (j = 0; j < imm->M; j++)
        if (carried(par, hop, j)) {
            jl_put_u16(p, status_word(par, j));
            p += 2;
        }
    for (j = 0; j < imm->M; j++)
        if (carried(par, hop, j))
            p = jl_put_reals(p, &imm->l[j], 1);
    for (j = 0; j < imm->M; j++)
        if (carried(par, hop, j) && has_estimate(par, j))
            p = put_estimate(p, par, j);
    return (int)(p - buf);
}

int jli_msg_modes_read(jl_par *par, const jl_hop *hop,
                       const unsigned char *buf, int len)
{
    jl_imm *imm = par->imm;
    int j, n = imm->n, count = count_modes(par, hop);

    if (len < JLI_MSG_HEADER)
        return JL_ELENGTH;
    if (buf[0] != JLI_MODES || buf[1] != hop->from
        || (int)jl_get_u16(buf + 2) != count
        || jl_get_u32(buf + 4) != par->seq)
        return JL_EMSG;
    if (len != JLI_MSG_HEADER + count * (2 + JL_REAL_OCTETS)
               + count_estimates(par, hop) * (n + JL_PACKED(n))
                 * JL_REAL_OCTETS)
        return JL_ELENGTH;
    buf += JLI_MSG_HEADER;
    for (j = 0; j < imm->M; j++)
        if (carried(par, hop, j)) {
            read_status(par, j, jl_get_u16(buf));
            buf += 2;
        }
    for (j = 0; j < imm->M; j++)
        if (carried(par, hop, j))
            buf = jl_get_reals(buf, &imm->l[j], 1);
    for (j = 0; j < imm->M; j++)
        if (carried(par, hop, j) && has_estimate(par, j)) {
            buf = jl_get_reals(buf, imm->xw + j * n, n);
            buf = get_upper(buf, imm->Pw + j * n * n,
                            imm->form->cov->factored, n);
        }
    return JL_OK;
}

/* --- estimate ------------------------------------------------------------ */

int jli_msg_estimate(unsigned char *buf, const jl_imm *imm, jl_u32 seq,
                     int status)
{
    unsigned char *p = buf;

    p += jli_msg_plain(buf, JLI_ESTIMATE, status == JL_OK ? imm->verdict : 0,
                       -status, seq);
    if (status == JL_OK) {
        p = jl_put_reals(p, &imm->loglik, 1);
        p = jl_put_reals(p, imm->xhat, imm->n);
        p = put_upper(p, imm->Phat, imm->n);
        p = jl_put_reals(p, imm->mu, imm->M);
    }
    return (int)(p - buf);
}

int jli_msg_estimate_read(jl_estimate *estimate, int M, int n,
                          const unsigned char *buf, int len)
{
    int status;

    if (len < JLI_MSG_HEADER)
        return JL_ELENGTH;
    status = -(int)jl_get_u16(buf + 2);
    if (buf[0] != JLI_ESTIMATE
        || buf[1] > (status == JL_OK ? JL_REJECTED : 0))
        return JL_EMSG;
    if (len != JLI_MSG_HEADER + (status != JL_OK ? 0 : 1 + n + JL_PACKED(n)
                                 + M) * JL_REAL_OCTETS)
        return JL_ELENGTH;
    estimate->seq = jl_get_u32(buf + 4);
    estimate->status = status;
    estimate->verdict = buf[1];
    if (status == JL_OK) {
        buf = jl_get_reals(buf + JLI_MSG_HEADER, &estimate->loglik, 1);
        buf = jl_get_reals(buf, estimate->x, n);
        buf = get_upper(buf, estimate->P, 0, n);
        (void)jl_get_reals(buf, estimate->mu, M);
    }
    return JL_OK;
}

/* --- fault --------------------------------------------------------------- */

int jli_msg_fault_read(int *culprit, int *status, int npe,
                       const unsigned char *buf, int len)
{
    if (len != JLI_MSG_HEADER)
        return JL_ELENGTH;
    if (buf[0] != JLI_FAULT || buf[1] > npe || jl_get_u16(buf + 2) == 0)
        return JL_EMSG;
    *culprit = buf[1];
    *status = -(int)jl_get_u16(buf + 2);
    return JL_OK;
}
