/* A model made into a filter: the same on every PE and on the serial side. */
#ifndef SIM_BANK_H
#define SIM_BANK_H

#include "jumplink/par.h"
#include "mekf_filter.h"
#include "model_file.h"
#include "options.h"

struct bank {
    const struct model *model;
    jl_real *mem, *scratch;
    jl_real *x, *P;             /* a start from a first measurement         */
    jl_cgimm cg;                /* the filter of kind cgimm                 */
    struct mekf_filter *mekf;   /* of kind mekf; NULL of others             */
    jl_imm imm;                 /* of kind imm, and:                        */
    jl_mode *modes;             /* own copies: they are rebuilt for each dt */
    jl_real *mode_mem, *Pi;
    jl_real dt;                 /* what modes and chain are built for       */
};

/* Returns 0, or -1 if there is no memory. */
int bank_open(struct bank *bank, const struct model *model,
              const struct options *options);
void bank_close(struct bank *bank);

/* A jl_prepare with a struct bank as context: starts a record, rebuilds the
 * modes and the chain when the time step changes. */
int bank_prepare(void *bank, jl_imm *imm, const jl_meas *meas);

/* A jl_prepare_cg: starts a record. */
int bank_prepare_cg(void *bank, jl_cgimm *cg, const jl_meas *meas);

/* A step on one processor: what jl_host_recv has of a parallel one; x, P, mu
 * are the bank's, until the next.  Returns JL_OK, JL_STARTED, or why the step
 * failed. */
int bank_step(struct bank *bank, jl_estimate *estimate, const jl_meas *meas);

#endif
