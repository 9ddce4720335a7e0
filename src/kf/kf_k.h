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

/* x- = f(x) + u, P- = F P F' + W; scratch [2 n n + 3 n] */
JL_INLINE int jli_kf_predict(jl_real *xp, jl_real *Pp, const jl_mode *mode,
                             const jl_real *x, const jl_real *P,
                             jl_real *scratch, int n)
{
    const jl_real *F = mode->F;
    jl_real *T = scratch + n * n;
    int status;

    if (mode->move != NULL) {
        F = scratch;
        status = mode->move(xp, scratch, mode, x, T);
        if (status != JL_OK)
            return status;
    } else {
        jli_apply(xp, F, x, mode->u, n, n);
    }
    jli_mul(T, F, P, n, n, n);
    jli_mul_t_sym(Pp, T, F, mode->W, n, n);
    return jli_estimate_ok(xp, Pp, n) ? JL_OK : JL_ENONFINITE;
}

/* nu = z - h(x-), and the H to go with it: the mode's, or a Jacobian in
 * scratch [m n + n + 2 m]. */
JL_INLINE int jli_kf_sense(jl_real *nu, const jl_real **H,
                           const jl_mode *mode, const jl_real *xp,
                           const jl_real *z, jl_real *scratch, int n, int m)
{
    int a;

    if (!jl_vec_within(z, m, JL_LARGE))
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

/* What the forms of the update share, all from the factor S = L L':
 *     HP  [m,n]  H P-
 *     L   [m,m]
 *     y   [m]    L^-1 nu, of the innovation's nu
 *     loglik = -(m log 2 pi + log det S + y'y) / 2 */
JL_INLINE int jli_kf_innovate(jl_real *HP, jl_real *L, jl_real *y,
                              jl_innovation *innovation, const jl_real *H,
                              const jl_real *R, const jl_real *Pp,
                              int n, int m)
{
    jl_real twice = (jl_real)m * JLI_LOG_2PI;
    int a;

    jli_mul(HP, H, Pp, m, n, n);
    jli_mul_t_sym(L, HP, H, R, m, n);
    if (!jl_vec_within(L, m * m, JL_REAL_MAX))
        return JL_ENONFINITE;
    if (jli_cholesky(L, L, m) != JL_OK)
        return JL_ESINGULAR;
    jli_copy(y, innovation->nu, m);
    jli_lower_solve(L, y, m, 1);
    innovation->nis = 0;
    for (a = 0; a < m; a++) {
        innovation->nis += y[a] * y[a];
        twice += 2 * jl_log(L[a * m + a]);
    }
    twice += innovation->nis;
    innovation->loglik = -twice / 2;
    return jli_finite(twice) ? JL_OK : JL_ENONFINITE;
}

/* x = x- + K nu, P = (I - K H) P- (I - K H)' + K R K'
 * scratch [2 n n + 3 n m + m m + 3 m + n] */
JL_INLINE int jli_kf_update_joseph(jl_real *x, jl_real *P,
                                   jl_innovation *innovation,
                                   const jl_mode *mode, const jl_real *xp,
                                   const jl_real *Pp, const jl_real *z,
                                   jl_real *scratch, int n, int m)
{
    const jl_real *H;
    jl_real *HP = scratch, *K = HP + m * n, *L = K + n * m, *y = L + m * m;
    jl_real *A = y + m, *T = A + n * n;
    int i, j, a, b, status;

    status = jli_kf_sense(innovation->nu, &H, mode, xp, z, T + n * n, n, m);
    if (status == JL_OK)
        status = jli_kf_innovate(HP, L, y, innovation, H, mode->R, Pp, n, m);
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
    jli_mul(A, K, H, n, m, n);
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
 * scratch [2 n m + m m + 3 m + n] */
JL_INLINE int jli_kf_update_standard(jl_real *x, jl_real *P,
                                     jl_innovation *innovation,
                                     const jl_mode *mode, const jl_real *xp,
                                     const jl_real *Pp, const jl_real *z,
                                     jl_real *scratch, int n, int m)
{
    const jl_real *H;
    jl_real *Y = scratch, *L = Y + m * n, *y = L + m * m;
    int i, j, a, status;

    status = jli_kf_sense(innovation->nu, &H, mode, xp, z, y + m, n, m);
    if (status == JL_OK)
        status = jli_kf_innovate(Y, L, y, innovation, H, mode->R, Pp, n, m);
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
