/* A model made into a filter: the same on every PE and on the serial side. */
#ifndef SIM_BANK_H
#define SIM_BANK_H

#include "jumplink/imm.h"
#include "jumplink/par.h"
#include "model_file.h"
#include "options.h"

struct bank {
    const struct model *model;
    jl_mode *modes;             /* own copies: they are rebuilt for each dt */
    jl_real *mode_mem;
    jl_real *mem, *scratch, *Pi;
    jl_real *x, *P;             /* a start from a first measurement         */
    jl_real dt;                 /* what modes and chain are built for       */
    jl_imm imm;
};

/* Returns 0, or -1 if there is no memory. */
int bank_open(struct bank *bank, const struct model *model,
              const struct options *options);
void bank_close(struct bank *bank);

/* A jl_prepare with a struct bank as context: starts a record, rebuilds the
 * modes and the chain when the time step changes. */
int bank_prepare(void *bank, jl_imm *imm, const jl_meas *meas);

#endif
