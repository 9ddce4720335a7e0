/* Whether modes decouple: norms of their steady covariances. */
#include "cgimm/cg_parts.h"

#include <string.h>

#include "base/mathx.h"

/* The eigenvalues of A [3,3], symmetric, by Jacobi's rotations; A is
 * overwritten.  Five sweeps leave nothing off the diagonal. */
static void eigenvalues(jl_real *lambda, jl_real A[3][3])
{
    int sweep, p, q, k;

    for (sweep = 0; sweep < 8; sweep++)
        for (p = 0; p < 2; p++)
            for (q = p + 1; q < 3; q++) {
                jl_real theta, t, c, s;

                if (A[p][q] == 0)
                    continue;
                theta = (A[q][q] - A[p][p]) / (2 * A[p][q]);
                t = (theta < 0 ? -1 : 1)
                    / (jli_abs(theta) + jli_sqrt(theta * theta + 1));
                c = 1 / jli_sqrt(t * t + 1);
                s = t * c;
                for (k = 0; k < 3; k++) {
                    jl_real a = A[k][p], b = A[k][q];

                    A[k][p] = c * a - s * b;
                    A[k][q] = s * a + c * b;
                }
                for (k = 0; k < 3; k++) {
                    jl_real a = A[p][k], b = A[q][k];

                    A[p][k] = c * a - s * b;
                    A[q][k] = s * a + c * b;
                }
            }
    for (k = 0; k < 3; k++)
        lambda[k] = A[k][k];
}

static jl_real largest(const jl_real *lambda)
{
    jl_real most = 0;
    int k;

    for (k = 0; k < 3; k++)
        if (jli_abs(lambda[k]) > most)
            most = jli_abs(lambda[k]);
    return most;
}

/* Steady P in [3,3], what the mode lacks 0. */
static int cov_of(jl_real P[3][3], const jl_cg_gains *gains, jl_real T,
                  jl_real R)
{
    jl_real own[9];
    int n = gains->order, i, status;

    status = jl_cg_cov(own, gains->steady, n, T, R);
    memset(P, 0, 9 * sizeof P[0][0]);
    for (i = 0; status == JL_OK && i < n; i++)
        memcpy(P[i], own + i * n, (size_t)n * sizeof *own);
    return status;
}

static int is_probability(jl_real p)
{
    return p >= 0 && p <= 1;
}

int jl_cg_coupling_of(jl_cg_coupling *c, const jl_cg_gains *i,
                      const jl_cg_gains *j, jl_real stay, jl_real jump,
                      jl_real mu_i, jl_real mu_j, jl_real T, jl_real R)
{
    jl_real Pi[3][3], D[3][3], of_Pi[3], of_D[3], all, norm, least;
    int r, s, status = cov_of(Pi, i, T, R);

    if (status == JL_OK)
        status = cov_of(D, j, T, R);
    if (status != JL_OK)
        return status;
    all = stay * mu_i + jump * mu_j;
    if (!is_probability(stay) || !is_probability(jump)
        || !is_probability(mu_i) || !is_probability(mu_j) || !(all > 0))
        return JL_EPROB;
    for (r = 0; r < 3; r++)
        for (s = 0; s < 3; s++)
            D[r][s] = Pi[r][s] - D[r][s];
    eigenvalues(of_Pi, Pi);
    eigenvalues(of_D, D);
    norm = largest(of_D);
    least = of_D[0] < of_D[1] ? of_D[0] : of_D[1];
    least = of_D[2] < least ? of_D[2] : least;
    c->weight = jump * mu_j / all;
    c->change = c->weight * norm / largest(of_Pi);
    c->conservative = least >= -16 * JL_EPSILON * norm;
    return JL_OK;
}
