/* Who is timed by bench_givens: the triangle of an array, by different means. */
#ifndef GIVENS_H
#define GIVENS_H

#include "jumplink/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* R [cols,cols] of A [rows,cols], both row by row; signs as they come. */
typedef void givens_triangle(jl_real *R, const jl_real *A);

/* Eigen's HouseholderQR of fixed size, LAPACK's dgeqrf. */
givens_triangle givens_eigen_9_6, givens_eigen_9_9;
givens_triangle givens_lapack_9_6, givens_lapack_9_9;

#ifdef __cplusplus
}
#endif
#endif
