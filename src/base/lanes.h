/* Several reals that the machine adds and multiplies at once. */
#ifndef JL_LANES_H
#define JL_LANES_H

#include "jumplink/base.h"

/* jli_wide and jli_pack hold JLI_WIDE and JLI_PACK reals, from anywhere in an
 * array of reals; 1 where the machine or the compiler has nothing of the kind.
 * JLI_LANE is the i-th of them, JLI_NOUGHT initialises them. */
#if defined(__GNUC__) && (defined(__SSE2__) || defined(__ARM_NEON))
#  if defined(__AVX__)
#    define JLI_WIDEST 32
#  else
#    define JLI_WIDEST 16
#  endif
#  define JLI_WIDE (JLI_WIDEST / (int)sizeof(jl_real))
#  define JLI_PACK (16 / (int)sizeof(jl_real))
typedef jl_real jli_wide __attribute__((vector_size(JLI_WIDEST),
                                        aligned(sizeof(jl_real)), may_alias));
typedef jl_real jli_pack __attribute__((vector_size(16),
                                        aligned(sizeof(jl_real)), may_alias));
#  define JLI_LANE(several, i) (several)[i]
#  define JLI_NOUGHT { 0 }
#else
#  define JLI_LANE(several, i) (several)
#  define JLI_NOUGHT 0
#  define JLI_WIDE 1
#  define JLI_PACK 1
typedef jl_real jli_wide, jli_pack;
#endif

/* what(type, width, end) for columns 0 .. n - 1, the widest last: `end` is
 * where those end that are taken `width` at a time. */
#define JLI_BY_LANES(what, n) \
    what(jl_real, 1, (n) % JLI_PACK) \
    what(jli_pack, JLI_PACK, (n) % JLI_WIDE) \
    what(jli_wide, JLI_WIDE, n)

#endif
