/* The form unscented, for any size: a function by its values at sigma points.
 *
 * The points about x are x and x +- c_k U_k, c_k^2 = (n + kappa) D_k: the rows
 * of P's factor, so no P is built and none decomposed.  (Julier, Uhlmann,
 * Durrant-Whyte 2000, IEEE Trans. Automatic Control 45, 477; kappa = 0 is the
 * cubature rule of Arasaratnam, Haykin 2009, same journal 54, 1254.)  Of the
 * values y0, y+, y- of a pair only a difference and a bend are needed:
 *     a_k   = y+ - y-,  b_k = y+ + y- - 2 y0
 *     shift = sum b_k / 2 (n + kappa)
 *     mean  = y0 + shift
 *     cov   = sum (a_k a_k' + (b_k - 2 shift)(b_k - 2 shift)') / 4 (n + kappa)
 *             + kappa / (n + kappa) shift shift'
 * which is the usual sum over points, each pair turned by 45 degrees: of a
 * linear function b_k is 0, and a_k = 2 c_k F U_k'.  Angles are safe, for only
 * differences from y0 are averaged.
 *
 * No weight is negative, so rows are only ever added to a factor, and nothing
 * can fail to be positive semidefinite.  That is why there is no alpha: the
 * usual 1e-3 puts the points within 1e-3 sigma, where the weights are -1e6 and
 * 1e6 / 2n, float differences have lost their digits, and a covariance is what
 * is left of 1e6 times itself. */
#include "kf/kf_form.h"
#include "kf/sqrt_k.h"

/* A function of a mode's, n states to m values. */
struct map {
    int (*of)(jl_real *y, const jl_real *x, void *context);
    void (*residual)(jl_real *d, const jl_real *a, const jl_real *b,
                     void *context);                    /* or NULL */
    void *context;
    jl_real kappa;
    int n, m;
};

/* y = f(x); what is not finite never reaches a factor. */
static int value(jl_real *y, const struct map *f, const jl_real *x)
{
    int status = f->of(y, x, f->context);

    if (status != JL_OK)
        return status;
    return jl_vec_within(y, f->m, JL_LARGE) ? JL_OK : JL_ENONFINITE;
}

/* y = y - y0 */
static int subtract(jl_real *y, const struct map *f, const jl_real *y0)
{
    int i;

    if (f->residual != NULL)
        f->residual(y, y, y0, f->context);
    else
        for (i = 0; i < f->m; i++)
            y[i] -= y0[i];
    return jl_vec_within(y, f->m, 2 * JL_LARGE) ? JL_OK : JL_ENONFINITE;
}

/* y = f(x + c U_k) - y0; at [n] work */
static int look(jl_real *y, const struct map *f, const jl_real *x, jl_real c,
                const jl_real *S, int k, const jl_real *y0, jl_real *at)
{
    int n = f->n, i, status;

    jli_copy(at, x, n);
    at[k] += c;
    for (i = k + 1; i < n; i++)
        at[i] += c * S[k * n + i];
    if (!jl_vec_within(at, n, JL_LARGE))
        return JL_ENONFINITE;
    status = value(y, f, at);
    return status == JL_OK ? subtract(y, f, y0) : status;
}

static jl_real reach(const struct map *f, jl_real variance)
{
    return jli_sqrt(((jl_real)f->n + f->kappa) * variance);
}

/* y0 [m], a [n,m], b [n,m] of f about x; rows of no variance are 0.
 * work [n] */
static int look_around(jl_real *y0, jl_real *a, jl_real *b,
                       const struct map *f, const jl_real *x,
                       const jl_real *S, jl_real *work)
{
    int n = f->n, m = f->m, i, k, status = value(y0, f, x);

    memset(a, 0, (size_t)(n * m) * sizeof *a);
    memset(b, 0, (size_t)(n * m) * sizeof *b);
    for (k = 0; k < n && status == JL_OK; k++, a += m, b += m) {
        jl_real c = reach(f, S[k * (n + 1)]);

        if (!(c > 0))
            continue;
        status = look(a, f, x, c, S, k, y0, work);
        if (status == JL_OK)
            status = look(b, f, x, -c, S, k, y0, work);
        for (i = 0; i < m; i++) {
            jl_real up = a[i], down = b[i];

            a[i] = up - down;
            b[i] = up + down;
        }
    }
    return status;
}

/* The shift [m] that the bends b [n,m] say; and what they add to a covariance
 * into its factor T [m,m].  b is overwritten. */
static void bend(jl_real *T, jl_real *shift, jl_real *b, const struct map *f)
{
    int n = f->n, m = f->m, i, k;
    jl_real w = 1 / (4 * ((jl_real)n + f->kappa));

    memset(shift, 0, (size_t)m * sizeof *shift);
    for (k = 0; k < n; k++)
        for (i = 0; i < m; i++)
            shift[i] += 2 * w * b[k * m + i];
    for (k = 0; k < n; k++) {
        for (i = 0; i < m; i++)
            b[k * m + i] -= 2 * shift[i];
        jli_ud_absorb(T, b + k * m, w, 0, m);
    }
    jli_copy(b, shift, m);
    jli_ud_absorb(T, b, 4 * f->kappa * w, 0, m);
}

/* --- predict ------------------------------------------------------------- */

/* scratch [2 n n + n] */
static int predict(jl_real *xp, jl_real *Sp, const jl_mode *mode,
                   const jl_real *x, const jl_real *S, jl_real *scratch,
                   int n, int block)
{
    const jl_nonlinear *nl = mode->nonlinear;
    int i, k, status;
    jl_real *a = scratch, *b = a + n * n, *shift = b + n * n;
    struct map f;

    if (nl == NULL || nl->f == NULL)
        return jli_sqrt_predict(xp, Sp, mode, x, S, scratch, n, block);
    f.of = nl->f;
    f.residual = NULL;
    f.context = nl->context;
    f.kappa = nl->kappa;
    f.n = f.m = n;
    status = look_around(xp, a, b, &f, x, S, shift);
    if (status != JL_OK)
        return status;
    memset(Sp, 0, (size_t)(n * n) * sizeof *Sp);
    for (k = 0; k < n; k++)
        jli_ud_absorb(Sp, a + k * n, 1 / (4 * ((jl_real)n + f.kappa)), 0, n);
    bend(Sp, shift, b, &f);
    for (k = 0; k < mode->p; k++) {
        jli_copy(a, mode->N + k * n, n);
        jli_ud_absorb(Sp, a, mode->q[k], 0, n);
    }
    for (i = 0; i < n; i++)
        xp[i] += shift[i] + mode->u[i];
    return jli_factor_ok(xp, Sp, n) ? JL_OK : JL_ENONFINITE;
}

/* --- update -------------------------------------------------------------- */

/* T [m+n,m+n] = the factor of the covariance of (z, x) together: of the rows
 * (a_k, 2 c_k U_k), and (V, 0) for what z has of its own.  From the last row
 * on, for then each finds its own row of T empty when its x-part is reached.
 * v [m+n] work */
static void join(jl_real *T, const jl_real *V, const jl_real *a,
                 const struct map *h, const jl_real *S, jl_real *v)
{
    int n = h->n, m = h->m, all = m + n, i, k;

    memset(T, 0, (size_t)(all * all) * sizeof *T);
    for (i = 0; i < m; i++)
        jli_copy(T + i * all, V + i * m, m);
    for (k = n - 1; k >= 0; k--) {
        jl_real c = reach(h, S[k * (n + 1)]);

        jli_copy(v, a + k * m, m);
        memset(v + m, 0, (size_t)n * sizeof *v);
        v[m + k] = 2 * c;
        for (i = k + 1; i < n; i++)
            v[m + i] = 2 * c * S[k * n + i];
        jli_ud_absorb(T, v, 1 / (4 * ((jl_real)n + h->kappa)), 0, all);
    }
}

/* With T = [Uzz Uzx; 0 Uxx]:  S = Uzz' Dz Uzz,  y = Uzz'^-1 nu,
 *     x = x- + Uzx' y,  P = Uxx' Dx Uxx;  y [m] work */
static int condition(jl_real *x, jl_real *S, jl_innovation *innovation,
                     const jl_real *T, const jl_real *xp, jl_real *y,
                     int n, int m)
{
    int all = m + n, a, b, i;
    jl_real twice = (jl_real)m * JLI_LOG_2PI;

    jli_copy(x, xp, n);
    innovation->nis = 0;
    for (a = 0; a < m; a++) {
        const jl_real *U = T + a * all;

        if (!(U[a] > 0))
            return JL_ESINGULAR;
        y[a] = innovation->nu[a];
        for (b = 0; b < a; b++)
            y[a] -= T[b * all + a] * y[b];
        for (i = 0; i < n; i++)
            x[i] += U[m + i] * y[a];
        innovation->nis += y[a] * y[a] / U[a];
        twice += jl_log(U[a]);
    }
    for (i = 0; i < n; i++)
        jli_copy(S + i * n, T + (m + i) * all + m, n);
    twice += innovation->nis;
    innovation->loglik = -twice / 2;
    return jli_finite(twice) && jli_factor_ok(x, S, n) ? JL_OK : JL_ENONFINITE;
}

/* scratch [n n + 4 n m + 2 m m + m + n] */
static int update(jl_real *x, jl_real *S, jl_innovation *innovation,
                  const jl_mode *mode, const jl_real *xp, const jl_real *Sp,
                  const jl_real *z, jl_real *scratch, int n, int m, int e)
{
    const jl_nonlinear *nl = mode->nonlinear;
    int status;
    jl_real *a = scratch, *b = a + n * m, *V = b + n * m, *T = V + m * m;
    jl_real *v = T + (m + n) * (m + n), *nu = innovation->nu;
    struct map h;

    if (nl == NULL || nl->h == NULL)
        return jli_sqrt_update(x, S, innovation, mode, xp, Sp, z, scratch, n,
                               m, e);
    if (!jl_vec_within(z, m, JL_LARGE))
        return JL_ENONFINITE;
    h.of = nl->h;
    h.residual = nl->residual;
    h.context = nl->context;
    h.kappa = nl->kappa;
    h.n = n;
    h.m = m;
    status = look_around(v, a, b, &h, xp, Sp, T);
    if (status != JL_OK)
        return status;
    jli_copy(nu, z, m);
    status = subtract(nu, &h, v);               /* z - y0 ... */
    if (status == JL_OK) {
        jli_copy(V, mode->V, m * m);
        bend(V, v, b, &h);
        status = subtract(nu, &h, v);           /* ... - shift */
    }
    if (status != JL_OK)
        return status;
    join(T, V, a, &h, Sp, v);
    return condition(x, S, innovation, T, xp, v, n, m);
}

JLI_FORM_FUNCTIONS(unscented, predict, update, mode->n, mode->m,
                   mode->block, mode->every)

const jl_kf_form jl_kf_unscented = {
    unscented_predict, unscented_update, unscented_step, &jl_cov_ud, 0, 0
};
