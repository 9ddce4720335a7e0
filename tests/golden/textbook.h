/* The IMM as it is usually written down and programmed: whole matrices, the
 * update P = (I - K H) P-, and mode probabilities by products mu_j = c_j
 * N(nu_j; 0, S_j) / sum, or by logarithms.  One measurement, one noise.
 * Included with TYPE, the number type, and NAME(x), which makes names of it. */

typedef struct {
    const struct imm_case *c;
    TYPE x[TEXTBOOK_M][TEXTBOOK_N], P[TEXTBOOK_M][TEXTBOOK_N][TEXTBOOK_N];
    TYPE mu[TEXTBOOK_M], xhat[TEXTBOOK_N], Phat[TEXTBOOK_N][TEXTBOOK_N];
    TYPE loglik;
    TYPE zp[TEXTBOOK_M], S[TEXTBOOK_M];         /* predicted measurement */
} NAME(imm);

/* A number of the case, as the library gets it. */
#define GIVEN(number) ((TYPE)(jl_real)(number))

static void NAME(start)(NAME(imm) *f, const struct imm_case *c)
{
    int n = c->n, j, a, b;

    assert_true(c->m == 1 && c->p == 1);
    assert_true(c->M <= TEXTBOOK_M && n <= TEXTBOOK_N);
    memset(f, 0, sizeof *f);
    f->c = c;
    for (j = 0; j < c->M; j++) {
        f->mu[j] = GIVEN(c->mu0[j]);
        for (a = 0; a < n; a++) {
            f->x[j][a] = GIVEN(c->x0[j * n + a]);
            for (b = 0; b < n; b++)
                f->P[j][a][b] = GIVEN(c->P0[j * n * n + a * n + b]);
        }
    }
}

/* mean and covariance of all modes with weights w */
static void NAME(pool)(TYPE *mean, TYPE (*cov)[TEXTBOOK_N], const TYPE *w,
                       const NAME(imm) *f)
{
    int n = f->c->n, M = f->c->M, i, a, b;

    for (a = 0; a < n; a++)
        for (mean[a] = 0, i = 0; i < M; i++)
            mean[a] += w[i] * f->x[i][a];
    for (a = 0; a < n; a++)
        for (b = 0; b < n; b++)
            for (cov[a][b] = 0, i = 0; i < M; i++)
                cov[a][b] += w[i] * (f->P[i][a][b] + (f->x[i][a] - mean[a])
                                     * (f->x[i][b] - mean[b]));
}

/* x, P of mode j to the prediction and, unless z is NULL, on to the update. */
static void NAME(filter)(NAME(imm) *f, int j, const TYPE *z)
{
    const struct imm_case *c = f->c;
    const double *F = c->F + j * c->n * c->n, *G = c->G + j * c->n;
    const double *H = c->H + j * c->n;
    TYPE xp[TEXTBOOK_N], FP[TEXTBOOK_N][TEXTBOOK_N];
    TYPE Pp[TEXTBOOK_N][TEXTBOOK_N], PH[TEXTBOOK_N], K[TEXTBOOK_N];
    int n = c->n, a, b, k;

    for (a = 0; a < n; a++)
        for (xp[a] = GIVEN(G[a]) * GIVEN(c->w_bar[j]), k = 0; k < n; k++)
            xp[a] += GIVEN(F[a * n + k]) * f->x[j][k];
    for (a = 0; a < n; a++)
        for (b = 0; b < n; b++)
            for (FP[a][b] = 0, k = 0; k < n; k++)
                FP[a][b] += GIVEN(F[a * n + k]) * f->P[j][k][b];
    for (a = 0; a < n; a++)
        for (b = 0; b < n; b++) {
            Pp[a][b] = GIVEN(G[a]) * GIVEN(c->Q[j]) * GIVEN(G[b]);
            for (k = 0; k < n; k++)
                Pp[a][b] += FP[a][k] * GIVEN(F[b * n + k]);
        }
    f->zp[j] = 0;
    f->S[j] = GIVEN(c->R[j]);
    for (a = 0; a < n; a++) {
        for (PH[a] = 0, b = 0; b < n; b++)
            PH[a] += Pp[a][b] * GIVEN(H[b]);
        f->zp[j] += GIVEN(H[a]) * xp[a];
        f->S[j] += GIVEN(H[a]) * PH[a];
    }
    for (a = 0; a < n; a++) {
        K[a] = z != NULL ? PH[a] / f->S[j] : 0;
        f->x[j][a] = xp[a] + (z != NULL ? K[a] * (*z - f->zp[j]) : 0);
    }
    for (a = 0; a < n; a++)
        for (b = 0; b < n; b++)
            for (f->P[j][a][b] = 0, k = 0; k < n; k++)
                f->P[j][a][b] += ((TYPE)(a == k) - K[a] * GIVEN(H[k]))
                    * Pp[k][b];
}

static void NAME(weigh)(NAME(imm) *f, const TYPE *c, TYPE z, int products)
{
    const long double two_pi = 6.283185307179586476925L;
    TYPE l[TEXTBOOK_M], most = 0, sum = 0;
    int j, M = f->c->M;

    for (j = 0; j < M; j++) {
        const TYPE nu = z - f->zp[j];

        l[j] = (TYPE)(logl(c[j]) - logl(two_pi * f->S[j]) / 2)
            - nu / f->S[j] * nu / 2;
        if (j == 0 || l[j] > most)
            most = l[j];
    }
    if (products)
        most = 0;
    for (j = 0; j < M; j++)
        sum += f->mu[j] = (TYPE)expl(l[j] - most);
    for (j = 0; j < M; j++)
        f->mu[j] /= sum;
    f->loglik = most + (TYPE)logl(sum);
}

static void NAME(step)(NAME(imm) *f, TYPE z, int products)
{
    const struct imm_case *of = f->c;
    NAME(imm) old = *f;
    TYPE c[TEXTBOOK_M], w[TEXTBOOK_M];
    int i, j, M = of->M;

    for (j = 0; j < M; j++) {
        for (c[j] = 0, i = 0; i < M; i++)
            c[j] += GIVEN(of->Pi[i * M + j]) * old.mu[i];
        for (i = 0; i < M; i++)
            w[i] = GIVEN(of->Pi[i * M + j]) * old.mu[i] / c[j];
        NAME(pool)(f->x[j], f->P[j], w, &old);
        NAME(filter)(f, j, &z);
    }
    NAME(weigh)(f, c, z, products);
    NAME(pool)(f->xhat, f->Phat, f->mu, f);
}

#undef GIVEN
