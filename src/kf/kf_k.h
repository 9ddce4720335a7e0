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

/* P- = F U + W, the upper triangle */
#define JLI_SPREAD(type, width, end) \
    for (; j < end; j += width) \
        for (i = 0; i < j + width; i++) { \
            const int at = i / b * b; \
            type s = *(const type *)(W + i * n + j); \
            for (k = at; k < at + b; k++) \
                s += F[i * n + k] * *(const type *)(U + k * n + j); \
            *(type *)(Pp + i * n + j) = s; \
            sum->of_##type += s * s; \
        }

JL_INLINE void jli_kf_spread(jl_real *JL_RESTRICT Pp, const jl_real *F,
                             const jl_real *U, const jl_real *W,
                             struct jli_squares *sum, int n, int b)
{
    int i, j = 0, k;

    JLI_BY_LANES(JLI_SPREAD, n)
}

/* P- = F U + W, and the check of (x-, P-) */
JL_INLINE int jli_kf_predicted(const jl_real *xp, jl_real *Pp,
                               const jl_real *F, const jl_real *U,
                               const jl_real *W, int n, int b)
{
    struct jli_squares sum = { 0 };

    jli_square(&sum, xp, n);
    jli_kf_spread(Pp, F, U, W, &sum, n, b);
    jli_mirror(Pp, n);
    return jli_estimate_ok(&sum, xp, Pp, n) ? JL_OK : JL_ENONFINITE;
}

/* x- = f(x) + u, P- = F (P F') + W.  If F couples only the states of blocks of
 * b < n, zeros are left out: P F' as (F P)', since P is symmetric to the bit.
 * (Each branch to its end: what is common would find P- only in memory.)
 * scratch [3 n n + 3 n] */
JL_INLINE int jli_kf_predict(jl_real *xp, jl_real *Pp, const jl_mode *mode,
                             const jl_real *x, const jl_real *P,
                             jl_real *scratch, int n, int b)
{
    const jl_real *F = mode->F;
    jl_real *T = scratch + n * n, *U = T + n * n;
    int i, status;

    if (mode->move == NULL && mode->block == b && b > 0 && b < n) {
        for (i = 0; i < n; i++) {
            const int at = i / b * b;

            jli_apply(xp + i, F + i * n + at, x + at, mode->u + i, 1, b);
            jli_row(T + i * n, NULL, JLI_PRODUCT, F + i * n + at, 1,
                    P + at * n, b, n);
        }
        jli_transpose(U, T, n, n);
        return jli_kf_predicted(xp, Pp, F, U, mode->W, n, b);
    }
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
    return jli_kf_predicted(xp, Pp, F, U, mode->W, n, n);
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

/* What an update knows of H: that it picks states 0, e, 2 e, .. if e > 0. */
struct jli_sensor {
    const jl_real *H;
    int picks;
};

/* nu = z - h(x-), and the H to go with it: the mode's, or a Jacobian in
 * scratch [m n + n + 2 m]. */
JL_INLINE int jli_kf_sense(jl_real *nu, struct jli_sensor *sensor,
                           const jl_mode *mode, const jl_real *xp,
                           const jl_real *z, jl_real *scratch, int n, int m,
                           int e)
{
    int a;

    sensor->picks = mode->sense == NULL && mode->every == e && e > 0;
    sensor->H = mode->sense == NULL ? mode->H : scratch;
    if (!jli_vector_ok(z, m))
        return JL_ENONFINITE;
    if (sensor->picks) {
        for (a = 0; a < m; a++)
            nu[a] = z[a] - xp[a * e];
        return JL_OK;
    }
    if (mode->sense != NULL)
        return mode->sense(nu, scratch, mode, z, xp, scratch + m * n);
    jli_apply(nu, mode->H, xp, NULL, m, n);
    for (a = 0; a < m; a++)
        nu[a] = z[a] - nu[a];
    return JL_OK;
}

JL_INLINE int jli_normal(jl_real x)
{
    return x >= JL_REAL_MIN && x <= JL_REAL_MAX;
}

/* sum log d_a of normal d_a: one logarithm, of the product, unless that leaves
 * the range in which numbers have all digits. */
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
 * from Z = H P- and the lower triangle of S; scratch [m] */
JL_INLINE int jli_kf_solve(jl_real *Z, jl_real *K, jl_real *y, jl_real *S,
                           jl_real *d, jl_innovation *innovation,
                           jl_real *scratch, int n, int m)
{
    jl_real *r = scratch, nis = 0;
    int a, status = jli_ldl(S, d, r, m);

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

/* ... and from P-; each branch to its end, as above. */
JL_INLINE int jli_kf_innovate(jl_real *Z, jl_real *K, jl_real *y, jl_real *S,
                              jl_real *d, jl_innovation *innovation,
                              const struct jli_sensor *sensor,
                              const jl_real *R, const jl_real *Pp,
                              jl_real *scratch, int n, int m, int e)
{
    int a, b;

    if (!sensor->picks) {
        jli_mul(Z, sensor->H, Pp, m, n, n);
        jli_mul_t_sym(S, Z, sensor->H, R, m, n);
        return jli_kf_solve(Z, K, y, S, d, innovation, scratch, n, m);
    }
    for (a = 0; a < m; a++) {
        const jl_real *row = Pp + a * e * n;

        jli_move(Z + a * n, row, 1, n);
        for (b = 0; b <= a; b++)
            S[a * m + b] = row[b * e] + R[a * m + b];
    }
    return jli_kf_solve(Z, K, y, S, d, innovation, scratch, n, m);
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
                                   jl_real *scratch, int n, int m, int e)
{
    struct jli_sensor sensor;
    jl_real *K = scratch, *Z = K + m * n, *S = Z + m * n, *y = S + m * m;
    jl_real *d = y + m, *r = d + m, *A = r + m, *U = A + n * n;
    jl_real *Q = U + n * n, *RK = Z;
    struct jli_squares sum = { 0 };
    int i, j, ok, status;

    status = jli_kf_sense(innovation->nu, &sensor, mode, xp, z, U, n, m, e);
    if (status == JL_OK)
        status = jli_kf_innovate(Z, K, y, S, d, innovation, &sensor, mode->R,
                                 Pp, r, n, m, e);
    if (status != JL_OK)
        return status;
    jli_row(x, xp, JLI_PLUS, y, 1, K, m, n);
    jli_square(&sum, x, n);
    jli_unit_t_solve(S, K, m, n);               /* now the gain, transposed */
    for (i = 0; i < n; i++)                     /* A = (I - K H)'           */
        for (j = 0; j < n; j++)
            A[i * n + j] = (jl_real)(i == j);
    jli_product(A, A, JLI_MINUS, sensor.H, 1, n, K, 0, NULL, n, m, n);
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
                                     jl_real *scratch, int n, int m, int e)
{
    struct jli_sensor sensor;
    jl_real *Z = scratch, *K = Z + m * n, *S = K + m * n, *y = S + m * m;
    jl_real *d = y + m, *rest = d + m;
    struct jli_squares sum = { 0 };
    int ok, status;

    status = jli_kf_sense(innovation->nu, &sensor, mode, xp, z, rest, n, m,
                          e);
    if (status == JL_OK)
        status = jli_kf_innovate(Z, K, y, S, d, innovation, &sensor, mode->R,
                                 Pp, rest + m * n, n, m, e);
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
