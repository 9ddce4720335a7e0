/* What is zero in the matrices of a mode: products leave it out. */
#include "model/structure.h"

/* Of equal blocks along the diagonal the smallest outside which F is zero. */
static int smallest_block(const jl_real *F, int n)
{
    int b, i, k;

    for (b = 1; b < n; b++) {
        int fits = n % b == 0;

        for (i = 0; i < n && fits; i++)
            for (k = 0; k < n && fits; k++)
                fits = i / b == k / b || F[i * n + k] == 0;
        if (fits)
            break;
    }
    return b;
}

/* Where row a of H has its only element, a 1: a * this; 0: it has not. */
static int picked_every(const jl_real *H, int n, int m)
{
    int every = 0, a, k;

    for (k = 1; k < n && every == 0; k++)
        if (m > 1 && H[n + k] != 0)
            every = k;
    if (m == 1)
        every = n;                      /* state 0, and no other */
    if (every == 0 || (m - 1) * every >= n)
        return 0;
    for (a = 0; a < m; a++)
        for (k = 0; k < n; k++)
            if (H[a * n + k] != (jl_real)(k == a * every))
                return 0;
    return every;
}

void jli_mode_structure(jl_mode *mode)
{
    mode->block = smallest_block(mode->F, mode->n);
    mode->every = picked_every(mode->H, mode->n, mode->m);
}
