/* How an IEEE number lies in memory: the only place that knows.  Octet order
 * does not matter, and neither does the order of the two words of a double. */
#ifndef JL_IEEE_H
#define JL_IEEE_H

#include <string.h>

#include "cc.h"
#include "jumplink/base.h"

JL_STATIC_ASSERT(FLT_RADIX == 2 && CHAR_BIT == 8, radix_and_octets);
JL_STATIC_ASSERT(sizeof(jl_u32) == 4, a_word_is_32_bits);

/* Of the digits after the leading 1 JLI_TOP_BITS go to the one part of a number
 * and the rest to the other.  For float this is not where the word ends: a table
 * entry of 8 bits times either part, 1 + 8 and 15 bits, must be exact (log.c).
 * To JLI_WHOLE numbers that are added are rounded to integers. */
#if JL_REAL_FLOAT

JL_STATIC_ASSERT(FLT_MANT_DIG == 24 && FLT_MAX_EXP == 128, ieee_single);
JL_STATIC_ASSERT(sizeof(float) == 4, float_is_one_word);

#define JLI_TOP_BITS 8
#define JLI_WHOLE JL_C(12582912.0)      /* 1.5 2^23 */

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

/* i of x = JLI_WHOLE + i, 0 <= i < 2^22. */
JL_INLINE jl_u32 jli_integer(jl_real x)
{
    jl_u32 word;

    memcpy(&word, &x, sizeof word);
    return word & 0x3fffff;
}

/* x = (top + low) 2^e, x > 0, normal: 1 <= top < 2, and `digits` are those of
 * top after its point.  Returns e. */
JL_INLINE int jli_split(jl_real *top, jl_real *low, jl_u32 *digits, jl_real x)
{
    jl_u32 word, part;
    float m;

    memcpy(&word, &x, sizeof word);
    *digits = word >> 15 & 0xff;
    part = *digits << 15 | 0x3f800000;
    memcpy(top, &part, sizeof part);
    part = (word & 0x7fffff) | 0x3f800000;
    memcpy(&m, &part, sizeof part);
    *low = m - *top;
    return (int)(word >> 23) - 127;
}

#else

JL_STATIC_ASSERT(DBL_MANT_DIG == 53 && DBL_MAX_EXP == 1024, ieee_double);
JL_STATIC_ASSERT(sizeof(double) == 8, double_is_two_words);

#define JLI_TOP_BITS 20
#define JLI_WHOLE JL_C(6755399441055744.0)      /* 1.5 2^52 */

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

JL_INLINE jl_u32 jli_integer(jl_real x)
{
    jl_u32 words[2];

    memcpy(words, &x, sizeof words);
    return words[!jli_first_word()] & 0x3fffff;
}

JL_INLINE int jli_split(jl_real *top, jl_real *low, jl_u32 *digits, jl_real x)
{
    jl_u32 words[2], part[2];
    double m;

    memcpy(words, &x, sizeof words);
    *digits = words[jli_first_word()] & 0xfffff;
    part[jli_first_word()] = *digits | 0x3ff00000;
    part[!jli_first_word()] = 0;
    memcpy(top, part, sizeof part);
    part[!jli_first_word()] = words[!jli_first_word()];
    memcpy(&m, part, sizeof part);
    *low = m - *top;
    return (int)(words[jli_first_word()] >> 20) - 1023;
}

#endif
#endif
