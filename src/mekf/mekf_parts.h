/* What the files of mekf share. */
#ifndef JL_MEKF_PARTS_H
#define JL_MEKF_PARTS_H

#include "jumplink/mekf.h"

#if JL_REAL_FLOAT
#define jli_mekf_check jli_mekf_check_f32
#define jli_mekf_linearise jli_mekf_linearise_f32
#define jli_mekf_move jli_mekf_move_f32
#define jli_mekf_drive jli_mekf_drive_f32
#define jli_mekf_sense jli_mekf_sense_f32
#define jli_mekf_c jli_mekf_c_f32
#define jli_mekf_innovate jli_mekf_innovate_f32
#endif

/* Sizes and covariances as an init is given them: JL_OK, JL_EDIM,
 * JL_ENONFINITE, JL_EASYM, JL_EDEF.  scratch [max(p p, r r)] */
int jli_mekf_check(const jl_mekf_model *model, const jl_real *Q,
                   const jl_real *R, jl_real *scratch);

/* A model around a point, N = n + m. */
struct jli_linear {
    jl_real *F;                 /* [N,N]                                    */
    jl_real *G;                 /* [N,p]                                    */
    jl_real *H;                 /* [r,N]                                    */
    jl_real *c;                 /* [r,n]                                    */
    jl_real *xp;                /* [N] predicted                            */
    jl_real *nu;                /* [r] z - c xp                             */
};

/* All of it, F at xhat [n], y and G at x, y of xbar [N]; z NULL: H, c, nu are
 * left out.  mem [JL_MEKF_LINEAR]; scratch [N (N + p) + r (N + r)], which the
 * matrices of a step are anyhow.
 * Returns JL_OK, JL_ENONFINITE (of z, too), or a function's code. */
int jli_mekf_linearise(struct jli_linear *l, jl_real *mem,
                       const jl_mekf_model *model, const jl_real *xhat,
                       const jl_real *xbar, const jl_real *z,
                       jl_real *scratch);

/* Its parts, for who gets their arguments one after another; scratch and codes
 * as above.  xp, F at x, y; G at x, y; c, H at xp. */
int jli_mekf_move(struct jli_linear *l, const jl_mekf_model *model,
                  const jl_real *x, const jl_real *y, jl_real *scratch);
int jli_mekf_drive(struct jli_linear *l, const jl_mekf_model *model,
                   const jl_real *x, const jl_real *y, jl_real *scratch);
int jli_mekf_sense(struct jli_linear *l, const jl_mekf_model *model,
                   jl_real *scratch);

/* c [r,n] at x, y; returns as above. */
int jli_mekf_c(jl_real *c, const jl_mekf_model *model, const jl_real *x,
               const jl_real *y);

/* nu [r] = z - c x */
void jli_mekf_innovate(jl_real *nu, const jl_real *z, const jl_real *c,
                       const jl_real *x, int n, int r);

#endif
