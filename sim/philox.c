#include "philox.h"

static void round_of(uint32_t c[4], uint32_t k0, uint32_t k1)
{
    uint64_t a = (uint64_t)c[0] * 0xD2511F53u, b = (uint64_t)c[2] * 0xCD9E8D57u;

    c[0] = (uint32_t)(b >> 32) ^ c[1] ^ k0;
    c[2] = (uint32_t)(a >> 32) ^ c[3] ^ k1;
    c[1] = (uint32_t)b;
    c[3] = (uint32_t)a;
}

void philox(uint32_t counter[4], const uint32_t key[2])
{
    uint32_t i;

    for (i = 0; i < 10; i++)            /* the key grows by Weyl's sequence */
        round_of(counter, key[0] + i * 0x9E3779B9u, key[1] + i * 0xBB67AE85u);
}

/* 53 bits, above 0 and at most 1. */
static double uniform(uint32_t high, uint32_t low)
{
    uint64_t bits = ((uint64_t)high << 32 | low) >> 11;

    return (double)(bits + 1) / 9007199254740992.0;
}

jl_real philox_normal(uint64_t seed, uint32_t run, uint32_t index)
{
    const uint32_t key[2] = { (uint32_t)seed, (uint32_t)(seed >> 32) };
    uint32_t c[4] = { index, run, 0, 0 };
    jl_real s, cosine;

    philox(c, key);
    (void)jl_sincos(&s, &cosine,
                    (jl_real)(6.283185307179586 * uniform(c[2], c[3])));
    return jl_sqrt(-2 * jl_log((jl_real)uniform(c[0], c[1]))) * cosine;
}
