/* What a good programmer would write for any size: straightforward loops, no
 * library.  Covariances are full, and symmetric ones are computed whole. */
#include "sizes.h"

#include <stdlib.h>
#include <string.h>
#include <tgmath.h>

#include "bench.h"

#define LOG_2PI JL_C(1.8378770664093454836)

struct plain_filter {
    struct sizes_filter base;
    const struct sizes_model *model;
    enum sizes_form form;
    jl_real *x, *P, *mu, *logmu;         /* of the modes                     */
    jl_real *x0, *P0, *xp, *Pp;          /* mixed (all modes), predicted     */
    jl_real *xhat, *Phat;
    jl_real *c, *w, *l, *d;
    jl_real *T, *HP, *S, *K, *KS, *nu, *A;
};

static struct plain_filter *of(struct sizes_filter *f)
{
    return (struct plain_filter *)f;
}

/* C = A B */
static void mul(jl_real *C, const jl_real *A, const jl_real *B, int n, int m,
                int p)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < p; j++) {
            jl_real s = 0;

            for (int k = 0; k < m; k++)
                s += A[i * m + k] * B[k * p + j];
            C[i * p + j] = s;
        }
}

/* C = A B' + D */
static void mul_t_add(jl_real *C, const jl_real *A, const jl_real *B,
                      const jl_real *D, int n, int m, int p)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < p; j++) {
            jl_real s = D[i * p + j];

            for (int k = 0; k < m; k++)
                s += A[i * m + k] * B[j * m + k];
            C[i * p + j] = s;
        }
}

/* A = L L' in place, lower triangle; returns log det A. */
static jl_real factor(jl_real *A, int n)
{
    jl_real logdet = 0;

    for (int j = 0; j < n; j++) {
        for (int k = 0; k < j; k++)
            for (int i = j; i < n; i++)
                A[i * n + j] -= A[i * n + k] * A[j * n + k];
        A[j * n + j] = sqrt(A[j * n + j]);
        for (int i = j + 1; i < n; i++)
            A[i * n + j] /= A[j * n + j];
        logdet += 2 * log(A[j * n + j]);
    }
    return logdet;
}

/* X = (L L')^-1 X, X [n,m] */
static void solve(const jl_real *L, jl_real *X, int n, int m)
{
    for (int j = 0; j < m; j++) {
        for (int i = 0; i < n; i++) {
            for (int k = 0; k < i; k++)
                X[i * m + j] -= L[i * n + k] * X[k * m + j];
            X[i * m + j] /= L[i * n + i];
        }
        for (int i = n - 1; i >= 0; i--) {
            for (int k = i + 1; k < n; k++)
                X[i * m + j] -= L[k * n + i] * X[k * m + j];
            X[i * m + j] /= L[i * n + i];
        }
    }
}

static void predict(struct plain_filter *f, int j, const jl_real *x,
                    const jl_real *P)
{
    const struct sizes_model *model = f->model;
    int n = model->n;
    const jl_real *F = model->F + j * n * n, *u = model->u + j * n;

    for (int i = 0; i < n; i++) {
        f->xp[i] = u[i];
        for (int k = 0; k < n; k++)
            f->xp[i] += F[i * n + k] * x[k];
    }
    mul(f->T, F, P, n, n, n);
    mul_t_add(f->Pp, f->T, F, model->W + j * n * n, n, n, n);
}

/* P = A Pp A' + K R K', A = I - K H; K' is in f->K [m,n]. */
static void joseph(struct plain_filter *f, jl_real *P, const jl_real *H,
                   const jl_real *R, int n, int m)
{
    const jl_real *K = f->K;

    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++) {
            f->A[i * n + k] = i == k;
            for (int a = 0; a < m; a++)
                f->A[i * n + k] -= K[a * n + i] * H[a * n + k];
        }
    mul(f->T, f->A, f->Pp, n, n, n);
    mul(f->KS, R, K, m, m, n);
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++) {
            jl_real s = 0;

            for (int a = 0; a < n; a++)
                s += f->T[i * n + a] * f->A[k * n + a];
            for (int a = 0; a < m; a++)
                s += K[a * n + i] * f->KS[a * n + k];
            P[i * n + k] = s;
        }
}

/* From xp, Pp; returns the log-likelihood. */
static jl_real update(struct plain_filter *f, int j, jl_real *x, jl_real *P,
                     const jl_real *z)
{
    const struct sizes_model *model = f->model;
    int n = model->n, m = model->m;
    const jl_real *H = model->H + j * m * n, *R = model->R + j * m * m;
    jl_real loglik;

    mul(f->HP, H, f->Pp, m, n, n);
    mul_t_add(f->S, f->HP, H, R, m, n, m);
    for (int a = 0; a < m; a++) {
        f->nu[a] = z[a];
        for (int k = 0; k < n; k++)
            f->nu[a] -= H[a * n + k] * f->xp[k];
    }
    loglik = (jl_real)m * LOG_2PI + factor(f->S, m);
    memcpy(f->K, f->HP, (size_t)(m * n) * sizeof *f->K);
    solve(f->S, f->K, m, n);                    /* K' = S^-1 H P- */
    for (int i = 0; i < n; i++) {
        x[i] = f->xp[i];
        for (int a = 0; a < m; a++)
            x[i] += f->K[a * n + i] * f->nu[a];
    }
    if (f->form == JOSEPH)
        joseph(f, P, H, R, n, m);
    else
        for (int i = 0; i < n; i++)             /* P- - K S K' */
            for (int k = 0; k < n; k++) {
                jl_real s = f->Pp[i * n + k];

                for (int a = 0; a < m; a++)
                    s -= f->K[a * n + i] * f->HP[a * n + k];
                P[i * n + k] = s;
            }
    for (int a = 0; a < m; a++) {               /* nu' S^-1 nu */
        for (int k = 0; k < a; k++)
            f->nu[a] -= f->S[a * m + k] * f->nu[k];
        f->nu[a] /= f->S[a * m + a];
        loglik += f->nu[a] * f->nu[a];
    }
    return -loglik / 2;
}

/* mean and cov of a mixture of the modes with weights w [M] */
static void pool(struct plain_filter *f, jl_real *mean, jl_real *cov,
                 const jl_real *w)
{
    int M = f->model->M, n = f->model->n;

    memset(mean, 0, (size_t)n * sizeof *mean);
    memset(cov, 0, (size_t)(n * n) * sizeof *cov);
    for (int i = 0; i < M; i++)
        for (int a = 0; a < n; a++)
            mean[a] += w[i] * f->x[i * n + a];
    for (int i = 0; i < M; i++) {
        for (int a = 0; a < n; a++)
            f->d[a] = f->x[i * n + a] - mean[a];
        for (int a = 0; a < n; a++)
            for (int b = 0; b < n; b++)
                cov[a * n + b] += w[i] * (f->P[i * n * n + a * n + b]
                                          + f->d[a] * f->d[b]);
    }
}

static jl_real step_imm(struct sizes_filter *base, const jl_real *z)
{
    struct plain_filter *f = of(base);
    int M = f->model->M, n = f->model->n;
    const jl_real *Pi = f->model->Pi;
    jl_real most = -JL_REAL_MAX, sum = 0, loglik;

    for (int j = 0; j < M; j++) {
        f->c[j] = 0;
        for (int i = 0; i < M; i++)
            f->c[j] += Pi[i * M + j] * f->mu[i];
        for (int i = 0; i < M; i++)
            f->w[i] = Pi[i * M + j] * f->mu[i] / f->c[j];
        pool(f, f->x0 + j * n, f->P0 + j * n * n, f->w);
    }
    for (int j = 0; j < M; j++) {
        predict(f, j, f->x0 + j * n, f->P0 + j * n * n);
        f->l[j] = update(f, j, f->x + j * n, f->P + j * n * n, z);
        f->logmu[j] = log(f->c[j]) + f->l[j];
        most = fmax(most, f->logmu[j]);
    }
    for (int j = 0; j < M; j++) {
        f->mu[j] = exp(f->logmu[j] - most);
        sum += f->mu[j];
    }
    loglik = most + log(sum);
    for (int j = 0; j < M; j++) {
        f->mu[j] /= sum;
        f->logmu[j] -= loglik;
    }
    pool(f, f->xhat, f->Phat, f->mu);
    return loglik;
}

static jl_real step_kalman(struct sizes_filter *base, const jl_real *z)
{
    struct plain_filter *f = of(base);

    predict(f, 0, f->x, f->P);
    return update(f, 0, f->x, f->P, z);
}

static void start(struct sizes_filter *base)
{
    struct plain_filter *f = of(base);
    const struct sizes_model *model = f->model;
    size_t M = (size_t)model->M, n = (size_t)model->n;

    memcpy(f->x, model->x, M * n * sizeof *f->x);
    memcpy(f->P, model->P, M * n * n * sizeof *f->P);
    memcpy(f->mu, model->mu, M * sizeof *f->mu);
}

static struct sizes_estimate estimate(struct sizes_filter *base)
{
    const struct plain_filter *f = of(base);
    struct sizes_estimate kalman = { f->x, f->P, f->mu };
    struct sizes_estimate imm = { f->xhat, f->Phat, f->mu };

    return f->model->kalman ? kalman : imm;
}

static jl_real *reals(int count)
{
    jl_real *r = calloc((size_t)count, sizeof *r);

    bench_must(r != NULL, "memory");
    return r;
}

struct sizes_filter *sizes_plain(const struct sizes_model *model,
                                 enum sizes_form form)
{
    int M = model->M, n = model->n, m = model->m;
    struct plain_filter *f;

    if (form == SQRT)
        return NULL;
    f = calloc(1, sizeof *f);
    bench_must(f != NULL, "memory");
    f->base.start = start;
    f->base.step = model->kalman ? step_kalman : step_imm;
    f->base.estimate = estimate;
    f->model = model;
    f->form = form;
    f->x = reals(M * n);
    f->P = reals(M * n * n);
    f->mu = reals(M);
    f->logmu = reals(M);
    f->x0 = reals(M * n);
    f->P0 = reals(M * n * n);
    f->xp = reals(n);
    f->Pp = reals(n * n);
    f->xhat = reals(n);
    f->Phat = reals(n * n);
    f->c = reals(M);
    f->w = reals(M);
    f->l = reals(M);
    f->d = reals(n);
    f->T = reals(n * n);
    f->HP = reals(m * n);
    f->S = reals(m * m);
    f->K = reals(m * n);
    f->KS = reals(m * n);
    f->nu = reals(m);
    f->A = reals(n * n);
    start(&f->base);
    return &f->base;
}
