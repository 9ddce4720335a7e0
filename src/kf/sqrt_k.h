/* Kernels of the Kalman filter that keeps a factor S of P = U' D U (mat.h),
 * written once, with the sizes as last arguments. */
#ifndef JL_SQRT_K_H
#define JL_SQRT_K_H

#include "kf/kf_k.h"
#include "mat/ud_k.h"

/* 1 if x and the variances that S stands for are within bounds; they are if the
 * sum of all is, as nearly always (NaN is not). */
JL_INLINE int jli_factor_ok(const jl_real *x, const jl_real *S, int n)
{
    jl_real sum = 0;
    int j, k;

    for (k = 0; k < n; k++) {
        jl_real squares = 1;

        for (j = k + 1; j < n; j++)
            squares += S[k * n + j] * S[k * n + j];
        sum += S[k * (n + 1)] * squares + x[k] * x[k];
    }
    if (sum <= JL_LARGE * JL_LARGE / 2)
        return 1;
    for (j = 0; j < n; j++) {
        jl_real variance = S[j * (n + 1)];

        for (k = 0; k < j; k++)
            variance += S[k * n + k] * S[k * n + j] * S[k * n + j];
        if (!(variance <= JL_LARGE * JL_LARGE))         /* false for NaN */
            return 0;
    }
    return jl_vec_within(x, n, JL_LARGE);
}

/* x- = f(x) + u; P- is the sum over the rows of U F', with weights D, and those
 * of the noises.  From the first row on, for where F is triangular by blocks
 * (motions are), row k of U F' is zero up to its block and the triangle has no
 * row k yet: few rotations.  (Thornton 1976, Triangular Covariance
 * Factorizations for Kalman Filtering, by Gram-Schmidt.)
 * scratch [n n + 3 n] */
JL_INLINE int jli_sqrt_predict(jl_real *xp, jl_real *Sp, const jl_mode *mode,
                               const jl_real *x, const jl_real *S,
                               jl_real *scratch, int n, int b)
{
    const jl_real *F = mode->F;
    jl_real *v = scratch + n * n;
    int i, j, k, status;

    (void)b;
    if (mode->move != NULL) {
        F = scratch;
        status = mode->move(xp, scratch, mode, x, v);
        if (status != JL_OK)
            return status;
    } else {
        jli_apply(xp, F, x, mode->u, n, n);
    }
    memset(Sp, 0, (size_t)(n * n) * sizeof *Sp);
    for (k = 0; k < n; k++) {
        const jl_real *U = S + k * n;

        for (i = 0; i < n; i++) {
            v[i] = F[i * n + k];
            for (j = k + 1; j < n; j++)
                v[i] += U[j] * F[i * n + j];
        }
        jli_ud_absorb(Sp, v, U[k], 0, n);
    }
    for (k = 0; k < mode->p; k++) {
        jli_copy(v, mode->N + k * n, n);
        jli_ud_absorb(Sp, v, mode->q[k], 0, n);
    }
    return jli_factor_ok(xp, Sp, n) ? JL_OK : JL_ENONFINITE;
}

/* Make component a of a measurement independent of those before: with
 * R = T D T' (T the transpose of V's U) the errors of T^-1 z have variances D. */
JL_INLINE void jli_whiten(jl_real *H, jl_real *nu, const jl_real *V, int a,
                          int n, int m)
{
    int b, i;

    for (b = 0; b < a; b++) {
        jl_real t = V[b * m + a];

        for (i = 0; i < n; i++)
            H[a * n + i] -= t * H[b * n + i];
        nu[a] -= t * nu[b];
    }
}

/* One scalar measurement after the other.  (The rotations of the rows [R | 0]
 * and [U H' | U] come to the same, with a multiplication more.)
 * scratch [2 n m + 3 m + 2 n] */
JL_INLINE int jli_sqrt_update(jl_real *x, jl_real *S,
                              jl_innovation *innovation, const jl_mode *mode,
                              const jl_real *xp, const jl_real *Sp,
                              const jl_real *z, jl_real *scratch, int n, int m,
                              int e)
{
    struct jli_sensor sensor;
    jl_real *H = scratch, *y = H + m * n, *K = y + m;
    jl_real *alphas = K + n;
    int i, a, status;

    status = jli_kf_sense(innovation->nu, &sensor, mode, xp, z, K + n, n, m,
                          e);
    if (status != JL_OK)
        return status;
    jli_copy(H, sensor.H, m * n);
    jli_copy(y, innovation->nu, m);
    jli_copy(x, xp, n);
    jli_copy(S, Sp, n * n);
    innovation->nis = 0;
    for (a = 0; a < m; a++) {
        const jl_real *h = H + a * n;
        jl_real alpha, nu;

        jli_whiten(H, y, mode->V, a, n, m);
        nu = y[a];
        for (i = 0; i < n; i++)
            nu -= h[i] * (x[i] - xp[i]);
        alpha = jli_ud_observe(S, K, h, mode->V[a * m + a], n);
        if (!(alpha > 0))
            return alpha <= 0 ? JL_ESINGULAR : JL_ENONFINITE;
        for (i = 0; i < n; i++)
            x[i] += K[i] * (nu / alpha);
        innovation->nis += nu * nu / alpha;
        alphas[a] = alpha;
    }
    status = jli_kf_likelihood(innovation, alphas, m);
    return jli_factor_ok(x, S, n) ? status : JL_ENONFINITE;
}

#endif
