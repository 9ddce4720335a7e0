/* Model files: JSON of kind imm, cgimm or mekf (../tests/golden has examples; keys:
 * README.md, --help of filter), as arrays ready for the library. */
#ifndef SIM_MODEL_FILE_H
#define SIM_MODEL_FILE_H

#include "jumplink/cgimm.h"
#include "jumplink/model.h"
#include "mekf_filter.h"

struct model {
    char *path;
    int M, n, m;                /* of kind mekf 0, n + m, r                 */
    struct mekf_setup *mekf;    /* of kind mekf, or NULL: of the others     */
    jl_cg_gains *gains;         /* [M] of kind cgimm, or NULL: kind imm     */
    jl_real T, R;               /* of kind cgimm, that has no modes, no P0  */
    jl_mode *modes;             /* [M]; of the catalogue: sized, not filled */
    jl_motion *motions;         /* [M] of the catalogue, or NULL: matrices  */
    const int **map;            /* [M] what modes have of the n components
                                   (jl_imm_init_sizes), or NULL: all        */
    jl_real *prior_x, *prior_var;       /* [n] of what a mode lacks, or NULL */
    jl_real *sojourn_s;         /* [M] or NULL: Pi is fixed                 */
    jl_real *Pi;                /* [M,M] or NULL: from sojourn_s            */
    jl_real *mu0;               /* [M]                                      */
    jl_real *x0;                /* [M,n] or NULL: start at the first z (not
                                   of kind mekf)                            */
    jl_real *P0;                /* [M,n,n] or NULL                          */
    jl_real v0_std, a0_std;     /* for a start at the first measurement     */
    jl_u32 fingerprint;         /* CRC-32 of the file's octets              */
};

/* Read a model.  Everything the library's init and set calls would refuse is
 * refused here with the file, the key ("modes[1].R") and the reason in one
 * line on standard error; returns -1, with *model empty; else 0. */
int model_read(struct model *model, const char *path);
void model_free(struct model *model);

#endif
