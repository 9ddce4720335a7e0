/* Kernels of the Kalman filter, written once, with the sizes as last
 * arguments. */
#ifndef JL_KF_K_H
#define JL_KF_K_H

#include "jumplink/kf.h"

#include "mat/mat_k.h"

#define JLI_LOG_2PI JL_C(1.8378770664093454836)

/* A sum of squares, in any order, as it comes by rows. */
struct jli_squares {
    jli_wide wide;
    jli_pack pack;
    jl_real one;
};

#define JLI_SQUARES(type, width, sum) \
    for (; i + width <= n; i += width) \
        sum += *(const type *)(v + i) * *(const type *)(v + i);

JL_INLINE void jli_square(struct jli_squares *sum, const jl_real *v, int n)
{
    int i = 0;

    JLI_SQUARES(jli_wide, JLI_WIDE, sum->wide)
    JLI_SQUARES(jli_pack, JLI_PACK, sum->pack)
    JLI_SQUARES(jl_real, 1, sum->one)
}

JL_INLINE jl_real jli_square_sum(const struct jli_squares *sum)
{
    jl_real lane[JLI_WIDE + JLI_PACK], s = sum->one;
    int i;

    *(jli_wide *)lane = sum->wide;
    *(jli_pack *)(lane + JLI_WIDE) = sum->pack;
    for (i = 0; i < JLI_WIDE + JLI_PACK; i++)
        s += lane[i];
    return s;
}

/* Whether an estimate is finite and within JL_LARGE.  It is when the sum of all
 * its squares is within JL_LARGE^2, as nearly always: one look at each element,
 * and NaN does not pass. */
JL_INLINE int jli_estimate_ok(const struct jli_squares *sum, const jl_real *x,
                              const jl_real *P, int n)
{
    return jli_square_sum(sum) <= JL_LARGE * JL_LARGE
        || (jl_vec_within(x, n, JL_LARGE)
            && jl_vec_within(P, n * n, JL_LARGE * JL_LARGE));
}

/* C = A B + Q, known to be symmetric; A, B, Q [n,n] */
JL_INLINE void jli_mul_sym(jl_real *JL_RESTRICT C, struct jli_squares *sum,
                           const jl_real *JL_RESTRICT A,
                           const jl_real *JL_RESTRICT B,
                           const jl_real *JL_RESTRICT Q, int n)
{
    int i;

    for (i = 0; i < n; i++) {
        jli_row(C + i * n, Q + i * n, JLI_PLUS_ROW, A + i * n, 1, B, n, n);
        jli_square(sum, C + i * n, n);
    }
    jli_mirror(C, n);
}

/* x- = f(x) + u, P- = F (P F') + W; scratch [3 n n + 3 n] */
JL_INLINE int jli_kf_predict(jl_real *xp, jl_real *Pp, const jl_mode *mode,
                             const jl_real *x, const jl_real *P,
                             jl_real *scratch, int n)
{
    const jl_real *F = mode->F;
    jl_real *T = scratch + n * n, *U = T + n * n;
    struct jli_squares sum = { { 0 }, { 0 }, 0 };
    int status;

    if (mode->move != NULL) {
        F = scratch;
        status = mode->move(xp, scratch, mode, x, T);
        if (status != JL_OK)
            return status;
    }
    jli_transpose(T, F, n, n);
    if (mode->move == NULL)
        jli_row(xp, mode->u, JLI_PLUS_ROW, x, 1, T, n, n);
    jli_mul(U, P, T, n, n, n);
    jli_square(&sum, xp, n);
    jli_mul_sym(Pp, &sum, F, U, mode->W, n);
    return jli_estimate_ok(&sum, xp, Pp, n) ? JL_OK : JL_ENONFINITE;
}

JL_INLINE int jli_vector_ok(const jl_real *v, int n)
{
    int i, ok = 1;

    for (i = 0; i < n; i++)
        ok &= v[i] >= -JL_LARGE && v[i] <= JL_LARGE;    /* false for NaN */
    return ok;
}

/* nu = z - h(x-), and the H to go with it: the mode's, or a Jacobian in
 * scratch [m n + n + 2 m]. */
JL_INLINE int jli_kf_sense(jl_real *nu, const jl_real **H,
                           const jl_mode *mode, const jl_real *xp,
                           const jl_real *z, jl_real *scratch, int n, int m)
{
    int a;

    if (!jli_vector_ok(z, m))
        return JL_ENONFINITE;
    if (mode->sense != NULL) {
        *H = scratch;
        return mode->sense(nu, scratch, mode, z, xp, scratch + m * n);
    }
    *H = mode->H;
    jli_apply(nu, mode->H, xp, NULL, m, n);
    for (a = 0; a < m; a++)
        nu[a] = z[a] - nu[a];
    return JL_OK;
}

JL_INLINE int jli_normal(jl_real x)
{
    return x >= JL_REAL_MIN && x <= JL_REAL_MAX;
}

/* sum log d_a: one logarithm, of the product, unless that leaves the range in
 * which numbers have all digits. */
JL_INLINE jl_real jli_log_product(const jl_real *d, int m)
{
    jl_real product = d[0], sum = 0;
    int a;

    for (a = 1; a < m && jli_normal(product); a++)
        product *= d[a];
    if (jli_normal(product))
        return jl_log(product);
    for (a = 0; a < m; a++)
        sum += jl_log(d[a]);
    return sum;
}

/* What the forms of the update share, all from S = H P- H' + R = L D L':
 *     Y  [m,n]   D^-1/2 L^-1 H P-
 *     y  [m]     D^-1/2 L^-1 nu, of the innovation's nu
 *     S  [m,m]   L below the diagonal
 *     r  [m]     D^-1/2
 *     nis = y'y,  loglik = -(m log 2 pi + log det D + nis) / 2
 * scratch [m] */
JL_INLINE int jli_kf_innovate(jl_real *Y, jl_real *y, jl_real *S, jl_real *r,
                              jl_innovation *innovation, const jl_real *H,
                              const jl_real *R, const jl_real *Pp,
                              jl_real *d, int n, int m)
{
    jl_real twice = (jl_real)m * JLI_LOG_2PI, nis = 0;
    int a, b, k, j, status;

    jli_mul(Y, H, Pp, m, n, n);
    for (a = 0; a < m; a++)
        for (b = 0; b <= a; b++) {
            jl_real s = R[a * m + b];

            for (k = 0; k < n; k++)
                s += Y[a * n + k] * H[b * n + k];
            S[a * m + b] = s;
        }
    status = jli_ldl(S, d, r, m);
    if (status != JL_OK)
        return status == JL_EDEF ? JL_ESINGULAR : status;
    for (a = 0; a < m; a++)
        y[a] = innovation->nu[a];
    jli_unit_solve(S, Y, m, n);
    jli_unit_solve(S, y, m, 1);
    for (a = 0; a < m; a++) {
        r[a] *= jli_sqrt(d[a]);
        for (j = 0; j < n; j++)
            Y[a * n + j] *= r[a];
        y[a] *= r[a];
        nis += y[a] * y[a];
    }
    twice += jli_log_product(d, m) + nis;
    innovation->nis = nis;
    innovation->loglik = -twice / 2;
    return jli_finite(twice) ? JL_OK : JL_ENONFINITE;
}

/* x = x- + K nu, P = (I - K H) P- (I - K H)' + K R K'
 * scratch [3 n n + 2 n m + m m + 3 m] */
JL_INLINE int jli_kf_update_joseph(jl_real *x, jl_real *P,
                                   jl_innovation *innovation,
                                   const jl_mode *mode, const jl_real *xp,
                                   const jl_real *Pp, const jl_real *z,
                                   jl_real *scratch, int n, int m)
{
    const jl_real *H;
    jl_real *K = scratch, *V = K + m * n, *S = V + m * n, *y = S + m * m;
    jl_real *r = y + m, *d = r + m, *A = d + m, *T = A + n * n;
    jl_real *U = T + n * n;
    struct jli_squares sum = { { 0 }, { 0 }, 0 };
    int i, j, a, status;

    status = jli_kf_sense(innovation->nu, &H, mode, xp, z, U, n, m);
    if (status == JL_OK)
        status = jli_kf_innovate(K, y, S, r, innovation, H, mode->R, Pp, d, n,
                                 m);
    if (status != JL_OK)
        return status;
    jli_row(x, xp, JLI_PLUS_ROW, y, 1, K, m, n);
    for (a = 0; a < m; a++)
        for (j = 0; j < n; j++)
            K[a * n + j] *= r[a];
    jli_unit_t_solve(S, K, m, n);               /* K' = S^-1 H P-           */
    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++)
            A[i * n + j] = (jl_real)(i == j);
        jli_row(A + i * n, A + i * n, JLI_MINUS_ROW, K + i, n, H, m, n);
    }
    jli_transpose(T, A, n, n);
    jli_mul(U, Pp, T, n, n, n);
    jli_mul(V, mode->R, K, m, m, n);            /* R K'                     */
    for (i = 0; i < n; i++)
        jli_row(T + i * n, NULL, JLI_ROW, K + i, n, V, m, n);
    jli_square(&sum, x, n);
    jli_mul_sym(P, &sum, A, U, T, n);
    return jli_estimate_ok(&sum, x, P, n) ? JL_OK : JL_ENONFINITE;
}

/* The same for P = P- - Y'Y of a P- that is within bounds.  Then its diagonal
 * tells: Y_i^2 <= P-_ii - P_ii in each of its columns i, and the other elements
 * of Y'Y are not larger than the greatest of the diagonal. */
JL_INLINE int jli_update_ok(const jl_real *x, const jl_real *P, int n)
{
    jl_real sum = 0;
    int i;

    for (i = 0; i < n; i++)
        sum += x[i] * x[i] + P[i * (n + 1)] * P[i * (n + 1)];
    return sum <= JL_LARGE * JL_LARGE
        || (jl_vec_within(x, n, JL_LARGE)
            && jl_vec_within(P, n * n, JL_LARGE * JL_LARGE));
}

/* x = x- + Y'y, P = P- - Y'Y, symmetric because its terms are
 * scratch [2 n m + m m + 4 m + n] */
JL_INLINE int jli_kf_update_standard(jl_real *x, jl_real *P,
                                     jl_innovation *innovation,
                                     const jl_mode *mode, const jl_real *xp,
                                     const jl_real *Pp, const jl_real *z,
                                     jl_real *scratch, int n, int m)
{
    const jl_real *H;
    jl_real *Y = scratch, *S = Y + m * n, *y = S + m * m, *r = y + m;
    jl_real *d = r + m;
    int i, status;

    status = jli_kf_sense(innovation->nu, &H, mode, xp, z, d + m, n, m);
    if (status == JL_OK)
        status = jli_kf_innovate(Y, y, S, r, innovation, H, mode->R, Pp, d, n,
                                 m);
    if (status != JL_OK)
        return status;
    jli_row(x, xp, JLI_PLUS_ROW, y, 1, Y, m, n);
    for (i = 0; i < n; i++)
        jli_row(P + i * n, Pp + i * n, JLI_MINUS_ROW, Y + i, n, Y, m, n);
    return jli_update_ok(x, P, n) ? JL_OK : JL_ENONFINITE;
}

#endif
