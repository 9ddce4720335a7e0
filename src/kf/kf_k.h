/* Kernels of the Kalman filter, written once, with the sizes as last
 * arguments. */
#ifndef JL_KF_K_H
#define JL_KF_K_H

#include "jumplink/kf.h"

#include "mat/mat_k.h"

#define JLI_LOG_2PI JL_C(1.8378770664093454836)

#define JLI_SQUARES(type, width, end) \
    for (; i < end; i += width) \
        sum->of_##type += *(const type *)(v + i) * *(const type *)(v + i);

JL_INLINE void jli_square(struct jli_squares *sum, const jl_real *v, int n)
{
    int i = 0;

    JLI_BY_LANES(JLI_SQUARES, n)
}

JL_INLINE jl_real jli_square_sum(const struct jli_squares *sum)
{
    jl_real s = sum->of_jl_real;
    int i;

    for (i = 0; i < JLI_PACK; i++)
        s += JLI_LANE(sum->of_jli_pack, i);
    for (i = 0; i < JLI_WIDE; i++)
        s += JLI_LANE(sum->of_jli_wide, i);
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

/* x- = f(x) + u, P- = F (P F') + W; scratch [3 n n + 3 n] */
JL_INLINE int jli_kf_predict(jl_real *xp, jl_real *Pp, const jl_mode *mode,
                             const jl_real *x, const jl_real *P,
                             jl_real *scratch, int n)
{
    const jl_real *F = mode->F;
    jl_real *T = scratch + n * n, *U = T + n * n;
    struct jli_squares sum = { 0 };
    int i, status;

    if (mode->move != NULL) {
        F = scratch;
        status = mode->move(xp, scratch, mode, x, T);
        if (status != JL_OK)
            return status;
    }
    jli_transpose(T, F, n, n);
    if (mode->move == NULL) {           /* u last, as jl_mode_move adds it */
        jli_row(xp, NULL, JLI_PRODUCT, x, 1, T, n, n);
        for (i = 0; i < n; i++)
            xp[i] += mode->u[i];
    }
    jli_mul(U, P, T, n, n, n);
    jli_square(&sum, xp, n);
    jli_product(Pp, mode->W, JLI_PLUS, F, n, 1, U, 1, &sum, n, n, n);
    jli_mirror(Pp, n);
    return jli_estimate_ok(&sum, xp, Pp, n) ? JL_OK : JL_ENONFINITE;
}

/* The same for a vector. */
JL_INLINE int jli_vector_ok(const jl_real *v, int n)
{
    jl_real sum = 0;
    int i;

    for (i = 0; i < n; i++)
        sum += v[i] * v[i];
    return sum <= JL_LARGE * JL_LARGE || jl_vec_within(v, n, JL_LARGE);
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

/* sum log d_a of normal d_a: one logarithm, of the product, unless that leaves the range in
 * which numbers have all digits. */
JL_INLINE jl_real jli_log_product(const jl_real *d, int m)
{
    jl_real product = d[0], sum = 0;
    int a;

    for (a = 1; a < m; a++) {
        product *= d[a];
        if (!jli_normal(product))
            break;
    }
    if (a == m)
        return jl_log(product);
    for (a = 0; a < m; a++)
        sum += jl_log(d[a]);
    return sum;
}

/* What the forms of the update share, all from S = H P- H' + R = L D L':
 *     Z  [m,n]   L^-1 H P-
 *     K  [m,n]   D^-1 Z: x = x- + K'y, and P- - K'Z is P- - K S K' (standard)
 *     y  [m]     L^-1 nu
 *     S  [m,m]   L below the diagonal
 *     d  [m]     D
 *     nis = y' D^-1 y
 * scratch [m] */
JL_INLINE int jli_kf_innovate(jl_real *Z, jl_real *K, jl_real *y, jl_real *S,
                              jl_real *d, jl_innovation *innovation,
                              const jl_real *H, const jl_real *R,
                              const jl_real *Pp, jl_real *scratch, int n,
                              int m)
{
    jl_real *r = scratch, nis = 0;
    int a, status;

    jli_mul(Z, H, Pp, m, n, n);
    jli_mul_t_sym(S, Z, H, R, m, n);
    status = jli_ldl(S, d, r, m);
    if (status != JL_OK)
        return status == JL_EDEF ? JL_ESINGULAR : status;
    for (a = 0; a < m; a++)
        y[a] = innovation->nu[a];
    jli_unit_solve(S, Z, m, n);
    jli_unit_solve(S, y, m, 1);
    for (a = 0; a < m; a++) {
        jli_scale(K + a * n, r[a], Z + a * n, n);
        nis += y[a] * (y[a] * r[a]);
    }
    innovation->nis = nis;
    return JL_OK;
}

/* The end of an update: loglik = -(m log 2 pi + log det D + nis) / 2. */
JL_INLINE int jli_kf_likelihood(jl_innovation *innovation, const jl_real *d,
                                int m)
{
    jl_real twice = (jl_real)m * JLI_LOG_2PI + jli_log_product(d, m)
        + innovation->nis;

    innovation->loglik = -twice / 2;
    return jli_finite(twice) ? JL_OK : JL_ENONFINITE;
}

/* x = x- + K nu, P = (I - K H) P- (I - K H)' + K R K'
 * scratch [3 n n + 3 n m + m m + 5 m + n] */
JL_INLINE int jli_kf_update_joseph(jl_real *x, jl_real *P,
                                   jl_innovation *innovation,
                                   const jl_mode *mode, const jl_real *xp,
                                   const jl_real *Pp, const jl_real *z,
                                   jl_real *scratch, int n, int m)
{
    const jl_real *H;
    jl_real *K = scratch, *Z = K + m * n, *S = Z + m * n, *y = S + m * m;
    jl_real *d = y + m, *r = d + m, *A = r + m, *U = A + n * n;
    jl_real *Q = U + n * n, *RK = Z;
    struct jli_squares sum = { 0 };
    int i, j, ok, status;

    status = jli_kf_sense(innovation->nu, &H, mode, xp, z, U, n, m);
    if (status == JL_OK)
        status = jli_kf_innovate(Z, K, y, S, d, innovation, H, mode->R, Pp,
                                 r, n, m);
    if (status != JL_OK)
        return status;
    jli_row(x, xp, JLI_PLUS, y, 1, K, m, n);
    jli_square(&sum, x, n);
    jli_unit_t_solve(S, K, m, n);               /* now the gain, transposed */
    for (i = 0; i < n; i++)                     /* A = (I - K H)'           */
        for (j = 0; j < n; j++)
            A[i * n + j] = (jl_real)(i == j);
    jli_product(A, A, JLI_MINUS, H, 1, n, K, 0, NULL, n, m, n);
    jli_mul(RK, mode->R, K, m, m, n);
    jli_product(Q, NULL, JLI_PRODUCT, K, 1, n, RK, 1, NULL, n, m, n);
    jli_mul(U, Pp, A, n, n, n);
    jli_product(P, Q, JLI_PLUS, A, 1, n, U, 1, &sum, n, n, n);
    jli_mirror(P, n);
    ok = jli_estimate_ok(&sum, x, P, n);
    status = jli_kf_likelihood(innovation, d, m);
    return ok ? status : JL_ENONFINITE;
}

/* x = x- + K nu, P = P- - K S K'
 * scratch [3 n m + m m + 4 m + n] */
JL_INLINE int jli_kf_update_standard(jl_real *x, jl_real *P,
                                     jl_innovation *innovation,
                                     const jl_mode *mode, const jl_real *xp,
                                     const jl_real *Pp, const jl_real *z,
                                     jl_real *scratch, int n, int m)
{
    const jl_real *H;
    jl_real *Z = scratch, *K = Z + m * n, *S = K + m * n, *y = S + m * m;
    jl_real *d = y + m, *rest = d + m;
    struct jli_squares sum = { 0 };
    int ok, status;

    status = jli_kf_sense(innovation->nu, &H, mode, xp, z, rest, n, m);
    if (status == JL_OK)
        status = jli_kf_innovate(Z, K, y, S, d, innovation, H, mode->R, Pp,
                                 rest + m * n, n, m);
    if (status != JL_OK)
        return status;
    jli_row(x, xp, JLI_PLUS, y, 1, K, m, n);
    jli_square(&sum, x, n);
    jli_product(P, Pp, JLI_MINUS, Z, 1, n, K, 1, &sum, n, m, n);
    jli_mirror(P, n);
    ok = jli_estimate_ok(&sum, x, P, n);
    status = jli_kf_likelihood(innovation, d, m);
    return ok ? status : JL_ENONFINITE;
}

#endif
