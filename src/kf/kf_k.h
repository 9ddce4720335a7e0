/* Kernels of the Kalman filter, written once, with the sizes as last
 * arguments. */
#ifndef JL_KF_K_H
#define JL_KF_K_H

#include "jumplink/kf.h"

#include "mat/mat_k.h"

#define JLI_LOG_2PI JL_C(1.8378770664093454836)

JL_INLINE int jli_estimate_ok(const jl_real *x, const jl_real *P, int n)
{
    return jl_vec_within(x, n, JL_LARGE)
        && jl_vec_within(P, n * n, JL_LARGE * JL_LARGE);
}

/* x- = F x + u, P- = F P F' + W; scratch [n,n] */
JL_INLINE int jli_kf_predict(jl_real *xp, jl_real *Pp, const jl_mode *mode,
                             const jl_real *x, const jl_real *P,
                             jl_real *scratch, int n)
{
    jli_apply(xp, mode->F, x, mode->u, n, n);
    jli_mul(scratch, mode->F, P, n, n, n);
    jli_mul_t_sym(Pp, scratch, mode->F, mode->W, n, n);
    return jli_estimate_ok(xp, Pp, n) ? JL_OK : JL_ENONFINITE;
}

/* What the forms of the update share, all from the factor S = L L':
 *     HP  [m,n]  H P-
 *     L   [m,m]
 *     y   [m]    L^-1 nu
 *     *loglik    log N(nu; 0, S) = -(m log 2 pi + log det S + y'y) / 2 */
JL_INLINE int jli_kf_innovate(jl_real *HP, jl_real *L, jl_real *y,
                              jl_real *loglik, const jl_mode *mode,
                              const jl_real *xp, const jl_real *Pp,
                              const jl_real *z, int n, int m)
{
    jl_real twice = (jl_real)m * JLI_LOG_2PI;
    int a;

    if (!jl_vec_within(z, m, JL_LARGE))
        return JL_ENONFINITE;
    jli_mul(HP, mode->H, Pp, m, n, n);
    jli_mul_t_sym(L, HP, mode->H, mode->R, m, n);
    if (!jl_vec_within(L, m * m, JL_REAL_MAX))
        return JL_ENONFINITE;
    if (jli_cholesky(L, L, m) != JL_OK)
        return JL_ESINGULAR;
    jli_apply(y, mode->H, xp, NULL, m, n);
    for (a = 0; a < m; a++)
        y[a] = z[a] - y[a];
    jli_lower_solve(L, y, m, 1);
    for (a = 0; a < m; a++)
        twice += y[a] * y[a] + 2 * jl_log(L[a * m + a]);
    *loglik = -twice / 2;
    return jli_finite(twice) ? JL_OK : JL_ENONFINITE;
}

/* x = x- + K nu, P = (I - K H) P- (I - K H)' + K R K'
 * scratch [2 n n + 2 n m + m m + m] */
JL_INLINE int jli_kf_update_joseph(jl_real *x, jl_real *P, jl_real *loglik,
                                   const jl_mode *mode, const jl_real *xp,
                                   const jl_real *Pp, const jl_real *z,
                                   jl_real *scratch, int n, int m)
{
    jl_real *HP = scratch, *K = HP + m * n, *L = K + n * m, *y = L + m * m;
    jl_real *A = y + m, *T = A + n * n;
    int i, j, a, b, status;

    status = jli_kf_innovate(HP, L, y, loglik, mode, xp, Pp, z, n, m);
    if (status != JL_OK)
        return status;
    jli_lower_solve(L, HP, m, n);               /* L^-1 H P-                */
    for (i = 0; i < n; i++) {
        jl_real s = 0;

        for (a = 0; a < m; a++)
            s += HP[a * n + i] * y[a];
        x[i] = xp[i] + s;
    }
    jli_lower_t_solve(L, HP, m, n);             /* K' = S^-1 H P-           */
    for (i = 0; i < n; i++)
        for (a = 0; a < m; a++)
            K[i * m + a] = HP[a * n + i];
    jli_mul(A, K, mode->H, n, m, n);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            A[i * n + j] = (jl_real)(i == j) - A[i * n + j];
    jli_mul(T, A, Pp, n, n, n);
    jli_mul(HP, K, mode->R, n, m, m);           /* K R [n,m]                */
    for (i = 0; i < n; i++)
        for (j = i; j < n; j++) {
            jl_real s = 0, r = 0;

            for (a = 0; a < n; a++)
                s += T[i * n + a] * A[j * n + a];
            for (b = 0; b < m; b++)
                r += HP[i * m + b] * K[j * m + b];
            P[i * n + j] = s + r;
            P[j * n + i] = s + r;
        }
    return jli_estimate_ok(x, P, n) ? JL_OK : JL_ENONFINITE;
}

/* With Y = L^-1 H P-:  x = x- + Y'y, P = P- - Y'Y = P- - K S K'
 * scratch [n m + m m + m] */
JL_INLINE int jli_kf_update_standard(jl_real *x, jl_real *P, jl_real *loglik,
                                     const jl_mode *mode, const jl_real *xp,
                                     const jl_real *Pp, const jl_real *z,
                                     jl_real *scratch, int n, int m)
{
    jl_real *Y = scratch, *L = Y + m * n, *y = L + m * m;
    int i, j, a, status;

    status = jli_kf_innovate(Y, L, y, loglik, mode, xp, Pp, z, n, m);
    if (status != JL_OK)
        return status;
    jli_lower_solve(L, Y, m, n);
    for (i = 0; i < n; i++) {
        jl_real s = 0;

        for (a = 0; a < m; a++)
            s += Y[a * n + i] * y[a];
        x[i] = xp[i] + s;
        for (j = i; j < n; j++) {
            s = 0;
            for (a = 0; a < m; a++)
                s += Y[a * n + i] * Y[a * n + j];
            P[i * n + j] = Pp[i * n + j] - s;
            P[j * n + i] = P[i * n + j];
        }
    }
    return jli_estimate_ok(x, P, n) ? JL_OK : JL_ENONFINITE;
}

#endif
