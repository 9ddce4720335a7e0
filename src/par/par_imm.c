/* The IMM, distributed. */
#include "par/par_parts.h"

#include "imm/imm_stage.h"
#include "jumplink/mat.h"

static int reduces(const jl_par *par)
{
    return par->config.exchange == JL_EXCHANGE_REDUCE && par->active > 1;
}

/* What a gate rejects may be as large as it likes. */
static jl_real largest(const jl_par *par)
{
    return par->imm->gate > 0 ? JL_REAL_MAX : JL_LARGE;
}

/* --- a step -------------------------------------------------------------- */

static int prepare(jl_par *par, const jl_meas *meas)
{
    jl_imm *imm = par->imm;
    int status = JL_OK;

    if (par->config.prepare != NULL)
        status = par->config.prepare(par->config.context, imm, meas);
    if (status != JL_OK)
        return status;
    if (reduces(par) && !imm->sticky)
        return JL_ECHAIN;
    return reduces(par) && imm->gate > 0 ? JL_EGATE : JL_OK;
}

static void ahead(jl_par *par, jl_real *scratch)
{
    jl_imm *imm = par->imm;
    int j;

    if (par->ahead && imm->stage == JLI_MIXED)
        return;
    jl_imm_foresee(imm);
    for (j = 0; j < imm->M; j++)
        if (JLI_OWNS(par, j)) {
            jl_imm_mix_mode(imm, j, scratch);
            par->status[j] = jl_imm_predict_mode(imm, j, scratch);
        }
}

static void update(jl_par *par, const jl_real *z, jl_real *scratch)
{
    int j;

    for (j = 0; j < par->M; j++)
        if (JLI_OWNS(par, j) && par->status[j] == JL_OK)
            par->status[j] = jl_imm_update_mode(par->imm, j, z, scratch);
    if (reduces(par)) {
        par->pool = scratch;
        jli_pool_own(par);
    }
}

static int commit(jl_par *par, const jl_real *z, jl_real *scratch)
{
    jl_imm *imm = par->imm;
    int status = jl_imm_judge(imm, z, scratch);

    if (status == JL_OK)
        status = jl_imm_weigh(imm);
    if (status != JL_OK)
        return status;
    par->verdict = imm->verdict;
    if (reduces(par))
        jli_pool_merge(par);
    else if (par->config.pe == 0)
        jl_imm_combine(imm);
    return JL_OK;
}

/* --- messages ------------------------------------------------------------ */

/* A mode whose nis is above the gate says so in its status. */
#define OUTSIDE 0x8000u

static unsigned word(const jl_par *par, int j)
{
    const jl_imm *imm = par->imm;
    unsigned status = (unsigned)-par->status[j];

    return imm->gate > 0 && imm->nis[j] > imm->gate ? status | OUTSIDE
        : status;
}

static void read_word(jl_par *par, int j, unsigned status)
{
    par->status[j] = -(int)(status & ~OUTSIDE);
    par->imm->nis[j] = status & OUTSIDE ? -jl_log(0) : 0;  /* above any gate */
}

/* Of every mode, or of every PE, at the place of its first mode. */
static int has_estimate(const jl_par *par, int j)
{
    int i;

    if (par->config.exchange != JL_EXCHANGE_REDUCE)
        return 1;
    for (i = 0; par->config.owner[i] != par->config.owner[j]; i++)
        ;
    return i == j;
}

static int reals(const jl_par *par, int j)
{
    return has_estimate(par, j) ? par->n + JL_PACKED(par->n) : 0;
}

/* The own pool has a place of its own, for the own modes are still needed. */
static unsigned char *put(unsigned char *p, const jl_par *par, int j)
{
    const jl_imm *imm = par->imm;
    int n = imm->n;
    const jl_real *x = imm->xw + j * n, *P = imm->Pw + j * n * n;

    if (!has_estimate(par, j))
        return p;
    if (par->config.exchange == JL_EXCHANGE_REDUCE && JLI_OWNS(par, j)) {
        x = par->pool;
        P = x + n;
    }
    p = jl_put_reals(p, x, n);
    return jli_put_upper(p, P, n);
}

static const unsigned char *get(const unsigned char *p, jl_par *par, int j)
{
    jl_imm *imm = par->imm;
    int n = imm->n;

    if (!has_estimate(par, j))
        return p;
    p = jl_get_reals(p, imm->xw + j * n, n);
    return jli_get_upper(p, imm->Pw + j * n * n, imm->form->cov->factored, n);
}

/* l is -infinite where a mode cannot use what its gate rejects. */
static int is_sound(const jl_par *par, int j)
{
    const jl_imm *imm = par->imm;
    int n = imm->n;

    return imm->l[j] <= JL_REAL_MAX
        && (!has_estimate(par, j)
            || (jl_vec_within(imm->xw + j * n, n, JL_REAL_MAX)
                && jl_vec_within(imm->Pw + j * n * n, n * n, JL_REAL_MAX)));
}

static void answer(const jl_par *par, jl_estimate *estimate, jl_real *scratch)
{
    const jl_imm *imm = par->imm;

    (void)scratch;
    estimate->loglik = imm->loglik;
    estimate->x = imm->xhat;
    estimate->P = imm->Phat;
    estimate->mu = imm->mu;
}

int jl_par_init(jl_par *par, jl_imm *imm, const jl_par_config *config,
                unsigned char *buf, int cap, int *status, jl_real *z)
{
    static const struct jl_par_kind kind = {
        JLI_MODES, largest, prepare, ahead, update, commit, word, read_word,
        reals, put, get, is_sound, answer
    };
    int bound = jli_par_bind(par, imm->M, imm->n, imm->m,
                             JL_PAR_MSG(imm->M, imm->n, imm->m), config, buf,
                             cap, status, z);

    if (bound != JL_OK)
        return bound;
    par->kind = &kind;
    par->imm = imm;
    par->l = imm->l;
    return JL_OK;
}
