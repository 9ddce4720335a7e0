/* Dense matrices of run-time size.
 *
 * A matrix is a row-major array: A [n,m] has element (i,j) at A[i*m + j].  The
 * destination comes first; it must not overlap an operand unless it is said
 * to.  Sizes are >= 1.  Sums run in index order, so results have the same bits
 * everywhere.  A symmetric result is made symmetric exactly: its upper triangle
 * is computed and mirrored.  Nothing here fails unless it returns a code.
 */
#ifndef JL_MAT_H
#define JL_MAT_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- products; cost in multiplications --------------------------------- */

/* C = A B           C [n,p]  A [n,m]  B [m,p]                       n m p  */
void jl_mat_mul(jl_real *C, const jl_real *A, const jl_real *B,
                int n, int m, int p);

/* C = A B'          C [n,p]  A [n,m]  B [p,m]                       n m p  */
void jl_mat_mul_t(jl_real *C, const jl_real *A, const jl_real *B,
                  int n, int m, int p);

/* C = A P A' + Q    C [n,n]  A [n,m]  P [m,m] symmetric, Q [n,n] or NULL
 * work [n,m].  C may be Q.                             n m m + n (n+1)/2 m */
void jl_mat_sandwich(jl_real *C, const jl_real *A, const jl_real *P,
                     const jl_real *Q, jl_real *work, int n, int m);

/* y = A x + b       y [n]  A [n,m]  x [m]  b [n] or NULL; y may be b   n m */
void jl_mat_apply(jl_real *y, const jl_real *A, const jl_real *x,
                  const jl_real *b, int n, int m);

/* --- triangular -------------------------------------------------------- */

/* A = L L' by Cholesky: L [n,n] lower, zeros above; A [n,n] symmetric, of
 * which the lower triangle is read.  L may be A.                    n^3/6
 * Returns JL_OK, or JL_EDEF if A is not positive definite or not finite
 * (*L is then undefined). */
int jl_mat_cholesky(jl_real *L, const jl_real *A, int n);

/* Solve L L' X = B in place: X [n,m] holds B before and X after.   n n m  */
void jl_mat_cholesky_solve(const jl_real *L, jl_real *X, int n, int m);

/* Solve L y = b in place: y [n] holds b before and y after.       n n / 2  */
void jl_mat_lower_solve(const jl_real *L, jl_real *y, int n);

/* A = U' D U of a positive semidefinite A [n,n], of which the upper triangle is
 * read, by its largest pivots: U upper with a unit diagonal, D diagonal, >= 0.
 * In S [n,n]: U above the diagonal, D on it, zeros below.  What is left of A
 * when no pivot is above 64 n eps, scaled to a unit diagonal, is little more
 * than rounding: of it the variances are kept, not the covariances.  S may be
 * A.  work [n n + 2 n]                                      at most 2 n^3 */
void jl_mat_ud(jl_real *S, const jl_real *A, jl_real *work, int n);

/* P = U' D U from S, as above.  P may not be S.                    n^3/3  */
void jl_mat_ud_product(jl_real *P, const jl_real *S, int n);

/* A [rows,cols] to an upper triangle, in place, by Givens rotations from the
 * left: A becomes T A with T orthogonal, zeros below the diagonal, and the
 * diagonal >= 0; so A'A stays.  If A's columns are independent this is the only
 * such triangle.  Elements up to JL_LARGE; a NaN makes more of them.
 *                                           2 cols^2 (rows - cols / 3)      */
void jl_mat_givens(jl_real *A, int rows, int cols);

/* jl_mat_givens of fixed size, with the same bits, for the sizes that
 * givens_sizes.def lists: those of a pre-array of n + m states and parameters,
 * as many noises, r measurements are 2 (n + m) + r by n + m + r.  Else
 * jl_mat_givens. */
typedef void jl_givens(jl_real *A, int rows, int cols);
jl_givens *jl_mat_givens_fixed(int rows, int cols);

/* --- symmetric --------------------------------------------------------- */

/* Packed upper triangle, row by row: p [n(n+1)/2]. */
#define JL_PACKED(n) ((n) * ((n) + 1) / 2)
void jl_mat_pack(jl_real *p, const jl_real *A, int n);
void jl_mat_unpack(jl_real *A, const jl_real *p, int n);

/* --- questions --------------------------------------------------------- */

/* 1 if all n reals are finite and no larger than limit, else 0. */
int jl_vec_within(const jl_real *v, int n, jl_real limit);

/* Check a covariance A [n,n]: JL_OK, or the first of
 *     JL_ENONFINITE  an element is NaN, infinite or above JL_LARGE^2
 *     JL_EASYM       |A_ij - A_ji| > 64 eps sqrt(|A_ii| |A_jj|)
 *     JL_EDEF        not positive semidefinite beyond rounding: scaled to a
 *                    unit diagonal and eliminated by its largest pivots down
 *                    to 64 n eps, what is left is above twice that
 * work [n,n].                                                       n^3/3  */
int jl_mat_check_cov(const jl_real *A, jl_real *work, int n);

#ifdef __cplusplus
}
#endif
#endif
