/* Modes given by matrices. */
#include "model/structure.h"

#include "mat/mat_k.h"

int jl_mode_init(jl_mode *mode, int n, int m, int p, jl_real *mem, int cap)
{
    if (n < 1 || n > JL_MAX_STATES || m < 1 || m > JL_MAX_STATES
        || p < 1 || p > JL_MAX_STATES)
        return JL_EDIM;
    if (cap < JL_MODE_MEM(n, m, p))
        return JL_ENOMEM;
    memset(mem, 0, (size_t)JL_MODE_MEM(n, m, p) * sizeof *mem);
    mode->n = n;
    mode->m = m;
    mode->p = p;
    mode->F = mem;
    mode->W = mode->F + n * n;
    mode->u = mode->W + n * n;
    mode->H = mode->u + n;
    mode->R = mode->H + m * n;
    mode->V = mode->R + m * m;
    mode->N = mode->V + m * m;
    mode->q = mode->N + p * n;
    mode->nonlinear = NULL;
    mode->move = NULL;
    mode->sense = NULL;
    mode->block = n;            /* anything may be put there by hand */
    mode->every = 0;
    return JL_OK;
}

/* With Q = U' D U, G Q G' is the sum of D_k times the square of row k of U G'. */
static void set_noises(jl_mode *mode, const jl_real *G, const jl_real *UD)
{
    int n = mode->n, p = mode->p, k, i, a;

    for (k = 0; k < p; k++) {
        mode->q[k] = UD[k * p + k];
        for (i = 0; i < n; i++) {
            jl_real s = G[i * p + k];

            for (a = k + 1; a < p; a++)
                s += UD[k * p + a] * G[i * p + a];
            mode->N[k * n + i] = s;
        }
    }
}

/* R = U' D U in V.  Of full rank, unlike jl_mat_ud's: with a small pivot cut
 * off a measurement that is good would be taken for an exact one. */
static int factor(jl_real *V, const jl_real *R, int m)
{
    int a, b, c;

    memset(V, 0, (size_t)(m * m) * sizeof *V);
    for (a = 0; a < m; a++)
        for (b = a; b < m; b++) {
            jl_real s = R[a * m + b];

            for (c = 0; c < a; c++)
                s -= V[c * m + c] * V[c * m + a] * V[c * m + b];
            if (b == a && !(s >= JL_REAL_MIN))
                return JL_EDEF;
            V[a * m + b] = b == a ? s : s / V[a * m + a];
        }
    return JL_OK;
}

/* NULL stands for zeros. */
static int within(const jl_real *v, int n)
{
    return v == NULL || jl_vec_within(v, n, JL_LARGE);
}

static void put(jl_real *to, const jl_real *from, int n)
{
    if (from != NULL)
        jli_copy(to, from, n);
    else
        memset(to, 0, (size_t)n * sizeof *to);
}

/* -0 becomes 0: a sum with u or W in it is never -0 then, and has the same bits
 * whether or not it leaves out zeros. */
static void unsign_zeros(jl_real *v, int n)
{
    int i;

    for (i = 0; i < n; i++)
        v[i] += 0;
}

int jl_mode_set(jl_mode *mode, const jl_real *F, const jl_real *G,
                const jl_real *Q, const jl_real *w_bar, const jl_real *H,
                const jl_real *R, jl_real *scratch)
{
    int n = mode->n, m = mode->m, p = mode->p, status;
    jl_real *W = scratch, *GQ = W + n * n, *V = GQ + n * (p + 1);
    jl_real *work = V + m * m;

    if (!within(F, n * n) || !jl_vec_within(G, n * p, JL_LARGE)
        || !within(H, m * n) || !within(w_bar, p))
        return JL_ENONFINITE;
    status = jl_mat_check_cov(Q, work, p);
    if (status != JL_OK)
        return status;
    status = jl_mat_check_cov(R, work, m);
    if (status == JL_OK)
        status = factor(V, R, m);
    if (status != JL_OK)
        return status;
    jli_mul(GQ, G, Q, n, p, p);
    jli_mul_t_sym(W, GQ, G, NULL, n, p);
    if (!jl_vec_within(W, n * n, JL_LARGE * JL_LARGE))
        return JL_ENONFINITE;
    if (w_bar != NULL) {
        jli_apply(GQ, G, w_bar, NULL, n, p);
        if (!jl_vec_within(GQ, n, JL_LARGE))
            return JL_ENONFINITE;
    }
    put(mode->u, w_bar != NULL ? GQ : NULL, n);
    unsign_zeros(mode->u, n);
    put(mode->F, F, n * n);
    put(mode->H, H, m * n);
    jli_copy(mode->W, W, n * n);
    unsign_zeros(mode->W, n * n);
    jl_mat_pack(work, R, m);            /* exactly symmetric from here on */
    jl_mat_unpack(mode->R, work, m);
    jli_copy(mode->V, V, m * m);
    jl_mat_ud(work, Q, work + p * p, p);
    set_noises(mode, G, work);
    jli_mode_structure(mode);
    return JL_OK;
}
