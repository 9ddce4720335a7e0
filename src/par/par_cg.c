/* The constant-gain IMM, distributed: the message of a mode is its l, of
 * nu^2, and its state; all else every PE has. */
#include "par/par_parts.h"

#include "cgimm/cg_parts.h"
#include "jumplink/mat.h"

static jl_real largest(const jl_par *par)
{
    (void)par;
    return JL_LARGE;
}

/* --- a step -------------------------------------------------------------- */

static int prepare(jl_par *par, const jl_meas *meas)
{
    return par->config.prepare_cg == NULL ? JL_OK
        : par->config.prepare_cg(par->config.context, par->cg, meas);
}

static void ahead(jl_par *par, jl_real *scratch)
{
    jl_cgimm *cg = par->cg;
    int j;

    (void)scratch;
    if (par->ahead && cg->stage == JLI_CG_MIXED)
        return;
    jl_cgimm_foresee(cg);
    for (j = 0; j < cg->M; j++)
        if (JLI_OWNS(par, j))
            jl_cgimm_mix_mode(cg, j);
}

/* As in a message; the sum of nu^2 may have overflowed. */
static int is_sound(const jl_par *par, int j)
{
    const jl_cgimm *cg = par->cg;
    int a, sound = cg->l[j] >= 0;

    for (a = 0; a < cg->axes; a++)
        sound &= jl_vec_within(cg->mixed + (j * cg->axes + a) * 3,
                               cg->gains[j].order, JL_REAL_MAX);
    return sound;
}

static int filter_mode(const jl_par *par, int j, const jl_real *z)
{
    int status = jl_cgimm_filter_mode(par->cg, j, z);

    return status == JL_OK && !is_sound(par, j) ? JL_ENONFINITE : status;
}

static void update(jl_par *par, const jl_real *z, jl_real *scratch)
{
    int j;

    (void)scratch;
    for (j = 0; j < par->M; j++)
        if (JLI_OWNS(par, j))
            par->status[j] = filter_mode(par, j, z);
}

/* On every PE: the next mixing uses what combine computes. */
static int commit(jl_par *par, const jl_real *z, jl_real *scratch)
{
    int status = jl_cgimm_weigh(par->cg, z);

    (void)scratch;
    if (status != JL_OK)
        return status;
    jl_cgimm_combine(par->cg);
    par->verdict = z != NULL ? JL_ACCEPTED : JL_MISSING;
    return JL_OK;
}

/* --- messages ------------------------------------------------------------ */

static unsigned word(const jl_par *par, int j)
{
    return (unsigned)-par->status[j];
}

static void read_word(jl_par *par, int j, unsigned status)
{
    par->status[j] = -(int)status;
}

static int reals(const jl_par *par, int j)
{
    return par->cg->axes * par->cg->gains[j].order;
}

/* As the filter keeps the state, p, v T, a T^2 / 2: its bits. */
static unsigned char *put(unsigned char *p, const jl_par *par, int j)
{
    const jl_cgimm *cg = par->cg;
    int a;

    for (a = 0; a < cg->axes; a++)
        p = jl_put_reals(p, cg->mixed + (j * cg->axes + a) * 3,
                         cg->gains[j].order);
    return p;
}

static const unsigned char *get(const unsigned char *p, jl_par *par, int j)
{
    jl_cgimm *cg = par->cg;
    int a;

    for (a = 0; a < cg->axes; a++)
        p = jl_get_reals(p, cg->mixed + (j * cg->axes + a) * 3,
                         cg->gains[j].order);
    return p;
}

static void answer(const jl_par *par, jl_estimate *estimate, jl_real *scratch)
{
    const jl_cgimm *cg = par->cg;

    jl_cgimm_estimate(cg, scratch);
    estimate->loglik = jl_cgimm_loglik(cg);
    estimate->x = scratch;
    estimate->mu = cg->mu;
}

int jl_par_init_cg(jl_par *par, jl_cgimm *cg, const jl_par_config *config,
                   unsigned char *buf, int cap, int *status, jl_real *z)
{
    static const struct jl_par_kind kind = {
        JLI_CG_MODES, largest, prepare, ahead, update, commit, word, read_word,
        reals, put, get, is_sound, answer
    };
    int bound;

    if (config->exchange == JL_EXCHANGE_REDUCE)
        return JL_ECHAIN;
    bound = jli_par_bind(par, cg->M, cg->axes * cg->order, cg->axes,
                         JL_PAR_CG_MSG(cg->M, cg->axes), config, buf, cap,
                         status, z);
    if (bound != JL_OK)
        return bound;
    par->kind = &kind;
    par->cg = cg;
    par->l = cg->l;
    return JL_OK;
}
