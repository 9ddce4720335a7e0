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
#define jli_mekf_choose jli_mekf_choose_f32
#define jli_array_start jli_array_start_f32
#define jli_array_row jli_array_row_f32
#define jli_array_products jli_array_products_f32
#define jli_array_sense jli_array_sense_f32
#define jli_array_triangle jli_array_triangle_f32
#define jli_array_take jli_array_take_f32
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

/* c for B, l->c being at the prediction and x at A's estimate (if it is c of
 * JL_MEKF_FILT); returns as above. */
int jli_mekf_choose(jl_real *cc, const jl_mekf *filter,
                    const struct jli_linear *l, const jl_real *x);

/* --- mekf_array.c --------------------------------------------------------- */

/* The array of a filter of n states and r measurements, rows of r + n:
 *     [ U_R       0     ]       [ V'  V^-1 H Pp ]
 *     [ L M' H'   L M'  ]  ->   [ 0   U         ]
 *     [ ..        ..    ]       [ 0   0         ]
 * with as many products L M' as Pp is a sum of squares of.  U_R comes first,
 * for it is triangular already.  r = 0: a prediction.
 * It may be made triangular in pieces: when the first `done` rows are, A is
 * what is left, [rows - done, r + n - done]. */
struct jli_array {
    jl_real *A;
    int rows, n, r;             /* as it began                              */
    int done;
};

/* What goes through the first r rows of the triangle beside the array. */
struct jli_feed {
    jl_real *nu;                /* [r] used up                              */
    jl_real *x;                 /* [n] predicted, then the estimate         */
    jl_real *S;                 /* [r] diagonal of V V', 0 before           */
};

/* Begin with U_R; the rows r .. are the caller's to fill. */
void jli_array_start(struct jli_array *a, jl_real *A, const jl_real *UR,
                     int n, int r, int rows);

/* Where L M' [n] of a row is, while done = 0. */
jl_real *jli_array_row(const struct jli_array *a, int row);

/* Products L M' [rows,n], a row every `width` reals; L [rows,inner],
 * M [n,inner], in matrices with rows of lw, mw. */
void jli_array_products(jl_real *out, int width, const jl_real *L, int lw,
                        const jl_real *M, int mw, int rows, int n, int inner);

/* L M' H' of all rows that have L M'.
 * Returns JL_OK, JL_ENONFINITE (of what there is then). */
int jli_array_sense(struct jli_array *a, const jl_real *H);

/* The next `count` rows of the triangle, which stay the first of a->A, of
 * rows of r + n - done; what is left follows them, and a->done is as before.
 *     x += W' V^-1 nu, W = V^-1 H Pp,
 * as far as these rows are of V: what the array does with a last row
 * [-nu' | x'], by Gauss (Faddeev).  A singular V shows by what rounding leaves
 * of its diagonal.
 * Returns JL_OK, JL_ENONFINITE, JL_ESINGULAR: of the first row that has it. */
int jli_array_triangle(struct jli_array *a, int count, struct jli_feed *feed);

/* Those of the first `count` rows of a->A that are U's, into U [n,n]. */
void jli_array_take(jl_real *U, const struct jli_array *a, int count);

#endif
