/* Messages as octets. */
#include "par/par_parts.h"

int jli_msg_plain(unsigned char *buf, int type, int octet, int number,
                  jl_u32 word)
{
    buf[0] = (unsigned char)type;
    buf[1] = (unsigned char)octet;
    jl_put_u16(buf + 2, (unsigned)number);
    jl_put_u32(buf + 4, word);
    return JLI_MSG_HEADER;
}

/* --- covariance ---------------------------------------------------------- */

unsigned char *jli_put_upper(unsigned char *p, const jl_real *P, int n)
{
    int i;

    for (i = 0; i < n; i++)
        p = jl_put_reals(p, P + i * n + i, n - i);
    return p;
}

const unsigned char *jli_get_upper(const unsigned char *p, jl_real *P,
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

static int count_modes(const jl_par *par, const jl_hop *hop)
{
    int j, count = 0;

    for (j = 0; j < par->M; j++)
        count += carried(par, hop, j);
    return count;
}

int jli_msg_modes(unsigned char *buf, const jl_par *par, const jl_hop *hop)
{
    unsigned char *p = buf;
    int j;

    p += jli_msg_plain(buf, par->kind->modes, par->config.pe,
                       count_modes(par, hop), par->seq);
    for (j = 0; j < par->M; j++)
        if (carried(par, hop, j)) {
            jl_put_u16(p, par->kind->word(par, j));
            p += 2;
        }
    for (j = 0; j < par->M; j++)
        if (carried(par, hop, j))
            p = jl_put_reals(p, &par->l[j], 1);
    for (j = 0; j < par->M; j++)
        if (carried(par, hop, j))
            p = par->kind->put(p, par, j);
    return (int)(p - buf);
}

/* Where one has failed, the others' pool may be anything, and nobody uses it. */
static int are_sound(const jl_par *par, const jl_hop *hop)
{
    int j, sound = 1, failed = 0;

    for (j = 0; j < par->M; j++)
        if (carried(par, hop, j)) {
            failed |= par->status[j] != JL_OK;
            sound &= par->kind->is_sound(par, j);
        }
    return sound || failed;
}

int jli_msg_modes_read(jl_par *par, const jl_hop *hop,
                       const unsigned char *buf, int len)
{
    int j, want = JLI_MSG_HEADER;

    if (len < JLI_MSG_HEADER)
        return JL_ELENGTH;
    if (buf[0] != par->kind->modes || buf[1] != hop->from
        || (int)jl_get_u16(buf + 2) != count_modes(par, hop)
        || jl_get_u32(buf + 4) != par->seq)
        return JL_EMSG;
    for (j = 0; j < par->M; j++)
        if (carried(par, hop, j))
            want += 2 + (1 + par->kind->reals(par, j)) * JL_REAL_OCTETS;
    if (len != want)
        return JL_ELENGTH;
    buf += JLI_MSG_HEADER;
    for (j = 0; j < par->M; j++)
        if (carried(par, hop, j)) {
            par->kind->read_word(par, j, jl_get_u16(buf));
            buf += 2;
        }
    for (j = 0; j < par->M; j++)
        if (carried(par, hop, j))
            buf = jl_get_reals(buf, &par->l[j], 1);
    for (j = 0; j < par->M; j++)
        if (carried(par, hop, j))
            buf = par->kind->get(buf, par, j);
    return are_sound(par, hop) ? JL_OK : JL_EMSG;
}

/* --- estimate ------------------------------------------------------------ */

static int type_of(const jl_estimate *estimate)
{
    return estimate->P != NULL ? JLI_ESTIMATE : JLI_CG_ESTIMATE;
}

int jli_msg_estimate(unsigned char *buf, const jl_estimate *estimate, int M,
                     int n)
{
    unsigned char *p = buf;

    p += jli_msg_plain(buf, type_of(estimate), estimate->verdict,
                       -estimate->status, estimate->seq);
    if (estimate->status == JL_OK) {
        p = jl_put_reals(p, &estimate->loglik, 1);
        p = jl_put_reals(p, estimate->x, n);
        if (estimate->P != NULL)
            p = jli_put_upper(p, estimate->P, n);
        p = jl_put_reals(p, estimate->mu, M);
    }
    return (int)(p - buf);
}

int jli_msg_estimate_read(jl_estimate *estimate, int M, int n,
                          const unsigned char *buf, int len)
{
    int status, packed = estimate->P != NULL ? JL_PACKED(n) : 0;

    if (len < JLI_MSG_HEADER)
        return JL_ELENGTH;
    status = -(int)jl_get_u16(buf + 2);
    if (buf[0] != type_of(estimate)
        || buf[1] > (status == JL_OK ? JL_REJECTED : 0))
        return JL_EMSG;
    if (len != JLI_MSG_HEADER
               + (status != JL_OK ? 0 : 1 + n + packed + M) * JL_REAL_OCTETS)
        return JL_ELENGTH;
    estimate->seq = jl_get_u32(buf + 4);
    estimate->status = status;
    estimate->verdict = buf[1];
    if (status == JL_OK) {
        buf = jl_get_reals(buf + JLI_MSG_HEADER, &estimate->loglik, 1);
        buf = jl_get_reals(buf, estimate->x, n);
        if (estimate->P != NULL)
            buf = jli_get_upper(buf, estimate->P, 0, n);
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
