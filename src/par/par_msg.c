/* Messages as octets. */
#include "par/par_msg.h"

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

static int owned(const jl_par *par, int pe)
{
    int j, count = 0;

    for (j = 0; j < par->imm->M; j++)
        count += par->config.owner[j] == pe;
    return count;
}

/* The lower half of a full covariance is not sent: it mirrors the upper. */
static unsigned char *put_upper(unsigned char *p, const jl_real *P, int n)
{
    int i;

    for (i = 0; i < n; i++)
        p = jl_put_reals(p, P + i * n + i, n - i);
    return p;
}

static const unsigned char *get_upper(const unsigned char *p, jl_real *P,
                                      int n)
{
    int i, j;

    for (i = 0; i < n; i++) {
        p = jl_get_reals(p, P + i * n + i, n - i);
        for (j = i + 1; j < n; j++)
            P[j * n + i] = P[i * n + j];
    }
    return p;
}

int jli_msg_modes(unsigned char *buf, const jl_par *par)
{
    const jl_imm *imm = par->imm;
    int j, n = imm->n, pe = par->config.pe;
    unsigned char *p = buf;

    p += jli_msg_plain(buf, JLI_MODES, pe, owned(par, pe), par->seq);
    for (j = 0; j < imm->M; j++)
        if (par->config.owner[j] == pe) {
            jl_put_u16(p, (unsigned)-par->status[j]);
            p += 2;
        }
    for (j = 0; j < imm->M; j++)
        if (par->config.owner[j] == pe) {
            p = jl_put_reals(p, &imm->l[j], 1);
            p = jl_put_reals(p, imm->xw + j * n, n);
            p = put_upper(p, imm->Pw + j * n * n, n);
        }
    return (int)(p - buf);
}

int jli_msg_modes_read(jl_par *par, int pe, const unsigned char *buf,
                       int len)
{
    jl_imm *imm = par->imm;
    int j, n = imm->n, count = owned(par, pe);

    if (len < JLI_MSG_HEADER)
        return JL_ELENGTH;
    if (buf[0] != JLI_MODES || buf[1] != pe
        || (int)jl_get_u16(buf + 2) != count
        || jl_get_u32(buf + 4) != par->seq)
        return JL_EMSG;
    if (len != JLI_MSG_HEADER + count * JL_PAR_MODE(n))
        return JL_ELENGTH;
    buf += JLI_MSG_HEADER;
    for (j = 0; j < imm->M; j++)
        if (par->config.owner[j] == pe) {
            par->status[j] = -(int)jl_get_u16(buf);
            buf += 2;
        }
    for (j = 0; j < imm->M; j++)
        if (par->config.owner[j] == pe) {
            buf = jl_get_reals(buf, &imm->l[j], 1);
            buf = jl_get_reals(buf, imm->xw + j * n, n);
            buf = get_upper(buf, imm->Pw + j * n * n, n);
        }
    return JL_OK;
}

/* --- estimate ------------------------------------------------------------ */

int jli_msg_estimate(unsigned char *buf, const jl_imm *imm, jl_u32 seq,
                     int status)
{
    unsigned char *p = buf + jli_msg_plain(buf, JLI_ESTIMATE, 0, -status, seq);

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
    if (buf[0] != JLI_ESTIMATE || buf[1] != 0)
        return JL_EMSG;
    status = -(int)jl_get_u16(buf + 2);
    if (len != JLI_MSG_HEADER + (status != JL_OK ? 0 : 1 + n + JL_PACKED(n)
                                 + M) * JL_REAL_OCTETS)
        return JL_ELENGTH;
    estimate->seq = jl_get_u32(buf + 4);
    estimate->status = status;
    if (status == JL_OK) {
        buf = jl_get_reals(buf + JLI_MSG_HEADER, &estimate->loglik, 1);
        buf = jl_get_reals(buf, estimate->x, n);
        buf = get_upper(buf, estimate->P, n);
        (void)jl_get_reals(buf, estimate->mu, M);
    }
    return JL_OK;
}
