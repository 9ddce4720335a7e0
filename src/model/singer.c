/* Singer's motion (IEEE Trans. AES-6, 1970): the acceleration is a first-order
 * Markov process of standard deviation s and correlation time tau.  Over T,
 * with theta = T / tau and e = exp(-theta),
 *
 *     F = [1 T tau^2 (theta - 1 + e); 0 1 tau (1 - e); 0 0 e]
 *     W = 2 s^2 / tau * integral over 0..T of f f',  f = column 3 of F
 *
 * Written out as by Singer, the elements of W cancel for small theta: of terms
 * of the size of 1 the first leaves theta^5/10, which is no digit of a double
 * at theta = 1/1000.  Elimination in W from the acceleration up gives, with
 * h = theta/2, a factor that is simpler:
 *
 *     q_0 = s^2 (1 - e^2)                          N_0 = [pa va 1]
 *     q_1 = 2 s^2 tau^2 (theta - 2 tanh h)         N_1 = [T/2 1 0]
 *     q_2 = s^2 tau^4 (2 theta + theta^3/6 - theta^2 coth h)    N_2 = [1 0 0]
 *     pa = tau^2 (1 - theta / sinh theta),         va = tau tanh h
 *
 * and Lambert's continued fraction, tanh h = h / C_0 with C_k = 2 k + 1 +
 * h^2 / C_k+1, turns it, and F, into sums, products and quotients of positive
 * terms.  Measured against 80 digits, theta from 1e-6 to 1e4: F, N, q within
 * 3.1 epsilon of themselves, W 4.2; exp(-theta) is as good as theta.
 */
#include "singer.h"

#include "base/mathx.h"

#define DEPTH 15                /* of the fraction: 2^-57 off at h = FAR */
#define FAR 4                   /* from here on C_0 - 1, C_1 - 3 lose little */

/* C_0, C_1, C_2 */
static void fraction(jl_real *C, jl_real h, jl_real e)
{
    jl_real c = 2 * DEPTH + 1;
    int k;

    if (h < FAR) {
        for (k = DEPTH - 1; k > 2; k--)
            c = (jl_real)(2 * k + 1) + h * h / c;
        C[2] = 5 + h * h / c;
        C[1] = 3 + h * h / C[2];
        C[0] = 1 + h * h / C[1];
    } else {
        C[0] = h * (1 + e) / (1 - e);           /* h coth h */
        C[1] = h * h / (C[0] - 1);
        C[2] = h * h / (C[1] - 3);
    }
}

void jli_singer(jl_real *F, jl_real *N, jl_real *q, const jl_motion *motion,
                jl_real dt)
{
    const jl_real s = motion->accel_std, tau = motion->tau_s;
    const jl_real h = dt / tau / 2, e = jl_exp(-2 * h);
    jl_real C[3], pa;

    fraction(C, h, e);

    /* tau^2 h^2 (C_1 - C_0) / (C_0 C_1), or without a difference */
    pa = h < 1 ? dt * dt / 4 * (C[1] - C[0]) / (C[0] * C[1])
        : tau * tau * (1 - 4 * h * e / ((1 - e) * (1 + e)));

    F[0] = F[4] = 1;
    F[1] = dt;
    F[2] = dt * dt / 2 * (1 + h / C[1]) / (C[0] + h);
    F[3] = F[6] = F[7] = 0;
    F[5] = dt / (C[0] + h);
    F[8] = e;

    N[0] = pa;
    N[1] = dt / 2 / C[0];
    N[3] = dt / 2;
    N[2] = N[4] = N[6] = 1;
    N[5] = N[7] = N[8] = 0;

    q[0] = s * s * 4 * (h / (C[0] + h)) * (C[0] / (C[0] + h));
    q[1] = (s * dt) * (s * dt) * (h / C[0] / C[1]);
    q[2] = (s * dt * dt) * (s * dt * dt) * (h / C[1] / C[2] / 12);
}
