/* How an IEEE number lies in memory: the only place that knows.  Octet order
 * does not matter, and neither does the order of the two words of a double. */
#ifndef JL_IEEE_H
#define JL_IEEE_H

#include <string.h>

#include "cc.h"
#include "jumplink/base.h"

JL_STATIC_ASSERT(FLT_RADIX == 2 && CHAR_BIT == 8, radix_and_octets);
JL_STATIC_ASSERT(sizeof(jl_u32) == 4, a_word_is_32_bits);

/* The digits after the leading 1 are cut into JLI_TOP_BITS and JLI_LOW_BITS.
 * For float this is not where the word ends: a table entry of 8 bits times
 * either part, 1 + 8 and 15 bits, must be exact (log.c). */
#if JL_REAL_FLOAT

JL_STATIC_ASSERT(FLT_MANT_DIG == 24 && FLT_MAX_EXP == 128, ieee_single);
JL_STATIC_ASSERT(sizeof(float) == 4, float_is_one_word);

#define JLI_TOP_BITS 8
#define JLI_LOW_BITS 15

/* 2^k, -126 <= k <= 127. */
JL_INLINE jl_real jli_pow2(int k)
{
    const jl_u32 word = (jl_u32)(k + 127) << 23;
    float x;

    memcpy(&x, &word, sizeof x);
    return x;
}

/* Whether the sign is set: of -0, too. */
JL_INLINE int jli_negative(jl_real x)
{
    jl_u32 word;

    memcpy(&word, &x, sizeof word);
    return (int)(word >> 31);
}

/* x = (1 + (top + low 2^-JLI_LOW_BITS) 2^-JLI_TOP_BITS) 2^e, x > 0, normal.
 * Returns e. */
JL_INLINE int jli_split(jl_u32 *top, jl_u32 *low, jl_real x)
{
    jl_u32 word;

    memcpy(&word, &x, sizeof word);
    *top = word >> JLI_LOW_BITS & 0xff;
    *low = word & 0x7fff;
    return (int)(word >> 23) - 127;
}

#else

JL_STATIC_ASSERT(DBL_MANT_DIG == 53 && DBL_MAX_EXP == 1024, ieee_double);
JL_STATIC_ASSERT(sizeof(double) == 8, double_is_two_words);

#define JLI_TOP_BITS 20
#define JLI_LOW_BITS 32

/* Which word has sign and exponent: the one of 1.0 that is not 0.  A compiler
 * knows the answer. */
JL_INLINE int jli_first_word(void)
{
    const double one = 1;
    jl_u32 words[2];

    memcpy(words, &one, sizeof words);
    return words[0] == 0;
}

JL_INLINE jl_real jli_pow2(int k)               /* -1022 <= k <= 1023 */
{
    jl_u32 words[2];
    double x;

    words[jli_first_word()] = (jl_u32)(k + 1023) << 20;
    words[!jli_first_word()] = 0;
    memcpy(&x, words, sizeof x);
    return x;
}

JL_INLINE int jli_negative(jl_real x)
{
    jl_u32 words[2];

    memcpy(words, &x, sizeof words);
    return (int)(words[jli_first_word()] >> 31);
}

JL_INLINE int jli_split(jl_u32 *top, jl_u32 *low, jl_real x)
{
    jl_u32 words[2];

    memcpy(words, &x, sizeof words);
    *top = words[jli_first_word()] & 0xfffff;
    *low = words[!jli_first_word()];
    return (int)(words[jli_first_word()] >> 20) - 1023;
}

#endif
#endif
